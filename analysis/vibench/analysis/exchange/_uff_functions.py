"""Functions of frequency as Universal File Format: frequency responses, coherences and densities, as text.

Layout: SDRC universal dataset 58, records 1 to 12, function types 4 (frequency response function), 6
(coherence) and 9 (power spectral density), double precision. Text holds frequencies to six digits: lines that
begin and step in six digits are written evenly spaced. A frequency response and its coherence at consecutive
multiples of another spacing are moved to the nearest spacing of six digits; all other lines are written with
the frequency of each. Modal programs expect even lines that begin at a multiple of their spacing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from ..signals.arrays import Complexes, Reals
from ._excerpt import Excerpt
from ._uff import (
    DELIMITER,
    EVENLY_SPACED,
    QUANTITIES,
    REAL_DOUBLE,
    SCALAR,
    SI_UNITS,
    UNKNOWN,
    axis_record,
    date_line,
    id_line,
)

_COMPLEX_DOUBLE = 6
_FREQUENCY_AXIS = 18
_PER_LINE = 4
_LEAST_STEP = 1e-9
"""Relative error of a frequency up to which lines count as evenly spaced."""
_LARGEST_OFFSET = 1e-3
"""Of a written first line from its multiple of the spacing, in spacings."""
_SPACINGS_TRIED = 1000
"""On either side of the nearest one of six digits; about every second one serves."""


class FunctionType(IntEnum):
    """What a dataset holds; numbers of its record 6."""

    FREQUENCY_RESPONSE = 4
    COHERENCE = 6
    DENSITY = 9


@dataclass(frozen=True)
class FunctionAxis:
    """What stands on one side of a function: a channel's motion, or nothing."""

    role: str = ""
    """Of the channel."""
    label: str = "NONE"
    """Twenty characters of it stand on the axis."""
    quantity: str = ""
    """``"velocity"``; decides data type and exponents."""
    unit: str = "NONE"


@dataclass(frozen=True, eq=False)
class UniversalFunction:
    """One function of frequency."""

    kind: FunctionType
    frequency_hz: Reals
    """Ascending, shape (lines,)."""
    values: Reals | Complexes
    """Shape (lines,)."""
    response: FunctionAxis
    reference: FunctionAxis
    note: str
    """How it was estimated, for ID line 4."""


def write_uff_functions(excerpt: Excerpt, functions: Sequence[UniversalFunction], path: Path) -> None:
    """Write one dataset for each function, after the units."""
    with path.open("x", encoding="ascii", errors="replace", newline="\n") as file:
        file.write(SI_UNITS)
        for number, each in enumerate(functions, start=1):
            file.writelines(f"{line}\n" for line in _dataset(excerpt, each, number))


def _dataset(excerpt: Excerpt, function: UniversalFunction, number: int) -> Iterator[str]:
    recording = excerpt.recording
    lines_hz = function.frequency_hz
    function, first, step = _spaced(function)
    hz = function.frequency_hz
    response, reference = function.response, function.reference
    yield DELIMITER
    yield f"{58:6d}"
    yield id_line(f"{response.label} over {reference.label}" if reference.role else response.label)
    yield id_line(f"{excerpt.name} {recording.recording_id}")
    yield id_line(date_line(recording.started_utc))
    yield id_line(function.note)
    moved = "" if hz is lines_hz else f" moved from lines every {lines_hz[1] - lines_hz[0]:.10g} Hz"
    yield id_line(f"origin={recording.origin.value}{moved}")
    roles = recording.roles
    point, other = (roles.index(each.role) + 1 if each.role in roles else 0 for each in (response, reference))
    names = f" {'NONE':<10}{point:10d}{SCALAR:4d} {'NONE':<10}{other:10d}{SCALAR:4d}"
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


def _spaced(function: UniversalFunction) -> tuple[UniversalFunction, float, float]:
    """Return the function, its first line, and its spacing as six digits hold it (0: uneven)."""
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
        values = np.interp(even_hz, hz, function.values)  # a spline of a coherence may rise above 1
    return replace(function, frequency_hz=even_hz, values=values), first, step


def _agree(lines_hz: Reals, hz: Reals) -> bool:
    return bool(np.all(np.abs(lines_hz - hz) <= _LEAST_STEP * hz[-1]))


def _multiples(lowest_hz: float, spacing: float) -> tuple[float, float]:
    """Return a first line and a spacing of six digits that divides it; 0 and 0 where none was found.

    pyEMA and sdypy-EMA count the lines below the first as here: a rounding error adds one.
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
    """Lay the values out in lines of record 12, with their frequencies where these are not evenly spaced."""
    parts = [values.real, values.imag] if np.iscomplexobj(values) else [values]
    columns = [[f"{value:20.11E}" for value in part] for part in parts]
    if frequency_hz is not None:
        columns.insert(0, [f"{hz:13.5E}" for hz in frequency_hz])
    points = ["".join(row) for row in zip(*columns, strict=True)]
    # Four numbers a line; with frequencies two real ones, or one complex.
    width = _PER_LINE // len(parts) // (1 if frequency_hz is None else 2)
    for start in range(0, len(points), width):
        yield "".join(points[start : start + width])


def _six_digits(value: float) -> float:
    return float(f"{value:.5E}")
