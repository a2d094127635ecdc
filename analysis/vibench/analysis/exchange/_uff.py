"""Universal File Format: samples as dataset 58 in binary form, with units as dataset 164.

Layout: SDRC universal dataset 58, "Function at Nodal DOF", and its binary variant 58b (Structural Dynamics
Research Laboratory, University of Cincinnati). The time increment has five decimals, which means an error of
0.5 ms after 200 s at 51.2 kHz. ID line 5 therefore contains the exact rate.

The reader takes time responses from datasets 58, text or binary, such as those of Polytec's software. The
mapping must give the sample rate. The number of binary samples is taken from the header, because the end of a
dataset differs between makers.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from enum import IntEnum
from functools import cache, partial
from math import isfinite
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from vibench.acquisition.recording import ChannelHeader, Origin, Recording, RecordingDescription

from ..errors import UnusableData
from ..signals import Complexes, Reals
from ._excerpt import Excerpt, TransferObserver, ignore_progress
from ._source_channel import SECONDS, Read, Source, SourceChannel, rate_bounds, text_of
from ._times import agrees

DELIMITER = "    -1"
TIME_RESPONSE = 1
REAL_SINGLE, REAL_DOUBLE = 2, 4
SINGLE_BYTES, DOUBLE_BYTES = 4, 8
EVENLY_SPACED = 1
TIME_AXIS = 17
UNKNOWN = (0, 0, 0, 0)
QUANTITIES = {
    "displacement": (8, 1, 0, 0),
    "velocity": (11, 1, 0, 0),
    "acceleration": (12, 1, 0, 0),
    "force": (13, 0, 1, 0),
}
"""Specific data type, and the exponents of length, force and temperature (addendum A)."""
MONTHS = ("JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC")
ID_WIDTH = 80
RATE = re.compile(r"\bsample_rate_hz=(\S+)")
ORIGIN = re.compile(rf"\borigin=({'|'.join(Origin)})\b")


def id_line(text: str) -> str:
    """Return the text as one of the five ID lines; NONE for an empty text."""
    return f"{text.strip() or 'NONE':<{ID_WIDTH}.{ID_WIDTH}}"


SI_UNITS = (
    f"{DELIMITER}\n   164\n{1:10d}{'SI: metre (newton)':<20.20}{2:10d}\n"
    + "".join(f"{factor:25.16E}" for factor in (1.0, 1.0, 1.0))
    + f"\n{273.15:25.16E}\n{DELIMITER}\n"
).replace("E+", "D+")
"""Dataset 164: units code 1 (SI), absolute temperature, factors to SI and offset of the Celsius scale."""
SCALAR = 0
"""Direction of the response: none, because recordings do not state one."""


def write_uff(excerpt: Excerpt, path: Path, observer: TransferObserver = ignore_progress) -> None:
    """Write one dataset per channel in blocks; lost samples are NaN."""
    with path.open("xb") as file:
        file.write(SI_UNITS.encode("ascii"))
        for number, channel in enumerate(excerpt.channels, start=1):
            lines = "\n".join(_header(excerpt, channel, number)) + "\n"
            file.write(lines.encode("ascii", "replace"))
            for values in excerpt.channel_blocks(channel.role):
                file.write(values.astype("<f8").tobytes())
                observer(values.size)
            file.write(f"{DELIMITER}\n".encode("ascii"))


def _header(excerpt: Excerpt, channel: ChannelHeader, number: int) -> Iterator[str]:
    """Yield the lines before the samples: the delimiter, the type, and records 1 to 11."""
    recording = excerpt.recording
    rate = recording.sample_rate_hz
    kind, *exponents = QUANTITIES.get(channel.quantity, UNKNOWN)
    yield DELIMITER
    # These numbers announce eleven lines of text, and then little-endian IEEE values.
    yield f"{58:6d}b{1:6d}{2:6d}{11:12d}{excerpt.samples * DOUBLE_BYTES:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    yield id_line(channel.role)
    yield id_line(f"{excerpt.name} {recording.recording_id}")
    yield id_line(date_line(recording.started_utc))
    yield id_line(str(recording.plan.get("name", "")))
    yield id_line(f"sample_rate_hz={rate!r} first_sample={excerpt.start} origin={recording.origin.value}")
    point = f" {'NONE':<10}{number:10d}{SCALAR:4d} {'NONE':<10}{0:10d}{0:4d}"
    yield f"{TIME_RESPONSE:5d}{number:10d}{0:5d}{0:10d}{point}"
    times = f"{excerpt.start / rate:13.5E}{1 / rate:13.5E}{0:13.5E}"
    yield f"{REAL_DOUBLE:10d}{excerpt.samples:10d}{EVENLY_SPACED:10d}{times}"
    yield axis_record(TIME_AXIS, (0, 0, 0), "time", "s")
    yield axis_record(kind, exponents, channel.role, channel.unit)
    yield axis_record(0, (0, 0, 0), "NONE", "NONE")
    yield axis_record(0, (0, 0, 0), "NONE", "NONE")


def axis_record(kind: int, exponents: "tuple[int, ...] | list[int]", label: str, unit: str) -> str:
    """Return a line of records 8 to 11: data type, length, force and temperature exponents, label, unit."""
    return f"{kind:10d}{''.join(f'{each:5d}' for each in exponents)} {label:<20.20} {unit:<20.20}"


def date_line(started_utc: str) -> str:
    """Return ID line 3, such as ``"22-NOV-26 21:04:05"``."""
    moment = datetime.fromisoformat(started_utc)
    return f"{moment.day:02d}-{MONTHS[moment.month - 1]}-{moment:%y} {moment:%H:%M:%S}"


HEADER_LINES = 11
UNITS = "164"
LENGTHS = {1.0: "m", 100.0: "cm", 1000.0: "mm", 39.37: "in"}
"""Unit of length, keyed by the number of units per metre (dataset 164)."""
CODES = {"1": "m", "3": "m", "5": "mm", "6": "cm", "7": "in", "8": "mm", "10": "mm"}
"""Unit of length, keyed by the code of dataset 164."""
MOTIONS = {8: "m", 11: "m/s", 12: "m/s2"}
"""Units of displacement, velocity and acceleration, keyed by data type."""
LEAST_TEXT = 2
"""Minimum number of characters per number in free text: a digit and a separator."""
DIGITS = 5e-6
"""Relative rounding error of a time increment with six digits."""
IEEE = 2
BYTE_ORDERS = {1: "<", 2: ">"}
WIDTHS = {REAL_SINGLE: 13, REAL_DOUBLE: 20}
"""Number of characters per number in fixed-width text."""
SIZES = {REAL_SINGLE: SINGLE_BYTES, REAL_DOUBLE: DOUBLE_BYTES}
TIME_FUNCTIONS = {0, TIME_RESPONSE}
"""Function types that are read: unknown, and time response."""


@dataclass(frozen=True)
class _Body:
    """Location and format of the numbers in a dataset."""

    offset: int
    end: int
    count: int
    kind: int
    order: str
    """Byte order ``"<"`` or ``">"`` of binary numbers; empty for text."""

    def reader(self, path: Path, name: str) -> Read:
        """Return the function that reads the numbers; text is parsed once and kept in memory."""
        if self.order:
            return partial(self._read, path)
        parsed = cache(partial(_text_numbers, path, name, self))
        return lambda start, stop: parsed()[start:stop]

    def _read(self, path: Path, start: int, stop: int) -> Reals:
        size = SIZES[self.kind]
        with path.open("rb") as file:
            file.seek(self.offset + start * size)
            raw = file.read((stop - start) * size)
        return np.frombuffer(raw, dtype=f"{self.order}f{size}").astype(np.float64)


@contextmanager
def open_uff(path: Path) -> Iterator[Source]:
    """Open the time responses of a file, named by the number of their dataset 58: ``"1"``, ``"2"``, ...

    Raises ValueError when a dataset 58 is damaged.
    """
    with path.open("rb") as file:
        bodies = dict(_bodies(file))
    yield Source({each: body.reader(path, each.name) for each, body in bodies.items()})


def _bodies(file: BinaryIO) -> Iterator[tuple[SourceChannel, _Body]]:
    found: list[tuple[list[str], str, _Body | None]] = []
    length = first = ""
    while line := file.readline():
        if line.strip() != DELIMITER.strip().encode():
            continue
        kind = _line(file)
        if kind.strip() == UNITS:
            begin, code, factors = file.tell(), _line(file)[:10].strip(), _line(file)
            per_metre = _real(factors[:25]) or 0.0
            stated = LENGTHS.get(round(per_metre, 2), f"m/{per_metre:g}")
            length = " or ".join(sorted({CODES.get(code, stated), stated}))
            first = first or length
            file.seek(begin)
        if kind[:6].strip() != "58":
            _skip_text(file)
            continue
        header = [_line(file) for _ in range(HEADER_LINES)]
        found.append((header, length, _body(file, kind, header)))
    for number, (header, length, body) in enumerate(found, start=1):
        if body is not None:
            # Create the channels last, because the dataset of units may follow the functions.
            yield _channel(number, header, length or first), body


def _body(file: BinaryIO, kind: str, header: list[str]) -> _Body | None:
    """Return the location of the numbers, and skip them; None if they are not samples over time."""
    ordinate, count, spacing = (_whole(header[6][at : at + 10]) for at in (0, 10, 20))
    if count < 0:
        raise ValueError(f"a dataset of {count} numbers")
    offset, order = file.tell(), 0
    if kind[6:7].lower() == "b":
        order, numbers, length = (_whole(kind[a:b]) for a, b in ((7, 13), (13, 19), (31, 43)))
        if order not in BYTE_ORDERS:
            raise ValueError(f"its byte order is {order}; only 1 (little-endian) and 2 (big) can be read")
        if numbers != IEEE:
            raise ValueError(f"its binary numbers are of kind {numbers}; only {IEEE} (IEEE) can be read")
        file.seek(offset + (count * SIZES[ordinate] if ordinate in SIZES else length))
    _skip_text(file)
    if not order and (most := (file.tell() - offset) // LEAST_TEXT) < count:
        raise ValueError(f"it states {count} numbers, but contains at most {most}")
    is_time = _whole(header[5][:5]) in TIME_FUNCTIONS and _whole(header[7][:10]) in {0, TIME_AXIS}
    if not is_time or ordinate not in SIZES or spacing != EVENLY_SPACED or count < 2:
        return None
    return _Body(offset, file.tell(), count, ordinate, BYTE_ORDERS.get(order, ""))


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        raise ValueError(f"a dataset 58 has {text.strip()!r} instead of a whole number") from error


def _line(file: BinaryIO) -> str:
    """Read one line of a header."""
    return text_of(file.readline())


def _skip_text(file: BinaryIO) -> None:
    """Skip to the end of a dataset."""
    while line := file.readline():
        if line.strip() == DELIMITER.strip().encode():
            return
    raise ValueError("it ends inside a dataset")


def _channel(number: int, header: list[str], length: str) -> SourceChannel:
    rates = [float(found[1]) for line in header[:5] if (found := RATE.search(line))]
    origins = [Origin(found[1]) for line in header[:5] if (found := ORIGIN.search(line))]
    label = header[0].strip()
    unit, start, increment = header[7][46:66].strip(), _real(header[6][30:43]), _real(header[6][43:56])
    second = SECONDS.get(unit.casefold())
    bounds = None if increment is None else rate_bounds(increment, DIGITS * abs(increment), unit)
    direction, kind = header[5][51:55].strip(), _whole(header[8][:10])
    trouble = ""
    if bounds is None and increment:
        trouble = f"has an axis in {unit!r} with steps of {increment:g}"
    elif bounds is not None and rates and not agrees(rates[0], bounds):
        trouble = f"states {rates[0]:.9g} samples/s, but its increment gives {sum(bounds) / 2:.9g}"
    # Without a unit label, motion is in the units of dataset 164.
    motion = MOTIONS.get(kind, "") if length else ""
    own = header[8][46:66].strip().removesuffix("NONE") or motion.replace("m", length, 1)
    quantities = {each: name for name, (each, *_) in QUANTITIES.items() if each in MOTIONS}
    return SourceChannel(
        name=str(number),
        samples=int(header[6][10:20]),
        label="" if label == "NONE" else label,
        sample_rate_hz=rates[0] if rates else None,
        origin=origins[0] if origins else None,
        unit=own,
        quantity="" if own else quantities.get(kind, ""),
        stated_scale=f"direction = {direction}" if direction.startswith("-") else "",
        rate_bounds_hz=bounds,
        start_s=start * second if start is not None and second is not None else None,
        start_error_s=DIGITS * abs(start) * second if start is not None and second is not None else 0.0,
        time_trouble=trouble,
    )


def _real(text: str) -> float | None:
    try:
        value = float(text.upper().replace("D", "E"))
    except ValueError:
        return None
    return value if isfinite(value) else None


def _text_numbers(path: Path, name: str, body: _Body) -> NDArray[np.float64]:
    """Return all numbers of a text dataset, either of fixed width or separated by blanks."""
    with path.open("rb") as file:
        file.seek(body.offset)
        text = file.read(body.end - body.offset).upper().replace(b"D", b"E")
    text = text[: text.rstrip().rfind(b"-1")].replace(b"\r", b"")
    width = WIDTHS[body.kind]
    packed = text.replace(b"\n", b"")
    if len(packed.rstrip()) == body.count * width:
        cells = np.frombuffer(packed, dtype=f"S{width}", count=body.count)
    else:
        cells = np.array(text.split())
    if cells.size != body.count:
        raise UnusableData(
            f"dataset {name} of {path.name} states {body.count} numbers, but contains {cells.size}; "
            "export the file again"
        )
    return cells.astype(np.float64)


# Universal File Format for functions of frequency, as text: frequency responses, coherences and densities.
# Layout: SDRC universal dataset 58, records 1 to 12, function types 4 (frequency response function), 6
# (coherence) and 9 (power spectral density), double precision. Frequencies have six digits, so lines are
# written as evenly spaced only if six digits represent the first line and the spacing exactly. Modal programs
# expect evenly spaced lines that begin at a multiple of the spacing. If the spacing needs more digits, a
# frequency response or coherence is therefore interpolated to the nearest six-digit spacing. All other
# functions are written with the frequency of each line.

_COMPLEX_DOUBLE = 6
_COLOUR = 11
"""Colour of nodes: any of the 16 colours of the dataset's definition."""
_FREQUENCY_AXIS = 18
_PER_LINE = 4
_LEAST_STEP = 1e-9
"""Relative frequency error up to which spectral lines count as evenly spaced."""
_LARGEST_OFFSET = 1e-3
"""Largest offset of the first spectral line from a multiple of the spacing, relative to the spacing."""
_SPACINGS_TRIED = 1000
"""Number of candidates tried on each side of the nearest six-digit spacing; about half are suitable."""


