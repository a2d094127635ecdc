"""A background thread for jobs that may hang, such as writing to a network folder."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Thread

from ..stopping.memory_reserve import MEMORY_RESERVE


class Beside:
    """Runs jobs in order in one thread, which is started before anything drives.

    CPython waits forever for a new thread that runs out of memory while it starts.
    """

    def __init__(self, name: str) -> None:
        self._jobs: deque[Callable[[], None]] = deque()
        self._is_busy = self._is_closing = False
        self._changed = Condition()
        with suppress(RuntimeError):  # the system gives no more threads: the jobs are left out
            Thread(target=self._run, name=name, daemon=True).start()

    @property
    def is_busy(self) -> bool:
        """Whether a job is running or queued."""
        return self._is_busy

    def do(self, job: Callable[[], None]) -> None:
        """Queue a job and return at once. ``job`` raises nothing except MemoryError."""
        with self._changed:
            self._jobs.append(job)
            self._is_busy = True
            self._changed.notify_all()

    def wait(self, longest_s: float) -> None:
        """Wait until every job is done, or for ``longest_s``."""
        with self._changed:
            self._changed.wait_for(lambda: not self._is_busy, longest_s)

    def close(self, longest_s: float) -> None:
        """End the thread after the last queued job; wait for that at most ``longest_s``."""
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        self.wait(longest_s)

    def _run(self) -> None:
        goes_on = True
        while goes_on:
            with suppress(MemoryError), MEMORY_RESERVE.released_when_short():
                goes_on = self._step()

    def _step(self) -> bool:
        with self._changed:
            self._is_busy = bool(self._jobs)
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._jobs or self._is_closing)
            if not self._jobs:
                return False
            job = self._jobs.popleft()
        job()
        return True
