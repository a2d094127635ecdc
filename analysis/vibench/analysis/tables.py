"""Columns of numbers beside a figure, and as a CSV file that any program reads; fields by their names."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

_DIGITS = 10
_PLAIN = (1e-5, 1e7)
"""Sizes between which numbers are written without a power of ten."""


def plus_minus(value: float, half_width: float) -> str:
    """Write a value with two digits of its uncertainty, and to as many places: ``"94.613 ± 0.012"``.

    Without an uncertainty that is finite and above zero, four digits of the value stand alone.
    """
    if not 0.0 < half_width < np.inf or not np.isfinite(value):
        return f"{value:.4g}"
    largest = max(abs(value), half_width)
    if not _PLAIN[0] <= largest < _PLAIN[1]:
        power = int(np.floor(np.log10(largest)))
        return f"({plus_minus(value / 10.0**power, half_width / 10.0**power)})e{power}"
    # The exponent of the two digits as they are written: 0.0996 is 0.10.
    place = 1 - int(f"{half_width:.1e}".partition("e")[2])
    shown = max(place, 0)
    return f"{round(value, place) + 0.0:.{shown}f} ± {round(half_width, place):.{shown}f}"


@dataclass(frozen=True, eq=False)
class Table:
    """Named columns; a heading carries its unit, as in ``"frequency [Hz]"``. Columns may differ in length."""

    name: str
    columns: tuple[tuple[str, tuple[float | str, ...]], ...]

    def column(self, heading: str) -> tuple[float | str, ...]:
        """Give one column by its heading."""
        return dict(self.columns)[heading]


def table(name: str, **columns: ArrayLike) -> Table:
    """Build a table; ``frequency_hz`` becomes ``"frequency_hz"``: names carry the unit as in the code."""
    return Table(name, tuple((heading, _cells(values)) for heading, values in columns.items()))


def named(source: object, *fields: str) -> dict[str, Any]:
    """Give some fields of a value under their own names: columns of a table, keys of a document."""
    return {field: getattr(source, field) for field in fields}


def plain(value: Any) -> Any:
    """Turn numpy's numbers into Python's, and what is not finite into None: JSON has neither."""
    match value:
        case bool() | str() | int() | None:
            return value
        case float():
            return float(value) if math.isfinite(value) else None
        case np.ndarray():
            return plain(value.tolist())
        case np.generic():
            return plain(value.item())
        case Mapping():
            return {str(key): plain(each) for key, each in value.items()}
        case Sequence():
            return [plain(each) for each in value]
        case _:
            raise TypeError(f"{type(value).__name__} has no place in a document; turn it into numbers first")


def _cells(values: ArrayLike) -> tuple[float | str, ...]:
    cells: tuple[float | str, ...] = tuple(np.asarray(values).ravel().tolist())
    return cells


def write_csv(content: Table, path: Path) -> Path:
    """Write a table: headings in the first row, points as decimal marks, empty cells where a column ends."""
    headings = [heading for heading, _ in content.columns]
    rows = zip_longest(*(values for _, values in content.columns), fillvalue="")
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(headings)
        writer.writerows([_text(cell) for cell in row] for row in rows)
    return path


def _text(cell: float | str) -> str:
    match cell:
        case float():
            return f"{cell:.{_DIGITS}g}"
        case _:
            return str(cell)


def write_tables(tables: Sequence[Table], folder: Path) -> tuple[Path, ...]:
    """Write each table as ``NAME.csv``."""
    return tuple(write_csv(each, folder / f"{each.name}.csv") for each in tables)
