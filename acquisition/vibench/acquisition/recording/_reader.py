"""Read finished and growing recordings."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibench.sim import hdf5_files

from ..errors import RecordingError
from ..host.beside import ClosedOnLeaving
from ..instruments import Counts, Identity, Overload, Samples
from . import _layout as layout, _tables as tables
from ._contents import channel_header, configuration_facts, file_facts
from ._disk import is_being_recorded
from ._header import ChannelHeader, require_different
from ._layout import Origin, RecordingState, read_attributes
from ._overview import CountOverview, read_overview
from ._preallocate import replace_with_change
from ._results import ResultArray, SavedResult, Setting, read_results, result_groups, write_result
from ._seal import (
    DAMAGE,
    ChannelStates,
    CheckedCounts,
    SealCheck,
    SealDepth,
    SealKey,
    SealState,
    check_result,
    check_seal,
    journal_objection,
    remember,
    require_reachable,
    samples_id,
    seal_key,
    seal_of,
    was_checked,
)
from ._tables import Event, EventKind, Gap, Segment

LONGEST = 300
"""Largest number of characters of a faulty name or text that a message quotes."""

_LOCKED_OTHERWISE = "file locking flag values don't match"
"""Message of HDF5 if this process has already opened the file with locks."""


def open_hdf5(path: Path) -> h5py.File:
    """Return the HDF5 file of a recording, opened for reading; the file may still be growing.

    Raises RecordingError, with the reason, when the file is not a readable recording.
    """
    _require_file(path)
    try:
        file = hdf5_files.open_hdf5(path, locking=False)
    except hdf5_files.UnsafeHdf5 as error:
        raise RecordingError(f"{path} was not read: {str(error)[:LONGEST]}") from error
    except OSError as error:
        if _LOCKED_OTHERWISE in str(error):
            raise RecordingError(
                f"another library of this program has already opened {path} with a different lock: close the "
                "file there first. The file was not touched."
            ) from error
        require_reachable(str(path), error)
        raise RecordingError(
            f"{path} is not a readable HDF5 file ({error}). If another program wrote it, convert it"
            " with vibench import; if it was cut short, copy it again from where it was recorded."
        ) from error
    try:
        _require_ours(path, file)
    except BaseException:
        file.close()
        raise
    return file


def name_now(path: Path) -> Path:
    """Return the current path of a recording: ``NAME.h5`` if the given ``.part`` has been finished since."""
    if path.suffix != layout.PART_SUFFIX or path.exists():
        return path
    final = path.with_suffix("")
    return final if final.exists() else path


def _require_file(path: Path) -> None:
    if path.is_file():
        if path.stat().st_size == 0:
            raise RecordingError(f"{path} is empty (0 bytes). Copy it again from where it was recorded.")
        return
    if path.is_dir():
        raise RecordingError(f"{path} is a folder; give a recording (vibench catalogue lists them)")
    part = layout.part_of(path)
    if part.is_file():
        raise RecordingError(
            f"{path} does not exist, but {part.name} does: the recording is still running, or was "
            f"interrupted. Open {part.name} to view it, or recover it."
        )
    raise RecordingError(f"{path} does not exist, or is not a file; vibench catalogue DIR lists recordings")


def _require_ours(path: Path, file: h5py.File) -> None:
    try:
        attributes = read_attributes(file)
    except (OSError, RuntimeError, ValueError) as error:
        require_reachable(file, error)
        raise RecordingError(f"{path} is damaged: its attributes cannot be read ({error}).") from error
    if attributes.get("format") != layout.FORMAT:
        raise RecordingError(
            f"{path} is an HDF5 file, but not a recording of vibench: its attribute 'format' is"
            f" {str(attributes.get('format', 'missing'))[:LONGEST]!r}, not {layout.FORMAT!r}."
        )
    version = attributes.get("format_version")
    if version != layout.FORMAT_VERSION:
        raise RecordingError(
            f"{path} has format version {str(version)[:LONGEST]}; this version of vibench reads version "
            f"{layout.FORMAT_VERSION}. Update vibench."
        )


class OpenRecording:
    """HDF5 handle of an open recording."""

    def __init__(self, path: Path) -> None:
        self.path = name_now(path)
        try:
            self.file: h5py.File = open_hdf5(self.path)
        except RecordingError:
            # The recording may have been finished and renamed between the two lines above.
            if name_now(self.path) == self.path:
                raise
            self.path = name_now(self.path)
            self.file = open_hdf5(self.path)
        self.counts = CheckedCounts()
        self.described = ""
        """``repr`` of the recording when opened: all of its content except samples and results."""

    def reopen(self) -> None:
        """Open the file again, to read what has been written since."""
        self.file.close()
        self.file = open_hdf5(self.path)


@dataclass(frozen=True)
class RecordedBlock:
    """Consecutive samples of several channels."""

    first_sample: int
    values: Samples
    """Shape (channels, samples), in each channel's physical unit."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingDescription:
    """Description of a recording, its bench and its end."""

    path: Path
    state: RecordingState
    reason: str
    """Reason why the recording ended; empty if unknown."""
    sample_rate_hz: float
    requested_sample_rate_hz: float
    origin: Origin
    started_utc: str
    recording_id: str
    samples_id: str
    """SHA-256 of all channels' checksums, equal in copies; empty if the file grows or has no samples."""
    bench: Mapping[str, Any]
    instruments: Mapping[str, Identity]
    confirmations: Mapping[str, str | float]
    provenance: Mapping[str, Any]
    bench_check: Mapping[str, Any]
    """Last bench check before the recording (``checked``, ``verdict``, ``findings``, ...); or empty."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording(RecordingDescription, ClosedOnLeaving):
    """One recording as it was when opened. Use it in a ``with`` block, or `close` it."""

    samples: int
    """Number of valid samples per channel."""
    expected_samples: int | None
    channels: tuple[ChannelHeader, ...]
    plan: Mapping[str, Any]
    seal: str
    """SHA-256 of the manifest, as stored in the file; empty if there is no seal. See `check_seal`."""
    segments: tuple[Segment, ...]
    events: tuple[Event, ...]
    overloads: tuple[Overload, ...]
    gaps: tuple[Gap, ...]
    _open: OpenRecording

    @property
    def is_growing(self) -> bool:
        """Whether the file is a ``.part``, which is being recorded or was interrupted."""
        return layout.N_VALID in self._open.file

    @property
    def duration_s(self) -> float:
        """Duration of the recording [s]."""
        return self.samples / self.sample_rate_hz

    @property
    def stored_bytes(self) -> int:
        """Uncompressed size of all samples so far [bytes]."""
        return 4 * len(self.roles) * self.samples

    @property
    def packing(self) -> float:
        """Compression ratio of the samples; about 1.3 for noise of 20 bits."""
        stored = sum(self._open.file[role].id.get_storage_size() for role in self.roles)
        return float(self.stored_bytes / max(stored, 1))

    @property
    def check_text(self) -> str:
        """Result of the bench check before the run; empty if there was no check."""
        return " ".join(each.text for each in self.events if each.kind == EventKind.CHECK)

    @property
    def roles(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.role for channel in self.channels)

    def channel(self, role: str) -> ChannelHeader:
        """Return the header of one channel."""
        for channel in self.channels:
            if channel.role == role:
                return channel
        raise RecordingError(f"{self.path} has no channel {role!r}; it has {', '.join(self.roles)}.")

    def time_s(self, start: int = 0, stop: int | None = None) -> Samples:
        """Return the times of samples since the first sample [s], by the converter's clock."""
        begin, end = self._range(start, stop)
        return np.arange(begin, end) / self.sample_rate_hz

    def read(self, role: str, start: int = 0, stop: int | None = None) -> Samples:
        """Return samples ``start`` to ``stop`` (exclusive) in the channel's unit; lost samples are NaN.

        Raises RecordingError when there is no such channel or range, or when the file is damaged there.
        """
        channel = self.channel(role)
        counts = self.read_counts(role, start, stop)
        values: Samples = counts.astype(np.float64) * channel.scale_factor + channel.add_offset
        if self.gaps:
            values[counts == layout.MISSING_COUNT] = np.nan
        return values

    def read_counts(self, role: str, start: int = 0, stop: int | None = None) -> Counts:
        """Return the converter's counts without scaling, as int32."""
        self.channel(role)
        begin, end = self._range(start, stop)
        try:
            return self._open.counts.read(self.seal, self._open.file[role], begin, end)
        except DAMAGE as error:
            require_reachable(self._open.file, error)
            raise RecordingError(
                f"Samples {begin} to {end} of {role!r} in {self.path} cannot be read: {error}."
                " The file is damaged or closed; copy it again from where it was recorded."
            ) from error

    def read_overview(self, role: str) -> CountOverview | None:
        """Return the stored minimum and maximum of every 128 counts; None if they are not stored."""
        return read_overview(self._open.file, self.channel(role).role, self.samples)

    def blocks(
        self, roles: Sequence[str], samples: int, start: int = 0, stop: int | None = None
    ) -> Iterator[RecordedBlock]:
        """Yield the samples of a range in blocks of ``samples``; the last block may be shorter."""
        if samples < 1:
            raise RecordingError(f"Blocks of {samples} samples were requested; request 1 or more.")
        begin, end = self._range(start, stop)
        for first in range(begin, end, samples):
            last = min(first + samples, end)
            yield RecordedBlock(first, np.stack([self.read(role, first, last) for role in roles]))

    def check_seal(self, depth: SealDepth | str, key: SealKey | None = None) -> SealCheck:
        """Check the recording against its own seal, and against the seal in a campaign's journal.

        Raises RecordingError when the key cannot be read.

        Parameters
        ----------
        depth
            ``"quick"`` reads all attributes, texts and tables; ``"whole"`` also reads all samples.
        key
            Key for checking the signature, from `seal_key`. Default: the key in the file named by the
            environment variable VIBENCH_SEAL_KEY.

        Returns
        -------
        SealCheck
            State of the seal, its explanation, and the seal.
        """
        found = self._check_own_seal(SealDepth(depth), key)
        if found.state in (SealState.UNFINISHED, SealState.DAMAGED):
            return found
        objection = journal_objection(self.path, found.seal)
        return SealCheck(SealState.DAMAGED, objection, found.seal) if objection else found

    def _check_own_seal(self, depth: SealDepth, key: SealKey | None) -> SealCheck:
        if self.is_growing and layout.SEAL not in self._open.file:
            return SealCheck(SealState.UNFINISHED, "it is sealed when it is finished or recovered", "")
        states: ChannelStates = {}
        found = check_seal(self._open.file, depth, seal_key() if key is None else key, states)
        if found.state not in (SealState.INTACT, SealState.OTHER_KEY) or not found.seal:
            return found
        try:
            described = repr(_read(self._open))
        except (RecordingError, *DAMAGE) as error:
            require_reachable(self._open.file, error)
            described = ""
        if described != self._open.described:
            return SealCheck(SealState.DAMAGED, "it was changed after it had been opened", found.seal)
        if depth is SealDepth.WHOLE:
            remember(found.seal, {f"/{role}": states[f"/{role}"] for role in self.roles})
        return found

    @property
    def is_checked(self) -> bool:
        """Whether this process has checked the whole file; later reads are then compared with this check."""
        return was_checked(self.seal) and not journal_objection(self.path, self.seal)

    def check_result_seals(self, key: SealKey | None = None) -> dict[str, SealCheck]:
        """Return the seal check of every saved result, by name; for ``key``, see `check_seal`."""
        used = seal_key() if key is None else key
        return {name: check_result(group, used) for name, group in result_groups(self._open.file).items()}

    @property
    def results(self) -> dict[str, SavedResult]:
        """Return the results saved in the recording, by name."""
        try:
            return read_results(self._open.file)
        except DAMAGE as error:
            require_reachable(self._open.file, error)
            raise RecordingError(
                f"The results in {self.path} cannot be read: {error}. Its samples are intact; analyse them."
            ) from error

    @property
    def result_names(self) -> tuple[str, ...]:
        """Return the names of the results saved in the recording."""
        return tuple(result_groups(self._open.file))

    def save_results(
        self,
        name: str,
        arrays: Mapping[str, ResultArray],
        settings: Mapping[str, Setting],
        roles: Sequence[str] | None = None,
    ) -> str:
        """Save a result with its settings; return its name.

        No result is overwritten: if the name exists, ``-2``, ``-3``, ... is appended. The result is added to
        a copy, which then replaces the file, so that a crash cannot harm the samples. ``roles`` are the
        channels used for the result (default: all); their checksums are stored with the result.

        Raises RecordingError when the recording is not finished, an axis does not fit, or writing fails.
        """
        if self.path.suffix == layout.PART_SUFFIX:
            raise RecordingError(
                f"{self.path} is not finished, so nothing was added: wait until it has ended, or recover it."
            )
        used = self.roles if roles is None else tuple(self.channel(role).role for role in roles)
        key = seal_key()
        seal = self.check_seal(SealDepth.QUICK)
        if seal.state is SealState.DAMAGED:
            raise RecordingError(f"{self.path} is damaged ({seal.sentence}), so nothing was added to it.")
        given = replace_with_change(
            self.path, lambda file: write_result(file, name, arrays, settings, used, key)
        )
        self._open.reopen()
        return given

    def close(self) -> None:
        """Close the file. May be called at any time."""
        self._open.file.close()

    def _range(self, start: int, stop: int | None) -> tuple[int, int]:
        end = self.samples if stop is None else stop
        if not 0 <= start <= end <= self.samples:
            raise RecordingError(
                f"Samples {start} to {end} were requested; {self.path} has samples 0 to {self.samples}."
            )
        return start, end


