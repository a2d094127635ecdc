"""Universal files as a source: the time responses among their datasets 58, text or binary.

Polytec's software exports scans so. Their increment of time has five decimals: the mapping must give
the sample rate. What follows binary samples differs from maker to maker, so their number is taken from
the header and never searched for.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import UnusableData
from ..signals import Reals
from ._source_channel import SourceChannel
from ._uff_format import (
    DELIMITER,
    DOUBLE_BYTES,
    EVENLY_SPACED,
    REAL_DOUBLE,
    REAL_SINGLE,
    SINGLE_BYTES,
    TIME_AXIS,
    TIME_RESPONSE,
    exact_rate_hz,
)

HEADER_LINES = 11
IEEE = 2
BYTE_ORDERS = {1: "<", 2: ">"}
WIDTHS = {REAL_SINGLE: 13, REAL_DOUBLE: 20}
"""Characters of a number in text."""
SIZES = {REAL_SINGLE: SINGLE_BYTES, REAL_DOUBLE: DOUBLE_BYTES}
TIME_FUNCTIONS = {0, TIME_RESPONSE}
"""Kinds of function: unknown, or a time response."""


@dataclass(frozen=True)
class _Body:
    """Where the numbers of a dataset lie, and how they are written."""

    offset: int
    end: int
    count: int
    kind: int
    order: str
    """``"<"`` or ``">"`` for binary numbers, empty for text."""


@dataclass(frozen=True, eq=False)
class UffSource:
    """Channels named by the number of their dataset 58 in the file: ``"1"``, ``"2"``, ..."""

    path: Path
    bodies: Mapping[SourceChannel, _Body]
    parsed: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    """Numbers that stood in the file as text, by channel."""

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """In the order of the file."""
        return tuple(self.bodies)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Read a stretch; text is parsed once and kept."""
        body = self.bodies[channel]
        if not body.order:
            if channel.name not in self.parsed:
                self.parsed[channel.name] = _text_numbers(self.path, channel.name, body)
            return self.parsed[channel.name][start:stop]
        size = SIZES[body.kind]
        with self.path.open("rb") as file:
            file.seek(body.offset + start * size)
            raw = file.read((stop - start) * size)
        return np.frombuffer(raw, dtype=f"{body.order}f{size}").astype(np.float64)


@contextmanager
def opened_uff(path: Path) -> Iterator[UffSource]:
    """Find the time responses of a file; ValueError when a dataset 58 is damaged."""
    with path.open("rb") as file:
        bodies = dict(_bodies(file))
    yield UffSource(path, bodies)


def _bodies(file: BinaryIO) -> Iterator[tuple[SourceChannel, _Body]]:
    number = 0
    while line := file.readline():
        if line.strip() != DELIMITER.strip().encode():
            continue
        kind = _line(file)
        if kind[:6].strip() != "58":
            _skip_text(file)
            continue
        number += 1
        header = [_line(file) for _ in range(HEADER_LINES)]
        body = _body(file, kind, header)
        if body is not None:
            yield _channel(number, header), body


def _body(file: BinaryIO, kind: str, header: list[str]) -> _Body | None:
    """Find the numbers and go past them; None when they are no samples over time."""
    ordinate, count, spacing = (int(header[6][at : at + 10]) for at in (0, 10, 20))
    if count < 0:
        raise ValueError(f"a dataset of {count} numbers")
    offset = file.tell()
    is_binary = kind[6:7].lower() == "b"
    if is_binary:
        order, numbers, length = (int(kind[a:b]) for a, b in ((7, 13), (13, 19), (31, 43)))
        if numbers != IEEE:
            raise ValueError(f"its binary numbers are of kind {numbers}, and only {IEEE} (IEEE) is known")
        file.seek(offset + (count * SIZES[ordinate] if ordinate in SIZES else length))
        _skip_text(file)
    else:
        order = 0
        _skip_text(file)
    is_time = int(header[5][:5]) in TIME_FUNCTIONS and int(header[7][:10]) in {0, TIME_AXIS}
    if not is_time or ordinate not in SIZES or spacing != EVENLY_SPACED or count < 2:
        return None
    return _Body(offset, file.tell(), count, ordinate, BYTE_ORDERS[order] if is_binary else "")


def _line(file: BinaryIO) -> str:
    """Read a line of a header; makers write ``m/s²`` in one of two encodings, and say in neither which."""
    raw = file.readline()
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _skip_text(file: BinaryIO) -> None:
    """Go past the delimiter that ends a dataset."""
    while line := file.readline():
        if line.strip() == DELIMITER.strip().encode():
            return
    raise ValueError("it ends inside a dataset; copy or export it again")


def _channel(number: int, header: list[str]) -> SourceChannel:
    rates = [rate for line in header[:5] if (rate := exact_rate_hz(line)) is not None]
    label = header[0].strip()
    return SourceChannel(
        name=str(number),
        samples=int(header[6][10:20]),
        label="" if label == "NONE" else label,
        sample_rate_hz=rates[0] if rates else None,
        unit=header[8][46:66].strip().removesuffix("NONE"),
    )


def _text_numbers(path: Path, name: str, body: _Body) -> NDArray[np.float64]:
    """All numbers of a text dataset: of fixed width without a blank between them, or free."""
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
            f"dataset {name} of {path.name} announces {body.count} numbers, and {cells.size} follow; "
            "export it again"
        )
    return cells.astype(np.float64)
