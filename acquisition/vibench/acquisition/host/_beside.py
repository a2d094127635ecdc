"""What may hang, as a folder of a network does, is done beside whoever must not wait."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Thread


class Beside:
    """Does one thing after the other, in a thread that is there while there is something to do."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: deque[Callable[[], None]] = deque()
        self._is_busy = False
        self._changed = Condition()

    @property
    def is_busy(self) -> bool:
        """Whether it is still at something."""
        return self._is_busy

    def do(self, job: Callable[[], None]) -> None:
        """Do this after all else; whoever asks does not wait. ``job`` raises nothing."""
        with self._changed:
            self._jobs.append(job)
            if not self._is_busy:
                with suppress(RuntimeError):  # the system gives no more threads: with the next, perhaps
                    Thread(target=self._run, name=self._name, daemon=True).start()
                    self._is_busy = True

    def wait(self, longest_s: float) -> None:
        """Wait until all is done, but no longer."""
        with self._changed:
            self._changed.wait_for(lambda: not self._is_busy, longest_s)

    def _run(self) -> None:
        while True:
            with self._changed:
                if not self._jobs:
                    self._is_busy = False
                    self._changed.notify_all()
                    return
                job = self._jobs.popleft()
            job()
