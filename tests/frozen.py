"""Freeze a process and wait until all its threads have stopped."""

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
    """Stop all threads of a process; let them continue at the end.

    The signal wakes one thread, which stops all other threads. On a busy computer these threads run for some
    tenths of a second longer.
    """
    os.kill(pid, signal.SIGSTOP)
    try:
        give_up_s, pause = time.monotonic() + PATIENCE_S, Event()
        while not _is_stopped(pid):
            assert time.monotonic() < give_up_s, f"process {pid} does not stop"
            pause.wait(0.01)
        yield
    finally:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def _is_stopped(pid: int) -> bool:
    """Return whether every thread of a process is stopped, from its files in /proc (Linux only)."""
    threads = Path(f"/proc/{pid}/task").glob("*/stat")
    return all(each.read_text().rpartition(")")[2].split()[0] == "T" for each in threads)