def open_recording(path: Path | str) -> Recording:
    """Open ``NAME.h5``, or ``NAME.h5.part`` while it grows or after a crash.

    A ``NAME.h5.part`` that has been finished in the meantime is opened as ``NAME.h5``.

    Raises RecordingError when the file is missing, empty, truncated, damaged, not a recording, or written by
    a newer version.
    """
    handle = OpenRecording(Path(path))
    try:
        recording = _read(handle)
        handle.described = repr(recording)
        _require_as_checked(handle, recording.seal)
    except (RecordingError, *DAMAGE) as error:
        handle.file.close()
        require_reachable(str(path), error)
        raise RecordingError(
            f"{path} is damaged, or not a recording of vibench: {str(error)[:LONGEST]}."
            " Copy it again from where it was recorded."
        ) from error
    return recording


def _require_as_checked(handle: OpenRecording, seal: str) -> None:
    """Raise RecordingError if the file was changed after this process had checked its seal."""
    if was_checked(seal) and check_seal(handle.file, SealDepth.QUICK, seal_key()).state is SealState.DAMAGED:
        raise RecordingError("it was changed after its seal had been checked")


def _read(handle: OpenRecording) -> Recording:
    """Read and validate the content of the file, except samples and results."""
    file = handle.file
    is_part = layout.N_VALID in file
    growing = _growing(handle) if is_part else {}
    facts = file_facts(read_attributes(file), **growing)
    roles = tuple(facts.roles.split())
    for role in roles:
        _require_channel(file, role, facts.samples)
    columns = {
        table.name: tables.clip(tables.read_columns(file, table), table, facts.samples)
        for table in layout.TABLES
    }
    for table in layout.TABLES:
        tables.require_ranges(columns[table.name], table, facts.samples, roles)
    stated = dict(facts)
    del stated["roles"]
    return Recording(
        path=handle.path,
        **stated,
        **dict(configuration_facts(file)),
        samples_id="" if is_part or facts.samples == 0 else samples_id(file, roles),
        channels=require_different(channel_header(role, file[role]) for role in roles),
        seal="" if is_part else seal_of(file),
        segments=tables.segments(columns["segments"]),
        events=tuple(Event(*row) for row in tables.rows(columns["events"], layout.EVENTS)),
        overloads=tuple(Overload(*row) for row in tables.rows(columns["overloads"], layout.OVERLOADS)),
        gaps=tuple(Gap(*row) for row in tables.rows(columns["gaps"], layout.GAPS)),
        _open=handle,
    )


