"""Write CSV files with one row per sample, and read tables of numbers from text files.

Columns may be separated by commas, semicolons, bars, tabs or blanks. The whole table is read into memory.
"""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import date
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from ..signals import Reals
from ._excerpt import Excerpt, TransferObserver, ignore_progress
from ._source_channel import Source, SourceChannel, own_facts, read_from, scale_among, unit_among
from ._times import UNITS, stated_times

_NAMES = (
    "jan feb mar apr may jun jul aug sep oct nov dec jan feb m\u00e4r apr mai jun jul aug sep okt nov dez"
)
_MONTHS = {name: 1 + place % 12 for place, name in enumerate(_NAMES.split())}
_DATE = r"(?P<date>\d{1,4}(?P<sign>[-/.])(?:\d\d?|[A-Za-z\u00e4]{3,9})(?P=sign)\d{2,4})"
_TIME = (
    r"(?:(?P<hour>\d{1,3}):)?(?P<minute>\d\d?):(?P<second>\d\d)(?P<part>[.,]\d+|:\d{3})?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|(?P<zone>[+-]\d\d:?\d\d))?"
)
_ALONE = _TIME.replace("?P<", "?P<only_")
_CLOCK = re.compile(rf"(?<![\w:.,/-])(?:{_DATE}(?:[T ]{_TIME})?|{_ALONE})(?![\w:/-])")
"""A date, a time of day, or both: ``2026-03-01T12:00:00.0002``, ``03/01/2026 11:59:58.5 PM``."""
_HOUR_S, _DAY_S = 3600, 86400


class ClockTimes:
    """Converter of a file's successive dates and times to seconds since midnight of the first day."""

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._day = 0
        self._date = ""

    def in_seconds(self, text: str) -> str:
        """Replace times of day in a text by seconds, and dates without a time by days."""
        return _CLOCK.sub(self._number, text)

    def _number(self, found: re.Match[str]) -> str:
        hour, minute, second, part, half, zone = (
            found[name] or found[f"only_{name}"]
            for name in ("hour", "minute", "second", "part", "half", "zone")
        )
        is_known = not found["date"] or self._turns_to(found["date"])
        if not is_known or (minute and not hour and not part):
            return found[0]  # two numbers may be hours and minutes, or minutes and seconds
        if minute is None:
            return str(self._day)
        hours = int(hour or 0) if half is None else int(hour or 0) % 12 + 12 * (half in "Pp")
        clock_s = 60.0 * (60 * hours + int(minute)) + float(f"{second}.{(part or '.')[1:] or 0}")
        if zone:
            clock_s -= int(f"{zone[0]}1") * 60.0 * (60 * int(zone[1:3]) + int(zone[-2:]))
        turn_s = _DAY_S if hour else _HOUR_S
        if self._date:
            clock_s += self._day * _DAY_S
        elif self._last_s is not None:
            clock_s += turn_s * round((self._last_s - clock_s) / turn_s)
        self._last_s = clock_s
        return f"{clock_s:.9f}"

    def _turns_to(self, text: str) -> bool:
        """Read a date in the order of parts that puts it nearest to the last date; False if invalid."""
        if text == self._date:
            return True
        pairs = zip(_orders(self._date or text), _orders(text), strict=True)
        days = [(after - before).days for before, after in pairs if before and after]
        self._day += min(days, key=abs, default=0)
        self._date = text
        return bool(days)


def _orders(text: str) -> Iterator[date | None]:
    """Yield the date as read in three orders (year, day or month first); None for an invalid date."""
    parts = [
        int(each) if each.isdecimal() else _MONTHS.get(each[:3].casefold(), 0)
        for each in re.split("[-/.]", text)
    ]
    for order in ((0, 1, 2), (2, 1, 0), (2, 0, 1)):
        year, month, day = (parts[place] for place in order)
        found = None
        with suppress(ValueError):
            found = date(year if year > 99 else 2000 + year, month, day)
        yield found


TIME_FORMAT = "%.9f"
"""Format of the seconds since the recording's first sample, to nanoseconds."""
VALUE_FORMAT = "%.10g"
"""Format of values: one digit more than needed for steps of 2^-30 of the range; lost values are ``nan``."""


