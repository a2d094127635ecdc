"""Events, segments, overloads and gaps as they are read from a recording."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..instruments import Overload
from . import _layout as layout
from ._attributes import decoded
from ._journal import Number
from ._layout import Table

Columns = dict[str, NDArray[Any]]


class EventKind(StrEnum):
    """What a run notes by itself; feedback and other programs add kinds of their own."""

    PLAYER = "player"
    CHECK = "check"
    """What the check of the bench found before the run."""
    STATE = "state"
    MARK = "mark"
    LIMIT = "limit"
    """Numbers of a limit that was passed, as a JSON object."""
    END = "end"
    SILENCE = "silence"


@dataclass(frozen=True)
class Event:
    """Something that happened during the recording."""

    sample: int
    unix_time_s: float
    """Seconds since 1970-01-01 UTC, from the computer's clock."""
    kind: str
    text: str


@dataclass(frozen=True)
class Gap:
    """Samples that were lost; they read as NaN."""

    first_sample: int
    last_sample: int
    """Inclusive."""


@dataclass(frozen=True)
class Segment:
    """A named range of samples, with the numbers that the analysis needs to use it."""

    label: str
    first_sample: int
    last_sample: int
    """Inclusive; one less than ``first_sample`` when the segment is empty."""
    is_complete: bool
    """False when the recording ended before the segment did."""
    numbers: Mapping[str, Number]

    @property
    def start(self) -> int:
        """First sample, for ``recording.read(role, segment.start, segment.stop)``."""
        return self.first_sample

    @property
    def stop(self) -> int:
        """One past the last sample."""
        return self.last_sample + 1


def read_columns(file: h5py.File, table: Table) -> Columns:
    """Columns of a table, as many rows as are valid."""
    group = file[table.name]
    rows = int(group[layout.N_ROWS][0]) if layout.N_ROWS in group else None
    return {column.name: group[column.name][:rows] for column in table.columns}


def clipped(columns: Columns, table: Table, n_valid: int) -> Columns:
    """Keep the same rows without samples past the last valid one.

    Rows are written ahead of the counters, so after a crash they may speak of samples that are not
    there. A segment that is still open, or loses its end here, becomes an incomplete one.
    """
    if table is layout.SEGMENTS:
        return _clipped_segments(columns, n_valid)
    if table in {layout.OVERLOADS, layout.GAPS}:
        keep = columns["first_sample"] < n_valid
        kept = {name: values[keep] for name, values in columns.items()}
        kept["last_sample"] = np.minimum(kept["last_sample"], n_valid - 1)
        return kept
    return columns


def _clipped_segments(columns: Columns, n_valid: int) -> Columns:
    first = np.minimum(columns["first_sample"], n_valid)
    last = columns["last_sample"]
    is_cut = (last == layout.OPEN_SEGMENT) & (columns["is_complete"] == 0) | (last >= n_valid)
    return {
        **columns,
        "first_sample": first,
        "last_sample": np.where(is_cut, n_valid - 1, last),
        "is_complete": np.where(is_cut, 0, columns["is_complete"]).astype(np.int32),
    }


def events(columns: Columns) -> tuple[Event, ...]:
    """Rows of ``/events``."""
    return tuple(
        Event(int(row[0]), float(row[1]), decoded(row[2]), decoded(row[3]))
        for row in zip(*(columns[column.name] for column in layout.EVENTS.columns), strict=True)
    )


def segments(columns: Columns) -> tuple[Segment, ...]:
    """Rows of ``/segments``."""
    return tuple(
        Segment(
            label=decoded(label),
            first_sample=int(first),
            last_sample=int(last),
            is_complete=bool(is_complete),
            numbers=json.loads(decoded(numbers)),
        )
        for first, last, is_complete, label, numbers in zip(
            *(columns[column.name] for column in layout.SEGMENTS.columns), strict=True
        )
    )


def overloads(columns: Columns) -> tuple[Overload, ...]:
    """Rows of ``/overloads``."""
    return tuple(
        Overload(decoded(channel), int(first), int(last))
        for channel, first, last in zip(
            *(columns[column.name] for column in layout.OVERLOADS.columns), strict=True
        )
    )


def gaps(columns: Columns) -> tuple[Gap, ...]:
    """Rows of ``/gaps``."""
    return tuple(
        Gap(int(first), int(last))
        for first, last in zip(*(columns[column.name] for column in layout.GAPS.columns), strict=True)
    )
