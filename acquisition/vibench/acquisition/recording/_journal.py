"""What a recording says besides its samples: events, segments, overloads and gaps, row by row."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import RecordingError
from ..instruments import Overload
from . import _layout as layout
from ._committer import Batch
from ._layout import Column, encoded, json_text
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
        """Make the writes of one more row; raises RecordingError when the table is full."""
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


Number = int | float | str
"""What a segment may carry: ``realisation=3``, ``frequency_hz=260.0``, ``direction="up"``."""


@dataclass(frozen=True)
class OpenSegment:
    """A segment that has begun."""

    row: int
    label: str
    first_sample: int
    numbers_json: str

    def cells(self, last_sample: int, is_complete: int) -> tuple[Cell, ...]:
        """Make the segment's row in the file."""
        return (self.first_sample, last_sample, is_complete, self.label, self.numbers_json)


class Journal:
    """Keeps the four tables and answers with the writes that each addition needs."""

    def __init__(self, places: Mapping[str, TablePlaces], roles: tuple[str, ...]) -> None:
        self._events = TableWriter(places[layout.EVENTS.name])
        self._segments = TableWriter(places[layout.SEGMENTS.name])
        self._overloads = TableWriter(places[layout.OVERLOADS.name])
        self._gaps = TableWriter(places[layout.GAPS.name])
        self._open: OpenSegment | None = None
        self._last_overload: dict[str, tuple[int, Overload]] = {}
        self._roles = roles
        self._dropped_events = 0

    def event(self, kind: str, text: str, sample: int) -> Batch:
        """Note that something happened. A full table keeps counting in its last row."""
        if self._events.free_rows > 1:
            return self._events.append((sample, time.time(), kind, text))
        self._dropped_events += 1
        cells = (sample, time.time(), "events lost", f"{self._dropped_events} more events were not kept")
        if self._events.free_rows:
            return self._events.append(cells)
        return self._events.replace(self._events.rows - 1, cells)

    def begin_segment(self, label: str, numbers: Mapping[str, Number], first_sample: int) -> Batch:
        """Begin a named range of samples."""
        if self._open is not None:
            raise RecordingError(
                f"The segment {label!r} cannot begin: {self._open.label!r} has not ended. End it first."
            )
        numbers_json = json_text(f"The numbers of segment {label!r}", numbers)
        if len(numbers_json) > layout.NUMBERS_WIDTH:
            raise RecordingError(
                f"The numbers of segment {label!r} take {len(numbers_json)} bytes as JSON; at most"
                f" {layout.NUMBERS_WIDTH} fit. Keep what the analysis needs, the rest belongs into the plan."
            )
        opened = OpenSegment(self._segments.rows, label, first_sample, numbers_json)
        batch = self._segments.append(opened.cells(layout.OPEN_SEGMENT, is_complete=0))
        self._open = opened
        return batch

    def end_segment(self, last_sample: int) -> Batch:
        """End the segment that is open."""
        if self._open is None:
            raise RecordingError("No segment is open, so none can end. Begin one first.")
        batch = self._segments.replace(self._open.row, self._open.cells(last_sample, is_complete=1))
        self._open = None
        return batch

    def gap(self, first_sample: int, last_sample: int) -> Batch:
        """Note that samples were lost."""
        return self._gaps.append((first_sample, last_sample))

    def overload(self, overload: Overload) -> Batch:
        """Note an overload; one that continues the channel's last makes that longer.

        When the table is full the channel's last range grows to hold the new one: too much is
        then called overloaded, never too little.
        """
        if overload.channel not in self._roles:
            raise RecordingError(
                f"An overload names the channel {overload.channel!r};"
                f" the recording has {', '.join(self._roles)}."
            )
        row, last = self._last_overload.get(overload.channel, (-1, overload))
        continues = row >= 0 and overload.first_sample <= last.last_sample + 1
        # A row is kept free for every channel that has had none, so that "grows" always finds one.
        untouched = len(self._roles) - len(self._last_overload)
        must_grow = row >= 0 and self._overloads.free_rows <= untouched
        if continues or must_grow:
            grown = Overload(
                overload.channel,
                min(last.first_sample, overload.first_sample),
                max(last.last_sample, overload.last_sample),
            )
            self._last_overload[overload.channel] = (row, grown)
            return self._overloads.replace(row, _overload_cells(grown))
        self._last_overload[overload.channel] = (self._overloads.rows, overload)
        return self._overloads.append(_overload_cells(overload))


def _overload_cells(overload: Overload) -> tuple[Cell, ...]:
    return (overload.channel, overload.first_sample, overload.last_sample)
