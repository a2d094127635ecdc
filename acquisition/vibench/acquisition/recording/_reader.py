"""Reading a recording, days later, on another machine, or while it is still growing."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from ..errors import RecordingError
from ..instruments import Identity, Overload, Samples
from . import _layout as layout, _tables as tables
from ._attributes import decoded, json_text, read_attributes, read_text_dataset
from ._counts import Counts
from ._disk import is_being_recorded
from ._header import ChannelHeader
from ._layout import Origin, RecordingState
from ._opening import name_now, open_hdf5
from ._overview import CountOverview, read_overview
from ._replacing import replace_with_change
from ._results import ResultArray, SavedResult, Setting, read_results, write_result
from ._tables import Event, EventKind, Gap, Segment

RESULT_HEAD_BYTES = 100_000
"""More than HDF5 needs to describe one array of a result."""
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError)
"""What h5py raises when a file's inside is not what its outside promised."""


@dataclass(frozen=True)
class RecordedBlock:
    """Consecutive samples of several channels."""

    first_sample: int
    values: Samples
    """Shape (channels, samples), in each channel's physical unit."""


class _OpenFile:
    """The one thing about a recording that changes: its HDF5 handle."""

    def __init__(self, path: Path) -> None:
        self.path = name_now(path)
        try:
            self.file: h5py.File = open_hdf5(self.path)
        except RecordingError:
            # It may have been finished, and got its final name, between the two lines above.
            if name_now(self.path) == self.path:
                raise
            self.path = name_now(self.path)
            self.file = open_hdf5(self.path)

    def reopen(self) -> None:
        self.file.close()
        self.file = open_hdf5(self.path)


@dataclass(frozen=True, eq=False)
class Recording:
    """One recording, as it was when it was opened. Close it, or use it in a ``with`` block."""

    path: Path
    state: RecordingState
    reason: str
    """Why it ended; empty when nobody said."""
    samples: int
    """Valid samples per channel."""
    sample_rate_hz: float
    requested_sample_rate_hz: float
    expected_samples: int | None
    origin: Origin
    started_utc: str
    recording_id: str
    channels: tuple[ChannelHeader, ...]
    plan: Mapping[str, Any]
    bench: Mapping[str, Any]
    instruments: Mapping[str, Identity]
    confirmations: Mapping[str, str | float]
    provenance: Mapping[str, Any]
    bench_check: Mapping[str, Any]
    """The last check of the bench before it: ``checked``, ``verdict``, ``findings``, ...; may be empty."""
    segments: tuple[Segment, ...]
    events: tuple[Event, ...]
    overloads: tuple[Overload, ...]
    gaps: tuple[Gap, ...]
    _open: _OpenFile

    @property
    def duration_s(self) -> float:
        """Length of what was recorded [s]."""
        return self.samples / self.sample_rate_hz

    @property
    def check_text(self) -> str:
        """What the check of the bench found before the run; empty where nothing was noted."""
        return " ".join(each.text for each in self.events if each.kind == EventKind.CHECK)

    @property
    def roles(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.role for channel in self.channels)

    def channel(self, role: str) -> ChannelHeader:
        """Everything that is known about one channel."""
        for channel in self.channels:
            if channel.role == role:
                return channel
        raise RecordingError(f"{self.path} has no channel {role!r}; it has {', '.join(self.roles)}.")

    def time_s(self, start: int = 0, stop: int | None = None) -> Samples:
        """Time of the samples since the first [s], by the converter's clock."""
        begin, end = self._range(start, stop)
        return np.arange(begin, end) / self.sample_rate_hz

    def read(self, role: str, start: int = 0, stop: int | None = None) -> Samples:
        """Give samples ``start`` to ``stop`` (exclusive) in the channel's physical unit; lost ones are NaN.

        Raises
        ------
        RecordingError
            When there is no such channel or range, or the file is damaged there.

        """
        channel = self.channel(role)
        counts = self.read_counts(role, start, stop)
        values: Samples = counts.astype(np.float64) * channel.scale_factor + channel.add_offset
        if self.gaps:
            values[counts == layout.MISSING_COUNT] = np.nan
        return values

    def read_counts(self, role: str, start: int = 0, stop: int | None = None) -> Counts:
        """Give the converter's own counts, int32."""
        self.channel(role)
        begin, end = self._range(start, stop)
        try:
            return np.asarray(self._open.file[role][begin:end], dtype=np.int32)
        except DAMAGE as error:
            raise RecordingError(
                f"Samples {begin} to {end} of {role!r} in {self.path} cannot be read: {error}."
                " The file is damaged or closed; copy it again from where it was recorded."
            ) from error

    def read_overview(self, role: str) -> CountOverview | None:
        """Give the extremes of every 128 counts, as they were kept; None where the file has none."""
        return read_overview(self._open.file, self.channel(role).role, self.samples)

    def blocks(
        self, roles: Sequence[str], samples: int, start: int = 0, stop: int | None = None
    ) -> Iterator[RecordedBlock]:
        """Go through a range, ``samples`` at a time (the last block may be shorter)."""
        if samples < 1:
            raise RecordingError(f"Blocks of {samples} samples were asked for; allowed are 1 and more.")
        begin, end = self._range(start, stop)
        for first in range(begin, end, samples):
            last = min(first + samples, end)
            yield RecordedBlock(first, np.stack([self.read(role, first, last) for role in roles]))

    def is_intact(self, role: str) -> bool:
        """Whether the channel's samples still have the checksum they were recorded with.

        A ``.part`` has no checksum yet: RecordingError.
        """
        self._require_finished("checked")
        digest = hashlib.sha256()
        for first in range(0, self.samples, layout.CHUNK_SAMPLES):
            stop = min(first + layout.CHUNK_SAMPLES, self.samples)
            digest.update(self.read_counts(role, first, stop).astype(layout.COUNT_DTYPE).data)
        return digest.hexdigest() == read_attributes(self._open.file[role])["sha256"]

    @property
    def results(self) -> dict[str, SavedResult]:
        """What analyses have saved, by name."""
        return read_results(self._open.file)

    @property
    def result_names(self) -> tuple[str, ...]:
        """Names of what analyses have saved, without reading it."""
        file = self._open.file
        return tuple(file[layout.RESULTS]) if layout.RESULTS in file else ()

    def save_results(
        self,
        name: str,
        arrays: Mapping[str, ResultArray],
        settings: Mapping[str, Setting],
        roles: Sequence[str] | None = None,
    ) -> str:
        """Keep a result beside the samples, and how it was made; returns the name it got.

        Nothing is overwritten: a name that exists gets ``-2``, ``-3``, ... The file is copied and
        swapped, so that a crash cannot harm the samples. ``roles`` are the channels that were used
        (all by default): their checksums are kept with the result.

        Raises
        ------
        RecordingError
            When the recording is not finished, an axis does not fit, or the disk refuses.

        """
        self._require_finished("added to")
        used = self.roles if roles is None else tuple(self.channel(role).role for role in roles)
        room = RESULT_HEAD_BYTES * (1 + len(arrays)) + sum(
            np.asarray(each.values).nbytes for each in arrays.values()
        )
        room += len(json_text(f"The settings of result {name!r}", settings))
        given = replace_with_change(
            self.path, room, lambda file: write_result(file, name, arrays, settings, used)
        )
        self._open.reopen()
        return given

    def close(self) -> None:
        """Let go of the file. Legal at any time."""
        self._open.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _require_finished(self, verb: str) -> None:
        if self.path.suffix == layout.PART_SUFFIX:
            raise RecordingError(
                f"{self.path} is not finished, so it cannot be {verb}: let the recording end, or recover it."
            )

    def _range(self, start: int, stop: int | None) -> tuple[int, int]:
        end = self.samples if stop is None else stop
        if not 0 <= start <= end <= self.samples:
            raise RecordingError(
                f"Samples {start} to {end} were asked for; {self.path} has samples 0 to {self.samples}."
            )
        return start, end


