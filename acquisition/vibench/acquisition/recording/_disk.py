"""Writing at known places of a file, in a known order, on a disk that may be full or lose power."""

import errno
import os
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Protocol

from vibench.sim.operating_system.this import Buffer, OpenFile, is_locked_alone

from ..errors import RecordingError


class Disk(Protocol):
    """What the committer needs of a file."""

    def write(self, offset: int, data: Buffer) -> None:
        """Put ``data`` at ``offset``, in the system's cache at least."""

    def sync(self) -> None:
        """Return when everything written so far would survive a power cut."""

    def reserve(self, offset: int, size: int) -> None:
        """Claim room, so that later writes there cannot find the disk full."""

    def close(self) -> None:
        """Release the file."""


class PositionedFile(OpenFile):
    """A file on a real disk, marked as being recorded for as long as it is open; others may read."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.lock_in_use()

    def sync(self) -> None:
        """Push data and what is needed to find it to the disk; a file without a name can never be found."""
        super().sync()
        if not self.has_a_name:
            raise FileNotFoundError(errno.ENOENT, "the file, or its folder, was removed")


@contextmanager
def sole_use(path: Path) -> Iterator[None]:
    """Hold a file that nobody records to; for the time of a recovery.

    Raises
    ------
    RecordingError
        When another process is recording to it.

    """
    with closing(OpenFile(path)) as file:
        if not file.is_locked_alone():
            raise RecordingError(
                f"{path} is still being recorded, or another program has it open. Nothing was changed;"
                " let the recording end (or close the other program) and try again."
            )
        yield


def is_being_recorded(path: Path) -> bool:
    """Whether a living process holds the file open for recording."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        return not is_locked_alone(descriptor)
    finally:
        os.close(descriptor)
