"""Writer thread that commits batches from a queue in a safe order.

Order of a commit: samples and rows -> sync -> counters -> sync. Even if the process is killed or the power
fails, the counters never exceed the stored data.
"""

import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass, field

import numpy as np

from vibench.sim.operating_system.this import Buffer

from ..errors import RecordingError
from ..instruments import Overload
from . import _layout as layout
from ._disk import PositionedFile
from ._layout import cell, json_text
from ._preallocate import TablePlaces

COMMIT_INTERVAL_S = 0.5
"""Commit interval [s]: half of the one second that a crash may lose; the other half is for slow disks."""
CLOSING_PATIENCE_S = 30.0
"""Time limit of the last commit [s]; writes to a disconnected network folder may hang forever."""
QUEUE_PATIENCE_S = 2.0
"""Longest wait while the queue is full [s]; after this time, the disk counts as too slow."""


@dataclass(frozen=True)
class Batch:
    """Batch of writes, and of counters that are written after the data to mark the data as valid."""

    writes: tuple[tuple[int, Buffer], ...] = ()
    """File offset and data of each write."""
    counters: Mapping[int, int] = field(default_factory=dict)
    """Value of each counter, by file offset; written after the data of the batch are on the disk."""
    reservations: tuple[tuple[int, int], ...] = ()
    """Offset and size of each range to reserve before writing [bytes]."""
    samples: int = 0
    """Number of samples per channel in this batch; the sum over all batches in the queue is limited."""