class FunctionType(IntEnum):
    """Type of a function as in record 6."""

    FREQUENCY_RESPONSE = 4
    COHERENCE = 6
    DENSITY = 9


@dataclass(frozen=True)
class FunctionAxis:
    """Axis of a function: the motion of a channel, or no motion."""

    role: str = ""
    """Role of the channel."""
    label: str = "NONE"
    """Label of the axis; 20 characters are written."""
    quantity: str = ""
    """Quantity such as ``"velocity"``; determines data type and exponents."""
    unit: str = "NONE"
    node: int | None = None
    """Node number; None to use the channel number."""
    direction: int = SCALAR
    """1, 2 or 3 along x, y or z, negative in the opposite direction; 0 if unknown."""


@dataclass(frozen=True, eq=False)
class UniversalFunction:
    """One function of frequency."""

    kind: FunctionType
    frequency_hz: Reals
    """Frequencies of the spectral lines in ascending order, shape (lines,) [Hz]."""
    values: Reals | Complexes
    """Values of the function at its frequencies, shape (lines,)."""
    response: FunctionAxis
    reference: FunctionAxis
    note: str
    """Description of how the function was estimated, for ID line 4."""


def write_uff_functions(
    functions: Sequence[tuple[RecordingDescription, UniversalFunction]],
    path: Path,
    nodes: Mapping[int, tuple[float, float, float]] | None = None,
) -> None:
    """Write the units, the coordinates of nodes as dataset 15, then one dataset 58 per function."""
    with path.open("x", encoding="ascii", errors="replace", newline="\n") as file:
        file.write(SI_UNITS)
        if nodes is not None:
            file.write(f"{DELIMITER}\n{15:6d}\n")
            for node, place in nodes.items():
                coordinates = "".join(f"{each:13.5E}" for each in place)
                file.write(f"{node:10d}{0:10d}{0:10d}{_COLOUR:10d}{coordinates}\n")
            file.write(f"{DELIMITER}\n")
        for number, (recording, each) in enumerate(functions, start=1):
            file.writelines(f"{line}\n" for line in _dataset(recording, each, number))


