"""Writing at known places of a file, in a known order, on a disk that may be full or lose power.

Everything that differs between operating systems stands here. Windows is written from the
documentation and has not been tried.
"""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from ..errors import RecordingError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

Buffer = bytes | memoryview

LOCK_BYTE = 2**62
"""Windows locks bytes, not files: one that lies beyond every sample."""


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


class PositionedFile:
    """A file on a real disk, marked as being recorded for as long as it is open.

    The mark is a shared lock: it vanishes with the process, however that ends, and lets other
    programs read.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = opened_to_write(path)
        _mark_in_use(self._descriptor)

    def write(self, offset: int, data: Buffer) -> None:
        """Put ``data`` at ``offset``; a short write is continued."""
        rest = memoryview(data).cast("B")
        while len(rest):
            written = _write_at(self._descriptor, rest, offset)
            rest, offset = rest[written:], offset + written

    def sync(self) -> None:
        """Push data and what is needed to find it to the disk; a file without a name can never be found."""
        _sync_data(self._descriptor)
        if os.fstat(self._descriptor).st_nlink == 0:
            raise FileNotFoundError(errno.ENOENT, "the file, or its folder, was removed")

    def reserve(self, offset: int, size: int) -> None:
        """Allocate blocks where the system can; elsewhere the check of free space must do."""
        allocate(self._descriptor, offset, size)

    def close(self) -> None:
        """Release file and mark."""
        os.close(self._descriptor)


def sync_file(path: Path) -> None:
    """Push a finished file to the disk."""
    descriptor = opened_to_write(path)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_folder(folder: Path) -> None:
    """Push the names in a folder to the disk; Windows does that by itself."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def sole_use(path: Path) -> Iterator[None]:
    """Hold a file that nobody records to; for the time of a recovery.

    Raises
    ------
    RecordingError
        When another process is recording to it.

    """
    descriptor = opened_to_write(path)
    try:
        if not _taken_alone(descriptor):
            raise RecordingError(
                f"{path} is still being recorded, or another program has it open. Nothing was changed;"
                " let the recording end (or close the other program) and try again."
            )
        yield
    finally:
        os.close(descriptor)


def is_being_recorded(path: Path) -> bool:
    """Whether a living process holds the file open for recording."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        return not _taken_alone(descriptor)
    finally:
        os.close(descriptor)


if sys.platform == "win32":

    def opened_to_write(path: Path) -> int:
        """Open an existing file; the descriptor comes back."""
        return os.open(path, os.O_RDWR | os.O_BINARY)

    def _write_at(descriptor: int, data: memoryview, offset: int) -> int:
        os.lseek(descriptor, offset, os.SEEK_SET)
        return os.write(descriptor, data)

    def _sync_data(descriptor: int) -> None:
        os.fsync(descriptor)

    def allocate(descriptor: int, offset: int, size: int) -> None:
        """Do nothing: NTFS has allocated the file when its length was set."""

    def _mark_in_use(descriptor: int) -> None:
        os.lseek(descriptor, LOCK_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

    def _taken_alone(descriptor: int) -> bool:
        try:
            _mark_in_use(descriptor)
        except OSError:
            return False
        return True

else:

    def opened_to_write(path: Path) -> int:
        """Open an existing file; the descriptor comes back."""
        return os.open(path, os.O_RDWR)

    def _write_at(descriptor: int, data: memoryview, offset: int) -> int:
        return os.pwrite(descriptor, data, offset)

    def _sync_data(descriptor: int) -> None:
        if sys.platform == "linux":
            os.fdatasync(descriptor)
        else:
            os.fsync(descriptor)

    def allocate(descriptor: int, offset: int, size: int) -> None:
        """Let the system give blocks to a range of the file, where it can."""
        if sys.platform != "linux":
            return
        try:
            os.posix_fallocate(descriptor, offset, size)
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                raise

    def _mark_in_use(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)

    def _taken_alone(descriptor: int) -> bool:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
