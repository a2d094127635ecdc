"""Samples as comma-separated text: one row a sample, headings with units, nothing before them.

Columns of text as a source: commas, semicolons, tabs or blanks between them, read whole.
"""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from ..signals import Reals
from ._excerpt import Excerpt, TransferObserver, unobserved
from ._source_channel import SourceChannel, TableSource, rate_bounds

TIME_FORMAT = "%.9f"
"""Nanoseconds since the recording's first sample."""
VALUE_FORMAT = "%.10g"
"""One more digit than 2^-30 of the range needs; lost samples read ``nan``."""


def write_csv_samples(excerpt: Excerpt, path: Path, observer: TransferObserver = unobserved) -> None:
    """Write time and channels, a block at a time."""
    headings = ["time [s]", *(f"{each.role} [{each.unit}]" for each in excerpt.channels)]
    row = ",".join([TIME_FORMAT, *(VALUE_FORMAT for _ in excerpt.channels)]) + "\n"
    rate = excerpt.recording.sample_rate_hz
    with path.open("x", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerow(headings)
        for block in excerpt.blocks():
            samples = block.values.shape[1]
            time_s = np.arange(block.first_sample, block.first_sample + samples) / rate
            cells = np.column_stack((time_s, block.values.T))
            file.write(row * samples % tuple(cells.ravel().tolist()))
            observer(block.values.size)


LONGEST_HEAD = 200
"""Lines in which the numbers must have begun."""
DELIMITERS = (";", "\t", ",", None)
"""In the order in which they are tried; None stands for blanks. A comma beside another is a decimal one."""
UNIT = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")
TIME = re.compile(r"(time|zeit|temps)|t$", re.IGNORECASE)
"""What a column of times is called."""
UNEVEN = 1e-3
"""How far a sample may lie from its place on an even axis of time, in sample intervals."""


@contextmanager
def opened_csv(path: Path) -> Iterator[TableSource]:
    """Open a file whose columns are ``"1"``, ``"2"``, ... or what the line above them calls them.

    ValueError when no line of numbers begins within the first 200, or a later line has others.
    """
    encoding = _encoding(path)
    head, first, delimiter = _beginning(path, encoding)
    with path.open(encoding=encoding, errors="replace") as file:
        lines = (_with_points(line, delimiter) for line in islice(file, first, None))
        try:
            table = np.loadtxt(lines, delimiter=delimiter, ndmin=2, comments=None)
        except ValueError as error:
            file.seek(0)
            raise ValueError(_what_is_wrong(file, first, delimiter) or str(error)) from error
    labels = _labels(head, delimiter, table.shape[1])
    rate, bounds = _sample_rate_hz(labels[0], table[:, 0])
    yield TableSource(
        {
            SourceChannel(
                str(number),
                len(table),
                UNIT.sub("", label).strip(),
                rate,
                _unit(label),
                rate_bounds_hz=bounds,
            ): np.ascontiguousarray(column)
            for number, (label, column) in enumerate(zip(labels, table.T, strict=True), start=1)
        }
    )


def _encoding(path: Path) -> str:
    """Tell by its beginning how text is written; who writes ``µ`` in one byte does not say so."""
    with path.open("rb") as file:
        head = b"".join(islice(file, LONGEST_HEAD))
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        head.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _what_is_wrong(file: TextIO, first: int, delimiter: str | None) -> str:
    """Name the first line that does not belong to a table of numbers; empty where all do."""
    columns = 0
    for number, line in enumerate(file, start=1):
        cells = _with_points(line, delimiter).split(delimiter)
        if number <= first or not line.strip():
            continue
        columns = columns or len(cells)
        if len(cells) != columns:
            return (
                f"line {number} has another number of columns than line {first + 1}: "
                f"{len(cells)} instead of {columns}"
            )
        for cell in cells:
            if not _are_numbers([cell]):
                return f"line {number} holds {cell.strip()!r} where a number belongs"
    return ""


def _beginning(path: Path, encoding: str) -> tuple[list[str], int, str | None]:
    """Find the lines before the numbers, how many they are, and what stands between the numbers."""
    with path.open(encoding=encoding, errors="replace") as file:
        head: list[str] = []
        for number, line in enumerate(islice(file, LONGEST_HEAD)):
            delimiter = next((each for each in DELIMITERS if each is None or each in line), None)
            if _are_numbers(_with_points(line, delimiter).split(delimiter)):
                return head, number, delimiter
            head.append(line)
    raise ValueError(f"no line of numbers among its first {LONGEST_HEAD}")


def _with_points(line: str, delimiter: str | None) -> str:
    return line if delimiter == "," else line.replace(",", ".")


def _are_numbers(cells: Sequence[str]) -> bool:
    try:
        return bool([float(each) for each in cells])
    except ValueError:
        return False


def _labels(head: Sequence[str], delimiter: str | None, columns: int) -> list[str]:
    found = [each.strip().strip('"') for each in head[-1].split(delimiter)] if head else []
    return found if len(found) == columns else [""] * columns


def _unit(label: str) -> str:
    found = UNIT.search(label)
    return "" if found is None else found[1]


def _sample_rate_hz(label: str, values: Reals) -> tuple[float | None, tuple[float, float] | None]:
    """Take the rate from a first column that is called time: exact where it is even, else bounds of it."""
    if not TIME.match(UNIT.sub("", label).strip()) or len(values) < 2:
        return None, None
    with np.errstate(invalid="ignore", over="ignore"):
        interval = float(values[-1] - values[0]) / (len(values) - 1)
        off = float(np.max(np.abs(values - values[0] - interval * np.arange(len(values)))))
    exact = rate_bounds(interval, 0.0, _unit(label))
    if exact is not None and off < UNEVEN * interval:
        return exact[0], None
    # Each end may be as far off as any sample is.
    return None, rate_bounds(interval, 2 * off / (len(values) - 1), _unit(label))
