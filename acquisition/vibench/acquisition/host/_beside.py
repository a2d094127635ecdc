"""What may hang, as a folder of a network does, is done beside whoever must not wait."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Thread

from ..stopping import MEMORY_RESERVE


class Beside:
    """Does one thing after the other in a standing thread, which exists before anything drives.

    A thread that is started when memory is exhausted may never report that it runs, and CPython waits for
    that for ever.
    """

    def __init__(self, name: str) -> None:
        self._jobs: deque[Callable[[], None]] = deque()
        self._is_busy = self._is_closing = False
        self._changed = Condition()
        with suppress(RuntimeError):  # the system gives no more threads: what hangs no run is not done
            Thread(target=self._run, name=name, daemon=True).start()

    @property
    def is_busy(self) -> bool:
        """Whether it is still at something."""
        return self._is_busy

    def do(self, job: Callable[[], None]) -> None:
        """Do this after all else; whoever asks does not wait. ``job`` raises nothing but MemoryError."""
        with self._changed:
            self._jobs.append(job)
            self._is_busy = True
            self._changed.notify_all()

    def wait(self, longest_s: float) -> None:
        """Wait until all is done, but no longer."""
        with self._changed:
            self._changed.wait_for(lambda: not self._is_busy, longest_s)

    def close(self, longest_s: float) -> None:
        """End the thread after all that is asked for; wait for that, but no longer."""
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
