"""Write a recording: create it, append blocks, add events, finish it.

::

    with create_recording(path, header) as writer:
        for block in blocks:
            writer.append(block)
        writer.finish(RecordingState.COMPLETE, "the plan was carried out")
"""

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Self

import numpy as np

from vibench.sim.operating_system.this import Buffer

from ..errors import RecordingError
from ..host import LOG
from ..instruments import Block, Counts, Samples
from ..stopping.stop import DescriptorReserve
from . import _layout as layout
from ._committer import COMMIT_INTERVAL_S, Batch, Committer, Journal, Number
from ._disk import PositionedFile, open_disk
from ._finalise import discard, finalise, location
from ._header import ChannelHeader, RecordingHeader
from ._layout import COUNT_DTYPE, LARGEST_COUNT, RecordingState, encode
from ._preallocate import ITEM_BYTES, MARGIN_S, RESERVE_AHEAD_S, Places, preallocate
from ._seal import SealKey, seal_key

COUNT_TOLERANCE = 0.01
"""Largest allowed distance of a voltage from a whole count [counts]; float64 rounds to 1e-8 at 24 bits."""


class CountScale:
    """Conversion of blocks of volts to counts."""

    def __init__(self, channels: Sequence[ChannelHeader]) -> None:
        self._roles = [channel.role for channel in channels]
        self._step_v = np.array([[channel.step_v] for channel in channels])
        self._zero_v = np.array([[channel.volts_at_zero_count] for channel in channels])
        self._has_converter_step = np.array([channel.volts_per_count is not None for channel in channels])

    def counts(self, volts: Samples) -> Counts:
        """Return a block's counts, shape (channels, samples); exact if the converter's step is known.

        Raises RecordingError when a voltage is not a multiple of the known step, does not fit into an int32,
        or is NaN.
        """
        scaled = (np.asarray(volts, dtype=np.float64) - self._zero_v) / self._step_v
        rounded = np.rint(scaled)
        inside = np.abs(rounded) <= LARGEST_COUNT
        if not inside.all():
            row, column = np.argwhere(~inside)[0]
            raise RecordingError(
                f"{self._roles[row]!r} reads {rounded[row, column] * self._step_v[row, 0]:g} V, which is "
                f"{rounded[row, column]:g} steps of {self._step_v[row, 0]:g} V; at most 2^31 - 1 steps can "
                "be stored. The block was not recorded; correct volts_per_count or range_v of the channel."
            )
        self._require_whole_counts(np.abs(scaled - rounded))
        return np.ascontiguousarray(rounded.astype(COUNT_DTYPE))

    def _require_whole_counts(self, distance: Samples) -> None:
        worst = np.where(self._has_converter_step, distance.max(axis=1, initial=0.0), 0.0)
        if (worst > COUNT_TOLERANCE).any():
            row = int(worst.argmax())
            raise RecordingError(
                f"The volts of {self._roles[row]!r} differ by up to {worst[row]:.2f} counts from whole steps "
                f"of {self._step_v[row, 0]:g} V. The block was not recorded, because its counts would not "
                "reproduce the volts; correct volts_per_count and volts_at_zero_count, or set "
                "volts_per_count to None to store the volts in steps of 2^-30 of the range."
            )


RESERVED = 8
"""Number of reserved file descriptors: for recording, copy, folder checks, disk checks and journal."""
QUEUE_S = 10.0
"""Capacity of the queue of samples to be written [s]; the slowest measured disk sync took 0.12 s."""
GAP_PIECE_SAMPLES = 51_200

ENDINGS = (RecordingState.COMPLETE, RecordingState.STOPPED, RecordingState.FAILED)


def create_recording(path: Path | str, header: RecordingHeader) -> "RecordingWriter":
    """Create ``NAME.h5.part`` with all data known before the run, and return its writer.

    Raises RecordingError if the name is not ``NAME.h5``, if the file, its ``.part`` or its ``.tmp`` exists,
    or if the disk has no space for the planned samples.
    """
    path = Path(path)
    if path.suffix != layout.SUFFIX:
        raise RecordingError(f"A recording is called NAME{layout.SUFFIX}; {path.name!r} was given.")
    part = layout.part_of(path)
    for taken in (path, part, layout.tmp_of(path)):
        if taken.exists() or taken.is_symlink():
            raise RecordingError(
                f"{taken} exists, and nothing is ever overwritten. Nothing was recorded; choose another name"
                " (an interrupted recording leaves a .part or .tmp file: recover that file first)."
            )
    key = seal_key()
    reserve = DescriptorReserve(RESERVED)
    try:
        reserve.hold()
    except OSError as error:
        reserve.release()
        raise RecordingError(
            f"this process may open no more files ({error}), but a recording needs {RESERVED} more files to "
            "finish. Nothing was recorded; raise the limit (ulimit -n), or close other programs"
        ) from error
    try:
        places = preallocate(path, part, header)
        return RecordingWriter(path, header, places, open_disk(part), reserve=reserve, key=key)
    except BaseException:
        reserve.release()
        raise


