"""Descriptors held for the end of a recording: whatever else has taken all the others, it can be finished."""

import os

from ..errors import RecordingError

RESERVED = 8
"""The recording and its copy, the folder, what is opened to look at the disk; and the journal's after it."""


class DescriptorReserve:
    """Open descriptors of no use but to be given back."""

    def __init__(self) -> None:
        self._held: list[int] = []
        try:
            for _ in range(RESERVED):
                self._held.append(os.open(os.devnull, os.O_RDONLY))
        except OSError as error:
            self.close()
            raise RecordingError(
                f"this process may open no more files ({error}), and a recording needs {RESERVED} to be "
                "finished. Nothing was recorded; raise its limit (ulimit -n), or close other programs"
            ) from error

    def close(self) -> None:
        """Give them back. Legal at any time."""
        while self._held:
            os.close(self._held.pop())
