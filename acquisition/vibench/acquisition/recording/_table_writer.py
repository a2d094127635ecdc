"""Rows of the pre-allocated tables, turned into writes at known places."""

from collections.abc import Sequence

import numpy as np

from ..errors import RecordingError
from ._committer import Batch
from ._fixed_text import encoded
from ._layout import Column
from ._preallocate import TablePlaces

Cell = str | int | float


class TableWriter:
    """Counts the rows of one table and says where each goes."""

    def __init__(self, places: TablePlaces) -> None:
        self._places = places
        self._rows = 0

    @property
    def rows(self) -> int:
        """Rows written so far."""
        return self._rows

    @property
    def free_rows(self) -> int:
        """Rows that still fit."""
        return self._places.table.capacity - self._rows

    def append(self, cells: Sequence[Cell]) -> Batch:
        """Make the writes of one more row.

        Raises
        ------
        RecordingError
            When the table is full.

        """
        if not self.free_rows:
            raise RecordingError(
                f"The recording's table of {self._places.table.name} is full:"
                f" {self._places.table.capacity} rows. Recording goes on without this row; divide the"
                " measurement into several recordings."
            )
        self._rows += 1
        return self.replace(self._rows - 1, cells)

    def replace(self, row: int, cells: Sequence[Cell]) -> Batch:
        """Make the writes of a row that is already there."""
        columns = self._places.table.columns
        writes = [
            (offset + row * np.dtype(column.dtype).itemsize, _raw(column, cell))
            for offset, column, cell in zip(self._places.columns, columns, cells, strict=True)
        ]
        return Batch(writes=tuple(writes), counters={self._places.n_rows: self._rows})


def _raw(column: Column, cell: Cell) -> bytes:
    dtype = np.dtype(column.dtype)
    value = encoded(cell, dtype.itemsize) if isinstance(cell, str) else cell
    return np.array(value, dtype=dtype).tobytes()