class RecordingWriter:
    """Writer of a recording, for use by one thread; a second thread writes to the disk.

    Leaving the ``with`` block finishes the recording, unless it is finished already. The state of the
    recording is then complete, stopped (after KeyboardInterrupt) or failed (after any other exception).
    """

    def __init__(
        self,
        path: Path,
        header: RecordingHeader,
        places: Places,
        disk: PositionedFile,
        commit_interval_s: float = COMMIT_INTERVAL_S,
        reserve: DescriptorReserve | None = None,
        key: SealKey | None = None,
    ) -> None:
        self.path = path
        """Path ``NAME.h5`` of the recording, which exists when the recording is finished."""
        self._header = header
        self._places = places
        self._disk = disk
        self._reserve = reserve
        self._scale = CountScale(header.channels)
        self._journal = Journal(places.tables, tuple(channel.role for channel in header.channels))
        self._committer = Committer(disk, round(QUEUE_S * header.sample_rate_hz), commit_interval_s)
        self._key = key
        self._digests = {channel.role: hashlib.sha256() for channel in header.channels}
        self.samples = 0
        """Number of samples per channel appended so far."""
        self._reserved = places.reserved
        self._is_finished = False

    @property
    def committed_samples(self) -> int:
        """Number of samples per channel that would survive a power cut at this moment."""
        return self._committer.committed_samples

    def append(self, block: Block) -> None:
        """Append the next samples; wait only if the disk is seconds behind.

        Samples missing between the previous block and this block are marked as a gap, and are read as NaN.

        Raises RecordingError when the block does not fit (wrong shape or order, volts that are not whole
        counts, full recording), or when the disk has failed. Committed samples are kept.
        """
        self._check(block)
        # Record counts of the converter unchanged.
        counts = (
            self._scale.counts(block.volts) if block.counts is None else np.ascontiguousarray(block.counts)
        )
        gap = block.first_sample - self.samples
        end = block.first_sample + counts.shape[1]
        if end > self._places.capacity:
            raise RecordingError(
                f"The recording is full: the block ends at sample {end}, but only {self._places.capacity} "
                f"samples fit (planned: {self._header.expected_samples}, plus a margin). The {self.samples} "
                "samples recorded so far are kept; plan a longer measurement, or leave its length open "
                "(expected_samples=None)."
            )
        self._reserve_up_to(end)
        if gap:
            self._fill_gap(self.samples, block.first_sample)
        self.samples = end
        self._committer.put(
            Batch(
                writes=self._channel_writes(block.first_sample, counts),
                counters={self._places.n_valid: end},
                samples=counts.shape[1],
            )
        )
        for overload in block.overloads:
            self._committer.put(self._journal.overload(overload))

    def log(self, kind: str, text: str, sample: int | None = None) -> None:
        """Add an event at a sample, by default at the next sample."""
        place = self.samples if sample is None else sample
        LOG.info("%s, sample %d: %s: %s", self.path.name, place, kind, text)
        self._committer.put(self._journal.event(kind, text, place))

    def begin_segment(self, label: str, **numbers: Number) -> None:
        """Start a segment at the next sample, with a label and numbers for the analysis."""
        self._committer.put(self._journal.begin_segment(label, numbers, self.samples))

    def end_segment(self) -> None:
        """End the open segment at the last recorded sample."""
        self._committer.put(self._journal.end_segment(self.samples - 1))

    def finish(self, state: RecordingState, reason: str = "") -> Path:
        """End the recording and turn it into ``NAME.h5``; a second call changes nothing.

        Raises RecordingError when the disk has failed. Samples committed before the failure are kept in
        ``NAME.h5`` or ``NAME.h5.part``; the message says which.
        """
        if state not in ENDINGS:
            raise RecordingError(
                f"A recording cannot be finished as {state.value!r}; allowed are"
                f" {', '.join(each.value for each in ENDINGS)}."
            )
        if self._is_finished:
            return self.path
        self._is_finished = True
        if self._reserve is not None:
            self._reserve.release()
        self._committer.close()
        failure = self._committer.failure
        if failure is not None:
            state, reason = RecordingState.FAILED, f"{reason}; the disk refused: {failure}".removeprefix("; ")
        part = layout.part_of(self.path)
        try:
            self._write_ending(state, reason)
            checksums = {role: digest.hexdigest() for role, digest in self._digests.items()}
            finalise(part, self._key, checksums if failure is None else None)
        finally:
            # Disk errors were already reported by the sync in `_write_ending`.
            with suppress(OSError):
                self._disk.close()
        discard(part)
        self._committer.raise_unseen_failure()
        return self.path

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            self.finish(RecordingState.COMPLETE)
            return
        state = RecordingState.STOPPED if isinstance(error, KeyboardInterrupt) else RecordingState.FAILED
        try:
            self.finish(state, f"{type(error).__name__}: {error}".removesuffix(": "))
        except RecordingError as second:
            # An error while finishing must not hide the first error, which is the cause.
            error.add_note(str(second))

    def _check(self, block: Block) -> None:
        if self._is_finished:
            raise RecordingError(
                f"{self.path} is finished; the block was not recorded. Begin a new recording."
            )
        channels = len(self._header.channels)
        if block.volts.ndim != 2 or block.volts.shape[0] != channels:
            raise RecordingError(
                f"A block of shape {block.volts.shape} was given; this recording has {channels} channels, so"
                f" the shape must be ({channels}, samples). The block was not recorded."
            )
        if block.first_sample < self.samples:
            raise RecordingError(
                f"A block beginning at sample {block.first_sample} was given, but {self.samples} samples are"
                " recorded already and nothing is overwritten. The block was not recorded; write each"
                " block once, in order."
            )
        made = block.counts
        if made is not None and (made.shape != block.volts.shape or made.dtype != layout.COUNT_DTYPE):
            raise RecordingError(
                f"Counts of shape {made.shape} and type {made.dtype} were given with volts of shape"
                f" {block.volts.shape}; they must be int32 and of the same shape. The block was not recorded."
            )

    def _reserve_up_to(self, end: int) -> None:
        """Reserve more disk space if the recording has no planned end, or is much longer than planned."""
        rate_hz, planned = self._header.sample_rate_hz, self._header.expected_samples
        ahead = round(RESERVE_AHEAD_S * rate_hz)
        # With half the margin, a recording of the planned length needs no further reservation.
        lead = ahead // 2 if planned is None else round(MARGIN_S / 2 * rate_hz)
        if end + lead <= self._reserved or self._reserved == self._places.capacity:
            return
        target = min(end + ahead, self._places.capacity)
        size = (target - self._reserved) * ITEM_BYTES
        begin = self._reserved * ITEM_BYTES
        self._committer.put(Batch(reservations=tuple((base + begin, size) for base in self._places.channels)))
        self._reserved = target

    def _fill_gap(self, first: int, stop: int) -> None:
        """Write the count that marks lost samples, in small pieces, and add the gap to the table of gaps."""
        shape = len(self._header.channels), min(GAP_PIECE_SAMPLES, stop - first)
        missing = np.full(shape, layout.MISSING_COUNT, dtype=layout.COUNT_DTYPE)
        for begin in range(first, stop, GAP_PIECE_SAMPLES):
            counts = missing[:, : stop - begin]
            self._committer.put(Batch(writes=self._channel_writes(begin, counts), samples=counts.shape[1]))
        self._committer.put(self._journal.gap(first, stop - 1))

    def _channel_writes(self, first_sample: int, counts: Counts) -> tuple[tuple[int, Buffer], ...]:
        for digest, row in zip(self._digests.values(), counts, strict=True):
            digest.update(row.data)
        return tuple(
            (base + first_sample * ITEM_BYTES, row.data)
            for base, row in zip(self._places.channels, counts, strict=True)
        )

    def _write_ending(self, state: RecordingState, reason: str) -> None:
        """Write the reason before the state, so that there is never a state without a reason."""
        why = encode(reason, layout.TEXT_WIDTH).ljust(layout.TEXT_WIDTH, b"\0")
        try:
            self._disk.write(self._places.reason, why)
            self._disk.sync()
            self._disk.write(self._places.state, state.value.encode().ljust(layout.STATE_WIDTH, b"\0"))
            self._disk.sync()
        except OSError as error:
            raise RecordingError(
                f"The end of the recording could not be written: {error}."
                f" {location(layout.part_of(self.path), error)}"
            ) from error
