"""Read events, segments, overloads and gaps of a recording."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from . import _layout as layout
from ._committer import Number
from ._contents import json_object
from ._layout import RecordingState, Table, decode

Columns = dict[str, NDArray[Any]]


class EventKind(StrEnum):
    """Kinds of events of a run; feedback and other programs add further kinds."""

    PLAYER = "player"
    CHECK = "check"
    """Result of the bench check before the run."""
    STATE = "state"
    MARK = "mark"
    LIMIT = "limit"
    """A limit was exceeded; the text is a JSON object with the measured value, the limit and the channel."""
    SPECIMEN = "specimen"
    """Change of the specimen found by the live twin."""
    LATE = "late"
    """The drive deviated from its planned time or phase; the text states the deviation."""
    END = "end"
    OFF = "off"
    """The output was switched off after an early end; the samples that confirm its silence follow."""
    SILENCE = "silence"


REJECTED = "average rejected"
"""Text of a mark that excludes the last noise realisation that began before the mark."""


@dataclass(frozen=True)
class Event:
    """An event during the recording, at one sample."""

    sample: int
    unix_time_s: float
    """Seconds since 1970-01-01 UTC, from the computer's clock."""
    kind: str
    text: str


@dataclass(frozen=True)
class Gap:
    """Range of samples that were lost; lost samples are read as NaN."""

    first_sample: int
    last_sample: int
    """Number of the last sample that was lost."""


@dataclass(frozen=True)
class Segment:
    """A named range of samples, with the numbers that are needed to analyse it."""

    label: str
    first_sample: int
    last_sample: int
    """Number of the last sample; ``first_sample`` minus one if the segment is empty."""
    is_complete: bool
    """False if the recording ended before the end of the segment."""
    numbers: Mapping[str, Number]

    @property
    def start(self) -> int:
        """Number of the segment's first sample, for ``recording.read(role, segment.start, segment.stop)``."""
        return self.first_sample

    @property
    def stop(self) -> int:
        """Number of the sample after the segment's last sample."""
        return self.last_sample + 1


def read_columns(file: h5py.File, table: Table) -> Columns:
    """Return the valid rows of a table, by column.

    Raises RecordingError when a column is missing, or has a wrong type, a wrong width or too many rows.
    """
    group = file.get(table.name)
    if not isinstance(group, h5py.Group):
        raise RecordingError(f"the table {table.name} is missing")
    datasets = [_column(group, table, *column) for column in table.columns.items()]
    if layout.N_ROWS in group:
        rows = first_number(group, layout.N_ROWS)
        if not 0 <= rows <= min(len(each) for each in datasets):
            raise RecordingError(f"the table {table.name} declares {rows} rows, but has fewer")
    else:
        (rows, *others) = {len(each) for each in datasets}
        if others:
            raise RecordingError(f"the columns of the table {table.name} differ in length")
    return {name: dataset[:rows] for name, dataset in zip(table.columns, datasets, strict=True)}


def _column(group: h5py.Group, table: Table, name: str, dtype: str) -> h5py.Dataset:
    dataset, wanted = group.get(name), np.dtype(dtype)
    if (
        not isinstance(dataset, h5py.Dataset)
        or dataset.ndim != 1
        or dataset.dtype.kind != wanted.kind
        or dataset.dtype.itemsize > wanted.itemsize
        or len(dataset) > table.capacity + 1  # a recovery adds one event to the table
    ):
        raise RecordingError(
            f"the column {name} of the table {table.name} must have the type {dtype} and at "
            f"most {table.capacity + 1} rows"
        )
    return dataset


def first_number(group: h5py.Group, name: str) -> int:
    """Return the integer in a dataset with one element; raises RecordingError for any other content."""
    dataset = group.get(name)
    if not isinstance(dataset, h5py.Dataset) or dataset.shape != (1,) or dataset.dtype.kind != "i":
        raise RecordingError(f"{group.name}/{name} is not a whole number")
    return int(dataset[0])


def ending(file: h5py.File) -> tuple[RecordingState, str]:
    """Return state and reason of a ``.part``; if its program was killed, the state is still "recording"."""
    state, reason = (_text(file, name) for name in (layout.STATE, layout.REASON))
    is_whole = state in tuple(RecordingState)
    return RecordingState(state) if is_whole else RecordingState.RECORDING, reason


