"""Freeze a process until it really stands still."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event

PATIENCE_S = 20.0


@contextmanager
def frozen(pid: int) -> Iterator[None]:
    """Stop all threads of a process; they go on afterwards.

    The signal wakes one thread, which stops the others: on a loaded computer these run for some tenths of a
    second more.
    """
    os.kill(pid, signal.SIGSTOP)
    try:
        give_up_s, pause = time.monotonic() + PATIENCE_S, Event()
        while not _stands_still(pid):
            assert time.monotonic() < give_up_s, f"process {pid} does not stop"
            pause.wait(0.01)
        yield
    finally:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def _stands_still(pid: int) -> bool:
    """Read the state of each thread, which follows its name in parentheses; only Linux has such files."""
    threads = Path(f"/proc/{pid}/task").glob("*/stat")
    return all(each.read_text().rpartition(")")[2].split()[0] == "T" for each in threads)
