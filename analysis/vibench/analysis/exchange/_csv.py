"""Write CSV with one row per sample below headings with units.

Read columns of text, separated by commas, semicolons, tabs or blanks, into memory.
"""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from ._alignment import UNITS, stated_rate_hz
from ._excerpt import Excerpt, TransferObserver, ignore_progress
from ._source_channel import SourceChannel, TableSource

TIME_FORMAT = "%.9f"
"""Nanoseconds since the recording's first sample."""
VALUE_FORMAT = "%.10g"
"""One digit more than 2^-30 of the range needs; lost samples are ``nan``."""


def write_csv_samples(excerpt: Excerpt, path: Path, observer: TransferObserver = ignore_progress) -> None:
    """Write time and channels in blocks."""
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
"""Longest heading in lines."""
DELIMITERS = (";", "\t", ",", None)
"""Separators in the order of trying; None means blanks. With another separator, a comma is decimal."""
UNIT = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")
UNIT_CELL = re.compile(
    r"[\[(].*[\])]|-|%|min|h|(?:[mnu\u00b5\u03bck]?(?:s|V|g|N|A|m|Pa|Hz|m/s|m s-1)|sec|\u00b0C|rad|deg"
    r"|[mk]?m(?:/s| s-?)(?:2|\^2|\*\*2|\u00b2))?"
)
"""One cell of a row of units."""
NAME_AND_UNIT = re.compile(r"[^\s\[\]()]+(?:\s*[\[(][^\[\]()]*[\])])?")
STATEMENT = re.compile(
    r"\W*([A-Za-z][^:=;,\t]*?)[\s\"]*[:=;,\t][\s\":=]*([-+.\d]+(?:[,.]\d+)?(?:[eE][-+]?\d+)?)[\s;,\t\"]*([\w/]*)"
)
"""A name, a number and its unit in a line of a heading: ``"Sample rate: 51.2 kHz"``."""

CLOCK = re.compile(
    r"(?<![\w:])(?:(\d{4})-(\d\d)-(\d\d)[T ])?(\d\d?):(\d\d):(\d\d(?:[.,]\d+)?)(?:Z|[+-]\d\d:\d\d)?(?![\w:])"
)
"""A time of day, with a date or without: ``2026-03-01T12:00:00.0002``."""


@dataclass(frozen=True)
class _Layout:
    """Format of the numbers of a text."""

    delimiter: str | None
    columns: int
    empty: int
    """Empty cells after the last number of each line, as spreadsheets write them."""

    @property
    def width(self) -> int:
        """Number of cells of a line."""
        return self.columns + self.empty

    def cells(self, line: str) -> list[str]:
        """Split a line."""
        found = _cells(line, self.delimiter)
        while len(found) > self.columns and len(found) > 1 and not found[-1].strip():
            found.pop()
        return found

    def plain(self, line: str) -> str:
        """Return a line with blanks and decimal points; empty if all cells are."""
        line = _clock_in_seconds(line)
        if '"' not in line and not self.empty and line.strip(BLANK + (self.delimiter or "")):
            return line if self.delimiter == "," else line.replace(",", ".")
        cells = [each.strip().replace(",", ".") for each in self.cells(line)]
        return (self.delimiter or " ").join(cells) if any(cells) else ""


BLANK = " \t\r\n"


@contextmanager
def open_csv(path: Path) -> Iterator[TableSource]:
    """Open a file; columns are named ``"1"``, ``"2"``, ... or by their heading.

    Raises ValueError when the first 200 lines have no numbers, or a later line differs.
    """
    encoding = _encoding(path)
    head, first, layout = _beginning(path, encoding)
    with path.open(encoding=encoding, errors="replace") as file:
        lines = (layout.plain(line) for line in islice(file, first, None))
        try:
            table = np.loadtxt(lines, delimiter=layout.delimiter, ndmin=2, comments=None)
        except ValueError as error:
            file.seek(0)
            raise ValueError(_what_is_wrong(file, first, layout) or str(error)) from error
    labels, units = _headings(head, layout)
    rate, trouble = stated_rate_hz(_statements(head))
    yield TableSource(
        {
            SourceChannel(
                str(number), len(table), label, rate, unit, time_trouble=trouble
            ): np.ascontiguousarray(column)
            for number, (label, unit, column) in enumerate(zip(labels, units, table.T, strict=True), start=1)
        }
    )


