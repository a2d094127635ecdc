"""Writing at known places of a file that one process at a time may write and anybody may read."""

from pathlib import Path
from typing import Protocol

from ..operating_system import OpenFile
from ._errors import StudyError


class Disk(Protocol):
    """What a store needs of a file."""

    def write(self, offset: int, data: bytes) -> None:
        """Put ``data`` at ``offset``, in the system's cache at least."""

    def sync(self) -> None:
        """Return when everything written so far would survive a power cut."""

    def close(self) -> None:
        """Release the file."""


def sole_writer(path: Path) -> OpenFile:
    """Open a file to write, and mark it so for as long as it is open.

    Raises StudyError when another process has it open to write, or it cannot be opened.
    """
    try:
        file = OpenFile(path)
    except OSError as error:
        raise StudyError(f"{path} cannot be opened to write: {error.strerror}.") from error
    try:
        file.lock_sole_writer()
    except OSError as error:
        file.close()
        raise StudyError(
            f"{path} is being written by another run, or another program has it open;"
            " let that end, or close it, and try again."
        ) from error
    return file
