"""Writing at known places of a file that one process at a time may write and anybody may read."""

import os
import sys
from pathlib import Path
from typing import Protocol

from ._errors import StudyError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

LOCK_BYTE = 2**62
"""Windows locks bytes, not files: one that lies beyond everything."""


class Disk(Protocol):
    """What a store needs of a file."""

    def write(self, offset: int, data: bytes) -> None:
        """Put ``data`` at ``offset``, in the system's cache at least."""

    def sync(self) -> None:
        """Return when everything written so far would survive a power cut."""

    def close(self) -> None:
        """Release the file."""


class SoleWriter:
    """A file open for writing, and marked so for as long as it is.

    The mark is a lock that vanishes with the process, however that ends; other programs may read.
    Windows is written from the documentation and has not been tried.

    Raises
    ------
    StudyError
        When another process has it open to write, or it cannot be opened.

    """

    def __init__(self, path: Path) -> None:
        try:
            self._descriptor = _opened(path)
        except OSError as error:
            raise StudyError(f"{path} cannot be opened to write: {error.strerror}.") from error
        try:
            _mark(self._descriptor)
        except OSError as error:
            os.close(self._descriptor)
            raise StudyError(
                f"{path} is being written by another run, or another program has it open;"
                " let that end, or close it, and try again."
            ) from error

    def write(self, offset: int, data: bytes) -> None:
        """Put ``data`` at ``offset``; a short write is continued."""
        while data:
            written = _write_at(self._descriptor, data, offset)
            data, offset = data[written:], offset + written

    def sync(self) -> None:
        """Return when everything written so far would survive a power cut."""
        _sync(self._descriptor)

    def close(self) -> None:
        """Release file and mark."""
        os.close(self._descriptor)


def sync_file(path: Path) -> None:
    """Push a closed file, and its name, to the disk."""
    descriptor = _opened(path)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Push the names in a folder to the disk; Windows does that by itself."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


if sys.platform == "win32":

    def _opened(path: Path) -> int:
        return os.open(path, os.O_RDWR | os.O_BINARY)

    def _write_at(descriptor: int, data: bytes, offset: int) -> int:
        os.lseek(descriptor, offset, os.SEEK_SET)
        return os.write(descriptor, data)

    def _sync(descriptor: int) -> None:
        os.fsync(descriptor)

    def _mark(descriptor: int) -> None:
        os.lseek(descriptor, LOCK_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:

    def _opened(path: Path) -> int:
        return os.open(path, os.O_RDWR)

    def _write_at(descriptor: int, data: bytes, offset: int) -> int:
        return os.pwrite(descriptor, data, offset)

    def _sync(descriptor: int) -> None:
        if sys.platform == "linux":
            os.fdatasync(descriptor)
        else:
            os.fsync(descriptor)

    def _mark(descriptor: int) -> None:
        """Take the lock alone, then keep a shared one, under which h5py opens the file to read.

        Between the two another process may slip in; then the second step is refused.
        """
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