class Committer:
    """Writer of batches in a thread; it reports the first failure at the next call."""

    def __init__(
        self, disk: PositionedFile, queue_samples: int, interval_s: float = COMMIT_INTERVAL_S
    ) -> None:
        self._disk = disk
        self._queue_samples = queue_samples
        self._interval_s = interval_s
        self._closing_patience_s = CLOSING_PATIENCE_S
        self._changed = threading.Condition()
        self._queue: deque[Batch] = deque()
        self._waiting_samples = 0
        self._is_closing = False
        self._is_abandoned = False
        self.failure: OSError | None = None
        """Disk error that ended the writing; None if there was no error."""
        self._is_failure_seen = False
        self._counters: dict[int, int] = {}
        self._written_samples = 0
        self.committed_samples = 0
        """Number of samples per channel that would survive a power cut at this moment."""
        self._commit_due_s = time.monotonic() + interval_s
        self._thread = threading.Thread(target=self._run, name="recording committer", daemon=True)
        self._thread.start()

    def put(self, batch: Batch) -> None:
        """Queue a batch; waits only when the queue is full.

        Raises RecordingError when the disk failed, or is so slow that the queue stays full.
        """
        with self._changed:
            has_room = self._changed.wait_for(self._can_take, timeout=QUEUE_PATIENCE_S)
            self._require_health(has_room)
            self._queue.append(batch)
            self._waiting_samples += batch.samples
            self._changed.notify_all()

    def close(self) -> None:
        """Write and commit everything queued, and end the thread. May be called at any time.

        Raises RecordingError when the disk does not respond; no further access to the disk is then allowed.
        """
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        self._thread.join(self._closing_patience_s)
        self._is_abandoned = self._thread.is_alive()
        if self._is_abandoned:
            raise RecordingError(
                f"The disk has not responded for {self._closing_patience_s:g} s (is a network folder "
                f"disconnected?). The {self.committed_samples} samples committed so far are kept on the "
                "disk; recover the recording when the disk responds again."
            )

    def raise_unseen_failure(self) -> None:
        """Raise RecordingError for a disk error that no call has reported yet."""
        if self.failure is not None and not self._is_failure_seen:
            self._require_health(has_room=True)

    def _can_take(self) -> bool:
        is_stopped = self.failure is not None or not self._thread.is_alive()
        return is_stopped or self._waiting_samples <= self._queue_samples

    def _require_health(self, has_room: bool) -> None:  # noqa: FBT001 - the answer of a wait
        if self.failure is not None:
            self._is_failure_seen = True
            kept = f"the {self.committed_samples} samples saved so far are kept"
            if isinstance(self.failure, FileNotFoundError):
                kept = "the samples saved so far are lost with the file"
            raise RecordingError(
                f"Writing to the disk failed: {self.failure}. The recording has ended; {kept}. Make room, or "
                "use another disk, and measure again."
            ) from self.failure
        if not self._thread.is_alive():
            raise RecordingError(
                "The recording has been closed, or its writer thread has died; the block was not recorded."
                " Begin a new recording."
            )
        if not has_room:
            raise RecordingError(
                f"The disk is too slow: {self._waiting_samples} samples per channel wait to be written"
                f" (there is room for {self._queue_samples}); none was written within {QUEUE_PATIENCE_S:g} s."
                " The block was not recorded; record to a faster or a local disk."
            )

    def _run(self) -> None:
        try:
            while self._step():
                pass
        except OSError as error:
            self.failure = error
        finally:
            with self._changed:
                self._changed.notify_all()
            if self._is_abandoned:  # when the disk responded again, the caller had stopped waiting
                with suppress(OSError):
                    self._disk.close()

    def _step(self) -> bool:
        batch, is_last = self._next()
        if batch is not None:
            self._write(batch)
        if is_last or (self._counters and time.monotonic() >= self._commit_due_s):
            self._commit()
        return not is_last

    def _next(self) -> tuple[Batch | None, bool]:
        """Return the next batch (None if a commit is due or no batch is left), and whether all is written."""
        with self._changed:
            # If no commit is due, wait for the next batch without a time limit.
            timeout_s = max(self._commit_due_s - time.monotonic(), 0.0) if self._counters else None
            self._changed.wait_for(lambda: self._queue or self._is_closing, timeout=timeout_s)
            if not self._queue:
                return None, self._is_closing
            batch = self._queue.popleft()
            self._waiting_samples -= batch.samples
            self._changed.notify_all()
            return batch, False

    def _write(self, batch: Batch) -> None:
        for offset, size in batch.reservations:
            self._disk.reserve(offset, size)
        for offset, data in batch.writes:
            self._disk.write(offset, data)
        if not self._counters:
            self._commit_due_s = time.monotonic() + self._interval_s
        self._counters.update(batch.counters)
        self._written_samples += batch.samples

    def _commit(self) -> None:
        if not self._counters:
            return
        self._disk.sync()
        for offset, value in self._counters.items():
            self._disk.write(offset, value.to_bytes(8, "little", signed=True))
        self._disk.sync()
        self._counters.clear()
        self.committed_samples = self._written_samples


class TableWriter:
    """Encoder that turns the rows of one table into writes to the rows' reserved offsets in the file."""

    def __init__(self, places: TablePlaces) -> None:
        self._places = places
        self.rows = 0
        """Number of rows of the table so far."""

    @property
    def free_rows(self) -> int:
        """Number of rows that still fit into the table."""
        return self._places.table.capacity - self.rows

    def append(self, cells: Sequence[str | float]) -> Batch:
        """Return the writes that append a row; raises RecordingError when the table is full."""
        if not self.free_rows:
            raise RecordingError(
                f"The recording's table of {self._places.table.name} is full:"
                f" {self._places.table.capacity} rows. Recording continues without this row; divide the"
                " measurement into several recordings."
            )
        self.rows += 1
        return self.replace(self.rows - 1, cells)

    def replace(self, row: int, cells: Sequence[str | float]) -> Batch:
        """Return the writes that replace an existing row."""
        columns = self._places.table.columns.values()
        writes = [
            (offset + row * np.dtype(column).itemsize, cell(column, value).tobytes())
            for offset, column, value in zip(self._places.columns, columns, cells, strict=True)
        ]
        return Batch(writes=tuple(writes), counters={self._places.n_rows: self.rows})