def _encoding(path: Path) -> str:
    """Guess the encoding of text from its start, since files do not state it."""
    with path.open("rb") as file:
        head = b"".join(islice(file, LONGEST_HEAD))
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        head.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _what_is_wrong(file: TextIO, first: int, layout: _Layout) -> str:
    """Describe the first line that does not fit the table; empty if all fit."""
    for number, line in enumerate(file, start=1):
        if number <= first or not layout.plain(line).strip():
            continue
        cells = layout.cells(line)
        if len(cells) != layout.columns:
            return (
                f"line {number} has another number of columns than line {first + 1}: "
                f"{len(cells)} instead of {layout.columns}"
            )
        for cell in cells:
            if not _are_numbers([cell]):
                return f"line {number} holds {cell.strip()!r} where a number belongs"
    return ""


def _beginning(path: Path, encoding: str) -> tuple[list[str], int, _Layout]:
    """Return the heading, its length, and the format of the numbers.

    A line of numbers followed by a different number of them belongs to the heading.
    """
    found: tuple[list[str], int, _Layout] | None = None
    with path.open(encoding=encoding, errors="replace") as file:
        head: list[str] = []
        for number, line in enumerate(islice(file, LONGEST_HEAD + 1)):
            layout = _layout(line)
            if found is not None and (layout is None or layout.width == found[2].width) and line.strip():
                return found
            if layout is not None and number < LONGEST_HEAD:
                found = head.copy(), number, layout
            head.append(line)
    if found is None:
        raise ValueError(f"no line of numbers among its first {LONGEST_HEAD}")
    return found


def _layout(line: str) -> _Layout | None:
    """Return the format of a line of numbers; None if it is none."""
    for delimiter in DELIMITERS:
        cells = _cells(line, delimiter)
        filled = len(cells)
        while filled and not cells[filled - 1].strip():
            filled -= 1
        if (delimiter is None or delimiter in line) and filled and _are_numbers(cells[:filled]):
            return _Layout(delimiter, filled, len(cells) - filled)
    return None


def _clock_in_seconds(line: str) -> str:
    """Write times of day as seconds; a table of samples has no other text between its numbers."""
    return CLOCK.sub(_seconds, line) if ":" in line else line


def _seconds(clock: re.Match[str]) -> str:
    year, month, day, hour, minute, second = clock.groups()
    # A thousand days leave a double 15 ns.
    days = date(int(year), int(month), int(day)).toordinal() % 1000 if year else 0
    minutes = (days * 24 + int(hour)) * 60 + int(minute)
    return f"{minutes * 60 + float(second.replace(',', '.')):.9f}"


def _cells(line: str, delimiter: str | None) -> list[str]:
    line = _clock_in_seconds(line)
    if delimiter is None:
        return [each.strip('"') for each in line.split()]
    return next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter), [])


def _are_numbers(cells: Sequence[str]) -> bool:
    try:
        return bool([float(each.replace(",", ".")) for each in cells])
    except ValueError:
        return False


def _headings(head: Sequence[str], layout: _Layout) -> tuple[list[str], list[str]]:
    """Return labels and units from one row, or from two rows of which one has only units; else empty."""
    rows = [row for line in head if (row := _row(line, layout))]
    labels, units = (rows or [[""] * layout.columns])[-1], [""] * layout.columns
    if len(rows) > 1:
        above = rows[-2]
        if all(UNIT_CELL.fullmatch(each) for each in labels):
            labels, units = above, labels
        elif all(UNIT_CELL.fullmatch(each) for each in above):
            units = above
    said = [UNIT.search(each) for each in labels]
    return (
        [UNIT.sub("", each).strip() for each in labels],
        [other.strip("[]() ") if own is None else own[1] for own, other in zip(said, units, strict=True)],
    )


def _row(line: str, layout: _Layout) -> list[str]:
    """Split a line of a heading into one cell per column; empty if that fails."""
    line = line.strip().lstrip("#% ")
    tries = [layout.cells(line), *(_Layout(each, layout.columns, 0).cells(line) for each in DELIMITERS)]
    tries += [re.split(r"\s{2,}|\t", line), NAME_AND_UNIT.findall(line)]
    found = next((each for each in tries if len(each) == layout.columns), [])
    return [each.strip().strip('"') for each in found]


def _statements(head: Sequence[str]) -> Iterator[tuple[str, float]]:
    for line in head:
        if (found := STATEMENT.match(line)) and _are_numbers([found[2]]):
            # A cell after the number may be its unit, or another name.
            unit = found[3] if found[3].casefold() in UNITS else ""
            yield f"{found[1].strip()} {unit}".strip(), float(found[2].replace(",", "."))
