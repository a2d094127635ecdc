"""Writing at known places of a file that one process at a time may write and anybody may read."""

import time
from pathlib import Path
from typing import Protocol

from ..operating_system.open_file import OpenFile
from ._errors import StudyError

_LONGEST_LOOK_S, _BETWEEN_TRIES_S = 2.0, 0.02
"""Of a reader; a writer has a file open for as long as it runs."""


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

    Whoever looks at an answer has the file open for a moment: that is waited for. Raises StudyError when
    another process has it open for longer, as whoever writes it has, or it cannot be opened.
    """
    try:
        file = OpenFile(path)
    except OSError as error:
        raise StudyError(f"{path} cannot be opened to write: {error.strerror}.") from error
    given_up_s = time.monotonic() + _LONGEST_LOOK_S
    while True:
        try:
            file.lock_sole_writer()
        except OSError as error:
            if time.monotonic() < given_up_s:
                time.sleep(_BETWEEN_TRIES_S)
                continue
            file.close()
            raise StudyError(
                f"{path} is being written by another run, or another program has it open;"
                " let that end, or close it, and try again."
            ) from error
        return file
