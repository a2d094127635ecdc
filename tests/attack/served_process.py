"""A vibench server in a separate process, observed from outside: output, memory and descriptors."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from .command_runner import ROOT
from .limits import MOST_BYTES

STARTING_S = 300.0
"""Time limit of a start [s]; the first start after a change of the simulation compiles its kernels."""
LOOK_S = 0.05
PAGE = os.sysconf("SC_PAGE_SIZE")


class ServedProcess:
    """A Python module that runs until it is closed, with a separate working folder and state folder."""

    def __init__(self, *words: str) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="vibench_attack_")
        self.folder = Path(self._folder.name)
        self._err = (self.folder / "err.txt").open("w+b")
        self._out = (self.folder / "out.txt").open("w+b")
        state = {"VIBENCH_STATE_DIR": str(self.folder / "state"), "COLUMNS": "200", "PYTHONUNBUFFERED": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-m", *words],
            stdin=subprocess.PIPE,
            stdout=self._out,
            stderr=self._err,
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": str(ROOT), **state},
        )

    @property
    def out(self) -> str:
        """Standard output of the process so far."""
        return (self.folder / "out.txt").read_text(encoding="utf-8", errors="replace")

    @property
    def err(self) -> str:
        """Standard error of the process so far."""
        return (self.folder / "err.txt").read_text(encoding="utf-8", errors="replace")

    def until(self, is_there: Callable[[str], bool]) -> str:
        """Wait until a condition on the standard output holds; return the output."""
        give_up_s = time.monotonic() + STARTING_S
        while not is_there(said := self.out):
            if time.monotonic() > give_up_s or self._process.poll() is not None:
                raise RuntimeError(f"it did not come up: {said!r}, {self.err!r}")
            time.sleep(LOOK_S)
        return said

    @property
    def is_alive(self) -> bool:
        """Whether the process is running."""
        return self._process.poll() is None

    @property
    def resident_bytes(self) -> int:
        """Resident memory of the process [bytes]."""
        return int(Path(f"/proc/{self._process.pid}/statm").read_text().split()[1]) * PAGE

    @property
    def peak_bytes(self) -> int:
        """Largest resident memory of the process so far [bytes]."""
        status = Path(f"/proc/{self._process.pid}/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))

    @property
    def descriptors(self) -> int:
        """Number of open files and sockets of the process."""
        return sum(1 for _ in Path(f"/proc/{self._process.pid}/fd").iterdir())

    def faults(self, most_descriptors: int) -> tuple[str, ...]:
        """Return the faults of the process: a traceback, too much memory, too many open files or sockets."""
        found = (
            ("a traceback", "Traceback (most recent call last)" in self.err),
            (f"took {self.peak_bytes / 1e6:.0f} MB", self.peak_bytes > MOST_BYTES),
            (f"holds {self.descriptors} descriptors", self.descriptors > most_descriptors),
        )
        return tuple(said for said, is_so in found if is_so)

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        try:
            self._process.wait(20.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdin.close()
        self._err.close()
        self._out.close()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