def _dataset(recording: RecordingDescription, function: UniversalFunction, number: int) -> Iterator[str]:
    lines_hz = function.frequency_hz
    function, first, step = _with_spacing(function)
    hz = function.frequency_hz
    response, reference = function.response, function.reference
    yield DELIMITER
    yield f"{58:6d}"
    yield id_line(f"{response.label} over {reference.label}" if reference.role else response.label)
    yield id_line(f"{recording.path.name.removesuffix('.part').removesuffix('.h5')} {recording.recording_id}")
    yield id_line(date_line(recording.started_utc))
    yield id_line(function.note)
    moved = "" if hz is lines_hz else f" interpolated from lines {lines_hz[1] - lines_hz[0]:.10g} Hz apart"
    yield id_line(f"origin={recording.origin.value}{moved}")
    names = "".join(
        f" {'NONE':<10}{_node(each, recording):10d}{each.direction:4d}" for each in (response, reference)
    )
    yield f"{function.kind:5d}{number:10d}{0:5d}{0:10d}{names}"
    ordinate = _COMPLEX_DOUBLE if np.iscomplexobj(function.values) else REAL_DOUBLE
    spacing = (EVENLY_SPACED, first, step) if step else (0, 0.0, 0.0)
    yield f"{ordinate:10d}{hz.size:10d}{spacing[0]:10d}{spacing[1]:13.5E}{spacing[2]:13.5E}{0:13.5E}"
    yield axis_record(_FREQUENCY_AXIS, (0, 0, 0), "frequency", "Hz")
    for axis in (response, reference):
        kind, *exponents = QUANTITIES.get(axis.quantity, UNKNOWN)
        yield axis_record(kind, exponents, axis.label, axis.unit)
    yield axis_record(0, (0, 0, 0), "NONE", "NONE")
    yield from _numbers(function.values, None if step else hz)
    yield DELIMITER