def write_csv_samples(excerpt: Excerpt, path: Path, observer: TransferObserver = ignore_progress) -> None:
    """Write a time column and one column per channel, in blocks."""
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
"""Maximum number of heading lines of a text file."""
DELIMITERS = (";", "\t", "|", ",", None)
"""Separators in order of trial; None means blanks. A comma that is not a separator is a decimal mark."""
UNIT = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")
UNIT_CELL = re.compile(
    r"[\[(].*[\])]|-|%|min|h|(?:[mnu\u00b5\u03bck]?(?:s|V|g|N|A|m|Pa|Hz|m/s|m s-1)|sec|\u00b0C|rad|deg"
    r"|[mk]?m(?:/s| s-?)(?:2|\^2|\*\*2|\u00b2)|[Ss]econds?|[Vv]olts?|[dmyhsDMYHS.:/ f-]{8,})?"
)
"""Cell of a row that states units, or formats of dates and times."""
TITLE = re.compile(r"\W*(?:(?:y[ _])?units?(?:[ _]labels?)?|einheit(?:en)?|names?|channels?)\W*", re.I)
"""First cell of a heading row that names the content of the row, such as "Units"."""
NAME_AND_UNIT = re.compile(r"[^\s\[\]()]+(?:\s*[\[(][^\[\]()]*[\])])?")
STATEMENT = re.compile(
    r"\W*([A-Za-z][^:=;,\t]*?)[\s\":=;,\t]+([-+.\d]+(?:[,.]\d+)?(?:[eE][-+]?\d+)?)[\s;,\t\"]*([\w/]*)"
)
"""Name, number and unit in a line of the heading: ``"Sample rate: 51.2 kHz"``."""
STATED_TEXT = re.compile(r"\W*([A-Za-z][^:=]*?)\s*[:=]\s*([^\s:=;,]+)\W*")
"""Name and text without blanks in a line of the heading: ``"Unit v: mm/s"``."""
SENTENCE = re.compile(
    r"(?:sampled|recorded|acquired) (?:at|with) ([\d.]+) ?(k?hz)|([\d.]+) ?(k?s)(?:a|amples?)?(?:/| per )s",
    re.I,
)
"""Sample rate in a sentence: ``"recorded at 5120 Hz"``, ``"51.2 kS/s"``."""
FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[-+]?\d)")
"""Letter D before the exponent of a double-precision number in Fortran notation."""
GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")
"""Number whose separator may be a decimal mark or may group thousands, such as ``1,234``."""


@dataclass(frozen=True)
class _Layout:
    """Format of the rows that contain numbers in a text file."""

    delimiter: str | None
    columns: int
    empty: int
    """Number of empty cells after the last number of each line, as spreadsheets write them."""
    has_text: bool
    """Whether some cells are dates, times or numbers in Fortran's notation."""

    @property
    def width(self) -> int:
        """Number of cells in a line of the text file."""
        return self.columns + self.empty

    def cells(self, line: str, clock: ClockTimes | None = None) -> list[str]:
        """Return the cells of a line of text, with times in seconds."""
        found = _cells(line, self.delimiter, clock or ClockTimes())
        while len(found) > self.columns and len(found) > 1 and not found[-1].strip():
            found.pop()
        return found

    def plain(self, line: str, clock: ClockTimes) -> str:
        """Return a line in the form that numpy reads; empty for comments and for lines of empty cells."""
        if line.startswith(("#", "%")):
            return ""
        is_plain = '"' not in line and not self.empty and not self.has_text
        if is_plain and line.strip(BLANK + (self.delimiter or "")):
            return line if self.delimiter == "," else line.replace(",", ".")
        cells = [_number(each) for each in self.cells(line, clock)]
        return (self.delimiter or " ").join(cells) if any(cells) else ""


BLANK = " \t\r\n"