def _text(file: h5py.File, name: str) -> str:
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset) or dataset.shape != (1,) or dataset.dtype.kind != "S":
        raise RecordingError(f"/{name} is not a text")
    return decode(dataset[0])


def require_ranges(columns: Columns, table: Table, samples: int, roles: Sequence[str]) -> None:
    """Raise RecordingError for rows that refer to samples or channels outside the recording."""
    if table is layout.EVENTS:
        is_right = (columns["sample"] >= 0) & np.isfinite(columns["unix_time_s"])
    else:
        first, last = columns["first_sample"], columns["last_sample"]
        shortest = 0 if table is layout.SEGMENTS else 1
        is_right = (first >= 0) & (last < samples) & (last - first + 1 >= shortest)
    if table is layout.SEGMENTS:
        is_right &= np.isin(columns["is_complete"], (0, 1))
    if table is layout.OVERLOADS:
        is_right &= np.isin(columns["channel"], [role.encode() for role in roles])
    if not is_right.all():
        raise RecordingError(
            f"row {int(np.argmin(is_right))} of the table {table.name} does not match the recording"
        )


def clip(columns: Columns, table: Table, n_valid: int) -> Columns:
    """Return the rows of a table, limited to the valid samples.

    Rows are written before the counters, so after a crash the rows may refer to missing samples. A segment
    that is still open or that ends after the valid samples is marked incomplete.
    """
    if table is layout.SEGMENTS:
        first = np.minimum(columns["first_sample"], n_valid)
        last = columns["last_sample"]
        # A power cut may leave a complete segment without an end. An empty segment at sample 0 ends at -1.
        is_open = (last == layout.OPEN_SEGMENT) & ((columns["is_complete"] == 0) | (first > 0))
        is_cut = is_open | (last >= n_valid)
        return {
            **columns,
            "first_sample": first,
            "last_sample": np.where(is_cut, n_valid - 1, last),
            "is_complete": np.where(is_cut, 0, columns["is_complete"]).astype(np.int32),
        }
    if table in {layout.OVERLOADS, layout.GAPS}:
        keep = columns["first_sample"] < n_valid
        kept = {name: values[keep] for name, values in columns.items()}
        kept["last_sample"] = np.minimum(kept["last_sample"], n_valid - 1)
        return kept
    return columns


def rows(columns: Columns, table: Table) -> Iterator[tuple[Any, ...]]:
    """Return an iterator over the rows of a table, as Python numbers and text."""
    cells = (columns[name] for name in table.columns)
    return zip(
        *(map(decode, each) if each.dtype.kind == "S" else each.tolist() for each in cells), strict=True
    )


def segments(columns: Columns) -> tuple[Segment, ...]:
    """Return the segments in the table ``/segments``."""
    return tuple(
        Segment(label, first, last, bool(is_complete), _numbers(numbers))
        for first, last, is_complete, label, numbers in rows(columns, layout.SEGMENTS)
    )


def _numbers(text: str) -> dict[str, Number]:
    numbers = json_object(text)
    for name, value in numbers.items():
        if not isinstance(value, int | float | str):
            raise RecordingError(f"the number {name!r} of a segment is a JSON {type(value).__name__}")
    return numbers


class SegmentLabel(StrEnum):
    """Labels of segments, named after what is played or measured in them."""

    REALISATION = "realisation"
    NOISE = "noise"
    SWEEP = "sweep"
    DWELL = "dwell"
    STEP = "step"
    """A frequency or a level in the plan's list."""
    SEARCH = "search"
    """A frequency that was added to localise a jump."""
    RESONANCE = "resonance"
    BRANCH = "branch"
    """A point of a branch, held by a fast control loop."""
    PERTURBED = "perturbed"
    """A branch point with small perturbations of the drive, to determine its stability."""
    CHECK = "check"
    """The small sine of the check, before the first ramp."""
    LEAD_IN = "lead_in"
    """Tones played before a dwell, so that the specimen reaches the intended branch."""
    RAMP_UP = "ramp_up"
    RAMP_DOWN = "ramp_down"