def _node(axis: FunctionAxis, recording: RecordingDescription) -> int:
    roles = recording.roles if isinstance(recording, Recording) else ()
    number = roles.index(axis.role) + 1 if axis.role in roles else 0
    return number if axis.node is None else axis.node


def _with_spacing(function: UniversalFunction) -> tuple[UniversalFunction, float, float]:
    """Return a function, its first frequency and its spacing (six digits each; zeros for uneven spacing)."""
    hz = function.frequency_hz
    if hz.size < 2:
        return function, 0.0, 0.0
    index = np.arange(hz.size, dtype=np.float64)
    spacing = float(hz[-1] - hz[0]) / (hz.size - 1)
    multiples: Reals = (round(float(hz[0]) / spacing) + index) * spacing
    if function.kind is not FunctionType.DENSITY and _agree(multiples, hz):
        first, step = _multiples(float(hz[0]), spacing)
    else:
        first, step = _six_digits(hz[0]), _six_digits(hz[1] - hz[0])
        return (function, first, step) if _agree(first + step * index, hz) else (function, 0.0, 0.0)
    even_hz: Reals = first + step * np.arange(round((hz[-1] - first) / step) + 1 if step else 0)
    if not step or (even_hz.size == hz.size and _agree(even_hz, hz)):
        return function, first, step
    if np.iscomplexobj(function.values):
        values = CubicSpline(hz, function.values)(even_hz)
    else:
        values = np.interp(even_hz, hz, function.values)  # an interpolated coherence may exceed 1
    return replace(function, frequency_hz=even_hz, values=values), first, step