@contextmanager
def open_csv(path: Path) -> Iterator[Source]:
    """Open a text file; its channels are named ``"1"``, ``"2"``, ..., with labels from the heading.

    Raises ValueError when the first 200 lines contain no numbers, or a later line has another format.
    """
    encoding = _encoding(path)
    head, first, layout = _beginning(path, encoding)
    with path.open(encoding=encoding, errors="replace") as file:
        clock = ClockTimes()
        lines = (layout.plain(line, clock) for line in islice(file, first, None))
        try:
            table = np.loadtxt(lines, delimiter=layout.delimiter, ndmin=2, comments=None)
        except ValueError as error:
            file.seek(0)
            raise ValueError(_what_is_wrong(file, first, layout) or str(error)) from error
        for place in np.flatnonzero([_may_be_grouped(each) for each in table.T]):
            file.seek(0)
            rows = (layout.cells(line) for line in islice(file, first, None))
            _require_decimals(int(place), [row[place].strip() for row in rows if len(row) > place])
    columns = zip(*_headings(head, layout), _facts(head, layout), table.T, strict=True)
    stated = (STATED_TEXT.fullmatch(line.strip()) for line in head)
    texts = [(found[1], found[2]) for found in stated if found]
    yield Source(
        {
            SourceChannel(
                name=str(number),
                samples=len(table),
                label=label,
                unit=unit or unit_among(own_facts(texts, label)) or unit_among(texts),
                stated_scale=scale_among((*own_facts(facts, label), *facts)),
                **stated_times((*own_facts(facts, label), *facts)),
            ): read_from(np.ascontiguousarray(column))
            for number, (label, unit, facts, column) in enumerate(columns, start=1)
        }
    )


def _may_be_grouped(column: Reals) -> bool:
    """Return whether a column mixes whole numbers and numbers above 1 with at most three decimals."""
    size = np.abs(column[np.isfinite(column)])
    rest = size[size != np.rint(size)]
    has_three = np.allclose(1e3 * rest, np.rint(1e3 * rest), 1e-12, 0.0)
    return 0 < rest.size < size.size and bool(rest.min() > 1) and has_three


def _require_decimals(place: int, cells: Sequence[str]) -> None:
    """Raise ValueError if the separators in a column probably group thousands."""
    marked = [each for each in cells if "." in each or "," in each]
    whole = next((each for each in cells if each.lstrip("+-0").isdigit()), "")
    if whole and all(GROUPED.fullmatch(each) for each in marked):
        raise ValueError(
            f"column {place + 1} contains {whole!r} and {marked[0]!r}, whose separator seems to group "
            "thousands; write numbers without thousands separators"
        )


def _encoding(path: Path) -> str:
    """Return the probable encoding of a text, judged from its start; files do not state their encoding."""
    with path.open("rb") as file:
        head = b"".join(islice(file, LONGEST_HEAD))
    if head.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        return "utf-32"
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    # Text in UTF-16 has a zero in nearly every second byte; other text contains no zero bytes.
    zeros = [2 * head[place::2].count(0) / max(len(head), 1) for place in (0, 1)]
    if max(zeros) > 0.9 and min(zeros) == 0.0:
        return "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
    if max(zeros) > 0.0:
        raise ValueError(
            "it contains zero bytes, so it is not text in UTF-8, UTF-16 or Latin-1; export it as UTF-8"
        )
    try:
        head.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _what_is_wrong(file: TextIO, first: int, layout: _Layout) -> str:
    """Describe the first line that does not fit the table; empty if all lines fit."""
    for number, line in enumerate(file, start=1):
        if number <= first or not layout.plain(line, ClockTimes()).strip():
            continue
        cells = layout.cells(line)
        if len(cells) != layout.columns:
            return (
                f"line {number} and line {first + 1} have different numbers of columns: "
                f"{len(cells)} instead of {layout.columns}"
            )
        for cell in cells:
            if not _are_numbers([cell]):
                return f"line {number} contains {cell.strip()!r} instead of a number"
    return ""