def open_recording(path: Path | str) -> Recording:
    """Open ``NAME.h5``, or ``NAME.h5.part`` while it grows or after a crash.

    A ``NAME.h5.part`` that has been finished in the meantime is opened as ``NAME.h5``.

    Raises
    ------
    RecordingError
        When the file is missing, empty, cut short, damaged, no recording, or from a newer version.

    """
    handle = _OpenFile(Path(path))
    try:
        return _read(handle)
    except RecordingError:
        handle.file.close()
        raise
    except DAMAGE as error:
        handle.file.close()
        raise RecordingError(
            f"{path} is damaged: {error}. Copy it again from where it was recorded."
        ) from error


def _read(handle: _OpenFile) -> Recording:
    file = handle.file
    attributes = read_attributes(file)
    is_part = layout.N_VALID in file
    samples = int(file[layout.N_VALID][0] if is_part else attributes["samples"])
    state, reason = _ending(handle) if is_part else (attributes["state"], attributes["reason"])
    columns = {
        table.name: tables.clipped(tables.read_columns(file, table), table, samples)
        for table in layout.TABLES
    }
    configuration = _configuration(file)
    expected = int(attributes["expected_samples"])
    return Recording(
        path=handle.path,
        state=RecordingState(str(state)),
        reason=str(reason),
        samples=samples,
        sample_rate_hz=float(attributes["sample_rate_hz"]),
        requested_sample_rate_hz=float(attributes["requested_sample_rate_hz"]),
        expected_samples=expected if expected >= 0 else None,
        origin=Origin(str(attributes["origin"])),
        started_utc=str(attributes["started_utc"]),
        recording_id=str(attributes["recording_id"]),
        channels=tuple(
            ChannelHeader.from_attributes(role, read_attributes(file[role]))
            for role in str(attributes["roles"]).split()
        ),
        plan=configuration["plan_json"],
        bench=configuration["bench_json"],
        instruments={name: Identity(**each) for name, each in configuration["instruments_json"].items()},
        confirmations=configuration["confirmations_json"],
        provenance=configuration["provenance_json"],
        bench_check=configuration.get("bench_check_json", {}),  # absent from files of earlier versions
        segments=tables.segments(columns[layout.SEGMENTS.name]),
        events=tables.events(columns[layout.EVENTS.name]),
        overloads=tables.overloads(columns[layout.OVERLOADS.name]),
        gaps=tables.gaps(columns[layout.GAPS.name]),
        _open=handle,
    )


def _configuration(file: h5py.File) -> dict[str, Any]:
    group = file[layout.CONFIGURATION]
    return {name: json.loads(read_text_dataset(group, name)) for name in group}


def _ending(handle: _OpenFile) -> tuple[str, str]:
    """Say how a ``.part`` stands: it says "recording" until its end, which a dead program never wrote."""
    state, reason = decoded(handle.file[layout.STATE][0]), decoded(handle.file[layout.REASON][0])
    if state == RecordingState.RECORDING and not is_being_recorded(handle.path):
        return RecordingState.INTERRUPTED.value, "its program ended before it could say how the run ended"
    return state, reason
