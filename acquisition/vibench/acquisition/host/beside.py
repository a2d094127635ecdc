"""A helper thread for work that may hang, and a base class of objects that a ``with`` block closes."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Thread
from typing import Self

from ..stopping.stop import MEMORY_RESERVE


class Beside:
    """Thread that runs jobs in order. The thread is started before any signal is played.

    A later start could hang: if memory runs out while a thread starts, CPython waits forever for the thread.
    """

    def __init__(self, name: str) -> None:
        self._jobs: deque[Callable[[], None]] = deque()
        self.is_busy = self._is_closing = False
        """Whether a job is running or queued in the helper thread."""
        self._changed = Condition()
        with suppress(RuntimeError):  # if the system refuses the thread, jobs are not done
            Thread(target=self._run, name=name, daemon=True).start()

    def do(self, job: Callable[[], None]) -> None:
        """Queue a job and return at once. ``job`` may raise only MemoryError."""
        with self._changed:
            self._jobs.append(job)
            self.is_busy = True
            self._changed.notify_all()

    def wait(self, longest_s: float) -> None:
        """Wait until every job is done, but at most ``longest_s``."""
        with self._changed:
            self._changed.wait_for(lambda: not self.is_busy, longest_s)

    def close(self, longest_s: float) -> None:
        """End the thread after the last queued job; wait at most ``longest_s``."""
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        self.wait(longest_s)

    def _run(self) -> None:
        goes_on = True
        while goes_on:
            try:
                goes_on = self._step()
            except MemoryError:
                MEMORY_RESERVE.release()

    def _step(self) -> bool:
        with self._changed:
            self.is_busy = bool(self._jobs)
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._jobs or self._is_closing)
            if not self._jobs:
                return False
            job = self._jobs.popleft()
        job()
        return True


class ClosedOnLeaving(ABC):
    """Base of objects that are closed at the end of a ``with`` block."""

    @abstractmethod
    def close(self) -> None:
        """Release all resources of the object. May be called at any time."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