def _require_channel(file: h5py.File, role: str, samples: int) -> None:
    """Raise RecordingError unless the channel has ``samples`` samples; a ``.part`` may have more."""
    dataset = file.get(role)
    if (
        not isinstance(dataset, h5py.Dataset)
        or dataset.ndim != 1
        or dataset.dtype != np.dtype(layout.COUNT_DTYPE)
    ):
        raise RecordingError(f"the channel {role!r} is not an array of counts")
    if len(dataset) < samples or (layout.N_VALID not in file and len(dataset) != samples):
        raise RecordingError(f"the channel {role!r} has {len(dataset)} samples, the recording {samples}")
    if dataset.chunks is not None and dataset.id.get_num_chunks() != -(-len(dataset) // dataset.chunks[0]):
        raise RecordingError(f"some samples of the channel {role!r} are missing")


def _growing(handle: OpenRecording) -> dict[str, object]:
    """Return sample count, state and reason of a ``.part``; "interrupted" if no program is recording it."""
    file = handle.file
    state, reason = tables.ending(file)
    if state is RecordingState.RECORDING and not is_being_recorded(handle.path):
        state = RecordingState.INTERRUPTED
        reason = "the recording program ended before it could record how the run ended"
    return {"samples": tables.first_number(file, layout.N_VALID), "state": state, "reason": reason}
