"""Threads of this process as workers: the native engine runs without the interpreter lock."""

import os
import queue
import threading
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import TypeVar

from ..scene.scene import Scene
from ..scene.solve import Solved, solve_scene
from ._errors import InvalidStudy
from ._executor import Bundle, Reply, Solver, solve_timed

Item = TypeVar("Item")


class ThreadExecutor:
    """As many threads as asked for; one for each processor when None.

    Raises
    ------
    InvalidStudy
        When fewer than one worker is asked for.

    """

    def __init__(self, workers: int | None = None, solver: Solver = solve_scene) -> None:
        self._workers = (os.cpu_count() or 1) if workers is None else workers
        if self._workers < 1:
            raise InvalidStudy(f"{workers} workers are not allowed: give one or more.")
        self._solver = solver
        self._is_cancelled = threading.Event()
        self._arrived: queue.SimpleQueue[Reply] = queue.SimpleQueue()
        self._pool = ThreadPoolExecutor(self._workers, thread_name_prefix="study worker")

    @property
    def description(self) -> str:
        """What it is, for the record."""
        return f"{self._workers} thread(s)"

    @property
    def slots(self) -> int:
        """Threads."""
        return self._workers

    def submit(self, bundle: Bundle) -> None:
        """Queue a bundle for the next free thread."""
        solved: list[Solved] = []
        future = self._pool.submit(self._solve_into, solved, bundle.scenes)
        future.add_done_callback(partial(self._note, bundle, solved))

    def replies(self, timeout_s: float) -> Sequence[Reply]:
        """Give what has come back."""
        return arrived_in(self._arrived, timeout_s)

    def cancel(self) -> Sequence[Reply]:
        """Begin no scene more, not even within a bundle; those under way come to their end."""
        self._is_cancelled.set()
        self._pool.shutdown(wait=True, cancel_futures=True)
        return self.replies(0.0)

    def close(self) -> None:
        """Let the threads end."""
        self.cancel()

    def _solve_into(self, solved: list[Solved], scenes: Sequence[Scene]) -> None:
        if self._is_cancelled.is_set():
            return
        for each in solve_timed(scenes, self._solver):
            solved.append(each)
            if self._is_cancelled.is_set():
                return

    def _note(self, bundle: Bundle, solved: list[Solved], future: Future[None]) -> None:
        error = None if future.cancelled() else future.exception()
        self._arrived.put(Reply(bundle, tuple(solved), error))


def arrived_in(arrivals: queue.SimpleQueue[Item], timeout_s: float) -> list[Item]:
    """Empty a queue; waits for the first item, at most ``timeout_s``."""
    items: list[Item] = []
    try:
        items.append(arrivals.get(timeout=timeout_s))
        while True:
            items.append(arrivals.get_nowait())
    except queue.Empty:
        return items
