"""Access to a recording's file on a disk that may fill up or lose power, and simulated disk faults."""

import errno
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from math import inf
from pathlib import Path

from vibench.sim.operating_system.this import Buffer, OpenFile, is_locked_alone

from ..errors import RecordingError


class PositionedFile(OpenFile):
    """File on a real disk. A lock marks it as being recorded; other programs may still read it."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.lock_in_use()

    def sync(self) -> None:
        """Sync data and metadata to the disk; raises OSError if the file was removed."""
        super().sync()
        if not self.has_a_name:
            raise FileNotFoundError(errno.ENOENT, "the file, or its folder, was removed")


@contextmanager
def sole_use(path: Path) -> Iterator[None]:
    """Lock a file for its recovery, until the ``with`` block ends.

    Raises RecordingError when another process is recording to this file.
    """
    with closing(OpenFile(path)) as file:
        if not file.is_locked_alone():
            raise RecordingError(
                f"{path} is still being recorded, or another program has it open. Nothing was changed;"
                " wait until the recording has ended (or close the other program) and try again."
            )
        yield


def is_being_recorded(path: Path) -> bool:
    """Whether a running process has the file open for recording."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        return not is_locked_alone(descriptor)
    finally:
        os.close(descriptor)


Heal = Callable[[], None]


class DiskTrouble:
    """Simulated disk fault; any thread may set or end it.

    From the second refusal on, ``on_refusal`` is called before the error is raised.
    """

    def __init__(self, on_refusal: Callable[[], None] = lambda: None) -> None:
        self._on_refusal = on_refusal
        self._changed = threading.Condition()
        self._refusals = 0.0
        self._has_refused = False
        self._delay_s = 0.0

    def fill(self, refusals: float = inf) -> Heal:
        """Simulate a full disk for ``refusals`` operations, or until the returned function is called."""
        with self._changed:
            self._refusals, self._has_refused = refusals, False
        return self._make_room

    def slow_down(self, delay_s: float) -> Heal:
        """Delay every operation by this time [s], until the returned function is called."""
        with self._changed:
            self._delay_s = delay_s
        return self._speed_up

    def apply(self) -> None:
        """Apply the current fault: wait for a slow disk; raises OSError (ENOSPC) for a full disk."""
        with self._changed:
            # Wait as long as a slow disk would, but stop waiting when the fault ends.
            self._changed.wait_for(lambda: self._delay_s == 0.0, timeout=self._delay_s)
            is_refused = self._refusals > 0
            self._refusals -= is_refused
            is_refused_again = is_refused and self._has_refused
            self._has_refused |= is_refused
        if is_refused_again:
            self._on_refusal()
        if is_refused:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _make_room(self) -> None:
        with self._changed:
            self._refusals = 0.0

    def _speed_up(self) -> None:
        with self._changed:
            self._delay_s = 0.0
            self._changed.notify_all()


class TroubledDisk(PositionedFile):
    """File on a disk with simulated faults: each operation except `close` first applies the faults."""

    def write(self, offset: int, data: Buffer) -> None:
        """Write ``data`` at ``offset`` of the file."""
        meet_trouble()
        super().write(offset, data)

    def sync(self) -> None:
        """Wait until everything written so far would survive a power cut."""
        meet_trouble()
        super().sync()

    def reserve(self, offset: int, size: int) -> None:
        """Reserve space for this range of the file."""
        meet_trouble()
        super().reserve(offset, size)


_installed: list[DiskTrouble] = []
"""Simulated faults that are active in this process; each fault affects all recordings."""


@contextmanager
def trouble_disks(trouble: DiskTrouble) -> Iterator[None]:
    """Apply ``trouble`` to every recording opened in this context."""
    _installed.append(trouble)
    try:
        yield
    finally:
        _installed.remove(trouble)


def open_disk(path: Path) -> PositionedFile:
    """Open an existing file for recording, with the active simulated faults."""
    return TroubledDisk(path) if _installed else PositionedFile(path)


def meet_trouble() -> None:
    """Apply the active simulated faults before a write."""
    for trouble in tuple(_installed):
        trouble.apply()