def _beginning(path: Path, encoding: str) -> tuple[list[str], int, _Layout]:
    """Return the lines of the heading, their number, and the format of the rows of numbers.

    A line of numbers belongs to the heading if the next line has a different number of columns.
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
        raise ValueError(f"none of its first {LONGEST_HEAD} lines contains numbers only" if head else "empty")
    return found


def _layout(line: str) -> _Layout | None:
    """Return the format of a line of text that contains numbers; None for other lines."""
    for delimiter in DELIMITERS:
        cells = _cells(line, delimiter, ClockTimes())
        filled = len(cells)
        while filled and not cells[filled - 1].strip():
            filled -= 1
        if (delimiter is None or delimiter in line) and filled and _are_numbers(cells[:filled]):
            has_text = bool(FORTRAN.search(line)) or _cells(line, delimiter)[:filled] != cells[:filled]
            return _Layout(delimiter, filled, len(cells) - filled, has_text)
    return None


def _cells(line: str, delimiter: str | None, clock: ClockTimes | None = None) -> list[str]:
    """Return the cells of a line of text; with a clock, times become seconds."""
    if delimiter is None:
        line = line if clock is None else clock.in_seconds(line)
        return [each.strip('"') for each in line.split()]
    cells = next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter), [])
    return cells if clock is None else [clock.in_seconds(each) for each in cells]


def _number(cell: str) -> str:
    """Return a number as text with a decimal point, and with E before its exponent."""
    return FORTRAN.sub("e", cell.strip().replace(",", "."))


def _are_numbers(cells: Sequence[str]) -> bool:
    try:
        return bool([float(_number(each)) for each in cells])
    except ValueError:
        return False


def _headings(head: Sequence[str], layout: _Layout) -> tuple[list[str], list[str]]:
    """Return labels and units from one heading row or two separate rows; empty texts if not stated.

    Raises ValueError for a row with fewer units than columns, because the units cannot be assigned.
    """
    for line in head:
        cells = [each.strip() for each in layout.cells(line.strip())]
        if 1 < len(cells) < layout.columns and all(cells) and _are_units(cells):
            raise ValueError(
                f"its line {line.strip()!r} has {len(cells)} units for {layout.columns} columns; give each "
                "column a unit, or - for a column without a unit"
            )
    rows = [row for line in head if any(row := _row(line, layout))]
    none = [""] * layout.columns
    labels = ([row for row in rows if not _are_units(row)] or rows or [none])[-1]
    own = [(found := UNIT.search(each)) and found[1] for each in labels]
    units = [[each.strip("[]() -") for each in row] for row in rows if _are_units(row)]
    return (
        [UNIT.sub("", each).strip() for each in labels],
        [" or ".join(dict.fromkeys(filter(None, each))) for each in zip(own, none, *units, strict=True)],
    )


def _are_units(row: Sequence[str]) -> bool:
    """Return whether all cells contain units; the first cell may be a title instead."""
    cells = row[1:] if TITLE.fullmatch(row[0]) else row
    return any(cells) and all(UNIT_CELL.fullmatch(each) for each in cells)


def _row(line: str, layout: _Layout) -> list[str]:
    """Return a heading line as one cell per column; empty if the line cannot be split into such cells."""
    line = re.sub(rf"^{TITLE.pattern}[:=]\s*", "", line.strip("\r\n ").lstrip("#% "), flags=re.I)
    tries = [layout.cells(line), *(replace(layout, delimiter=each).cells(line) for each in DELIMITERS)]
    tries += [re.split(r"\s{2,}|\t", line), NAME_AND_UNIT.findall(line)]
    tries += [each[1:] for each in tries if len(each) == layout.columns + 1 and TITLE.fullmatch(each[0])]
    tries += [each[:-1] for each in tries if len(each) == layout.columns + 1 and each[-1] == "Comment"]
    found = next((each for each in tries if len(each) == layout.columns), [])
    return [each.strip().strip('"') for each in found]


def _facts(head: Sequence[str], layout: _Layout) -> Iterator[Sequence[tuple[str, float]]]:
    """Yield for each column its own facts (such as LabVIEW's ``Delta_X``), then facts common to all."""
    own: list[list[tuple[str, float]]] = [[] for _ in range(layout.columns)]
    shared: list[tuple[str, float]] = []
    for line in head:
        name, *rest = layout.cells(line) or [""]
        filled = [each for each in rest if each.strip()]
        numbers = [float(_number(each)) for each in filled] if _are_numbers(filled) else []
        if len(numbers) > 1 and 0 <= layout.columns - len(numbers) <= 1:
            for facts, number in zip(own[-len(numbers) :], numbers, strict=True):
                facts.append((name.strip(), number))
        else:
            shared += _statements(line)
    return ([*each, *shared] for each in own)


def _statements(line: str) -> Iterator[tuple[str, float]]:
    if (found := SENTENCE.search(line)) and _are_numbers([number := found[1] or found[3]]):
        yield f"rate {found[2] or f'{found[4]}/s'}", float(number)
    elif (found := STATEMENT.match(line)) and _are_numbers([found[2]]):
        # The cell after a number may contain the unit of the number, or another name.
        unit = found[3] if found[3].casefold() in UNITS else ""
        yield f"{found[1].strip()} {unit}".strip(), float(found[2].replace(",", "."))
