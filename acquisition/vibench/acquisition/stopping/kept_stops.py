"""Stops that need no connection: a file in the state folder, which whatever drives looks for all the time.

Its name says everything: which process, when that began, how hard. So it is found with a look at a name,
by a process that may open no more files, and it can be put down on a disk that takes no more bytes; what
it holds is the reason, where there is room for one.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from stat import S_IMODE, S_ISREG

from vibench.sim.operating_system.state_folder import state_folder
from vibench.sim.operating_system.this import process_start, rename
from vibench.stop_files import stop_path, taken_path

from .driving import DRIVES_ON
from .stop import StopLevel

SILENT_REASON = "a stop that was left in the state folder"


def engines_folder() -> Path:
    """Give the folder in which programs are announced and stops are put down; nobody else's business."""
    folder = state_folder() / "engines"
    folder.mkdir(mode=0o700, exist_ok=True)
    if S_IMODE(folder.stat().st_mode) != 0o700:
        folder.chmod(0o700)
    return folder


class KeptStops:
    """The stops that are put down for one process."""

    def __init__(
        self, pid: int, process_start: str, press: Callable[[StopLevel, str], None], folder: Path
    ) -> None:
        self._paths = {
            level: Path(stop_path(str(folder), pid, process_start, level)) for level in reversed(StopLevel)
        }
        self._press = press
        self._obeyed: dict[Path, tuple[int, int]] = {}
        self._taken: set[Path] = set()
        self._reserve = os.open(os.devnull, os.O_RDONLY)
        """Given back to read a reason by."""

    @classmethod
    def of_this_process(cls, press: Callable[[StopLevel, str], None]) -> "KeptStops":
        """Look for stops of this process; ``press`` carries them out."""
        return cls(os.getpid(), process_start(os.getpid()) or "", press, engines_folder())

    def obey(self) -> None:
        """Carry out what was put down since the last look, the hardest first; confirm what was obeyed."""
        for level, path in self._paths.items():
            try:
                found = path.stat()
            except OSError:  # not there, or the folder is not
                continue
            mark = (found.st_ino, found.st_mtime_ns)
            if self._obeyed.get(path) == mark:
                continue
            self._obeyed[path] = mark  # where it cannot be taken away, it is still obeyed only once
            # Reading a pipe could wait for ever.
            self._press(level, self._reason(path) if S_ISREG(found.st_mode) else SILENT_REASON)
            taken = Path(taken_path(str(path)))
            with suppress(OSError):
                rename(path, taken)
                self._taken.add(taken)
        self.confirm()

    def confirm(self) -> None:
        """Remove obeyed stops once nothing drives; until then, show that the program is alive."""
        is_advancing = DRIVES_ON.take_advance()
        for taken in tuple(self._taken):
            with suppress(OSError):  # somebody has emptied the folder
                if not DRIVES_ON:
                    self._taken.discard(taken)
                    taken.unlink()
                elif is_advancing:
                    os.utime(taken)

    def close(self) -> None:
        """Look no more."""
        if self._reserve >= 0:
            os.close(self._reserve)
            self._reserve = -1

    def _reason(self, path: Path) -> str:
        self.close()
        try:
            return path.read_text(encoding="utf-8", errors="replace") or SILENT_REASON
        except OSError:  # somebody else has taken the descriptor
            return SILENT_REASON
        finally:
            with suppress(OSError):
                self._reserve = os.open(os.devnull, os.O_RDONLY)
