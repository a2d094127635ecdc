"""Columns of numbers beside a figure, and as a CSV file that any program reads."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

_DIGITS = 10


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