def _agree(lines_hz: Reals, hz: Reals) -> bool:
    return bool(np.all(np.abs(lines_hz - hz) <= _LEAST_STEP * hz[-1]))


def _multiples(lowest_hz: float, spacing: float) -> tuple[float, float]:
    """Return a frequency that is a multiple of a spacing, and this spacing; zeros if there is no such pair.

    Both have six digits. pyEMA and sdypy-EMA count the lines below this frequency; rounding may add one line.
    """
    for number in sorted(range(-_SPACINGS_TRIED, _SPACINGS_TRIED + 1), key=abs):
        step = _six_digits(spacing + number * _last_digit(spacing))
        lowest = round(lowest_hz / step)
        nearest = _six_digits(lowest * step)
        for first in (nearest, _six_digits(nearest - _last_digit(nearest))):
            is_near = abs(first - lowest * step) <= _LARGEST_OFFSET * step
            if is_near and np.ceil(first / ((first + step) - first)) == lowest:
                return first, step
    return 0.0, 0.0


def _last_digit(value: float) -> float:
    return float(10.0 ** (np.floor(np.log10(value)) - 5)) if value > 0 else 0.0


def _numbers(values: Reals | Complexes, frequency_hz: Reals | None) -> Iterator[str]:
    """Return the lines of record 12; with uneven spacing, they include the frequencies."""
    parts = [values.real, values.imag] if np.iscomplexobj(values) else [values]
    columns = [[f"{value:20.11E}" for value in part] for part in parts]
    if frequency_hz is not None:
        columns.insert(0, [f"{hz:13.5E}" for hz in frequency_hz])
    points = ["".join(row) for row in zip(*columns, strict=True)]
    # A line contains four numbers; with frequencies, it contains two real values or one complex value.
    width = _PER_LINE // len(parts) // (1 if frequency_hz is None else 2)
    for start in range(0, len(points), width):
        yield "".join(points[start : start + width])


def _six_digits(value: float) -> float:
    return float(f"{value:.5E}")