Number = int | float | str
"""Value stored with a segment: ``realisation=3``, ``frequency_hz=260.0``, ``direction="up"``."""


class Journal:
    """Tables of events, segments, overloads and gaps; each method returns the writes to be queued."""

    def __init__(self, places: Mapping[str, TablePlaces], roles: tuple[str, ...]) -> None:
        self._events = TableWriter(places[layout.EVENTS.name])
        self._segments = TableWriter(places[layout.SEGMENTS.name])
        self._overloads = TableWriter(places[layout.OVERLOADS.name])
        self._gaps = TableWriter(places[layout.GAPS.name])
        self._open: tuple[int, str, str] | None = None
        """First sample, label and numbers (JSON) of a segment that has started but not ended."""
        self._last_overload: dict[str, tuple[int, Overload]] = {}
        self._roles = roles
        self._dropped_events = 0

    def event(self, kind: str, text: str, sample: int) -> Batch:
        """Add an event. When the table is full, its last row counts the events that no longer fit."""
        if self._events.free_rows > 1:
            return self._events.append((sample, time.time(), kind, text))
        self._dropped_events += 1
        cells = (sample, time.time(), "events lost", f"{self._dropped_events} more events did not fit here")
        if self._events.free_rows:
            return self._events.append(cells)
        return self._events.replace(self._events.rows - 1, cells)

    def begin_segment(self, label: str, numbers: Mapping[str, Number], first_sample: int) -> Batch:
        """Begin a segment: a named range of samples."""
        if self._open is not None:
            raise RecordingError(
                f"The segment {label!r} cannot begin: {self._open[1]!r} is open. End that segment first."
            )
        numbers_json = json_text(f"The numbers of segment {label!r}", numbers)
        if len(numbers_json) > layout.NUMBERS_WIDTH:
            raise RecordingError(
                f"The numbers of segment {label!r} take {len(numbers_json)} bytes as JSON; at most"
                f" {layout.NUMBERS_WIDTH} fit. Keep only what the analysis needs; put the rest in the plan."
            )
        batch = self._segments.append((first_sample, layout.OPEN_SEGMENT, 0, label, numbers_json))
        self._open = first_sample, label, numbers_json
        return batch

    def end_segment(self, last_sample: int) -> Batch:
        """End the segment that has started."""
        if self._open is None:
            raise RecordingError("No segment is open. Begin a segment before ending it.")
        (first_sample, *named), self._open = self._open, None
        return self._segments.replace(self._segments.rows - 1, (first_sample, last_sample, 1, *named))

    def gap(self, first_sample: int, last_sample: int) -> Batch:
        """Add a range of lost samples to the table of gaps."""
        return self._gaps.append((first_sample, last_sample))

    def overload(self, overload: Overload) -> Batch:
        """Add an overload, or extend the channel's last overload if it continues.

        If the table is full, the channel's last range is extended to include the new one, so that no
        overloaded sample is left out.
        """
        if overload.channel not in self._roles:
            raise RecordingError(
                f"An overload of the unknown channel {overload.channel!r} was given; the channels of the "
                f"recording are {', '.join(self._roles)}."
            )
        row, last = self._last_overload.get(overload.channel, (-1, overload))
        continues = row >= 0 and overload.first_sample <= last.last_sample + 1
        # Keep one row free for the first overload of each channel; later overloads can extend this row.
        untouched = len(self._roles) - len(self._last_overload)
        must_grow = row >= 0 and self._overloads.free_rows <= untouched
        if continues or must_grow:
            grown = Overload(
                overload.channel,
                min(last.first_sample, overload.first_sample),
                max(last.last_sample, overload.last_sample),
            )
            self._last_overload[overload.channel] = (row, grown)
            return self._overloads.replace(row, astuple(grown))
        self._last_overload[overload.channel] = (self._overloads.rows, overload)
        return self._overloads.append(astuple(overload))
