"""Interface between the queue and its workers, which are local threads or remote processes.

Computing times of scenes exclude what a process does only once: loading modules, computing tables.
"""

import json
import math
import os
import platform
import queue
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from typing import Protocol, TypeAlias, TypeVar

from ..engine.library import physics_digest
from ..scene.cost import learn_cost
from ..scene.prediction import Method
from ..scene.scene import Scene
from ..scene.solve import InBatches, SolvedScene, Solver as SceneSolver, solve_scene, solve_scenes
from ._errors import InvalidStudy


@dataclass(frozen=True)
class Bundle:
    """Scenes that are sent to a worker together, because it is slow to send short scenes one by one."""

    numbers: tuple[int, ...]
    """Index of the point of the study to which each scene belongs."""
    scenes: tuple[Scene, ...]


@dataclass(frozen=True, eq=False)
class Reply:
    """Results of a bundle, as a worker returns them."""

    bundle: Bundle
    solved: tuple[SolvedScene, ...]
    """Results in the order of the scenes; some are missing after a cancellation or an error."""
    error: BaseException | None = None
    """Error that prevented the missing results; None if there was no error."""


class Executor(Protocol):
    """Executor of bundles. Every bundle gets a reply, in any order, even if workers are lost."""

    @property
    def description(self) -> str:
        """Description of the executor, which the study's file stores."""

    @property
    def slots(self) -> int:
        """Number of bundles that can be computed at the same time; this number may change, even to 0."""

    def submit(self, bundle: Bundle) -> None:
        """Add a bundle to the queue of the executor."""

    def replies(self, timeout_s: float) -> Sequence[Reply]:
        """Return the replies that have arrived; wait at most ``timeout_s`` for the first.

        Raises ClusterLost when no more replies can arrive.
        """

    def cancel(self) -> Sequence[Reply]:
        """Start no more scenes, and return the replies for running scenes. May be called at any time."""

    def close(self) -> None:
        """Release all workers. May be called at any time."""


Solver: TypeAlias = SceneSolver
Kind = tuple[object, ...]
_solved_before: set[Kind] = set()
"""Kinds of scenes that this process has solved."""


def solve_timed(scenes: Sequence[Scene], solver: Solver) -> Iterator[SolvedScene]:
    """Solve scenes, in batches or one by one; yield each result with its processor time.

    Times are recorded for later estimates, except for the first scene of each kind, which may load modules.
    """
    for group in [scenes] if isinstance(solver, InBatches) else [[scene] for scene in scenes]:
        kinds: list[Kind] = [
            (solver, type(each.specimen.contact), each.observe, type(each.duration)) for each in group
        ]
        are_prepared = [kind in _solved_before for kind in kinds]
        if isinstance(solver, InBatches):
            found = solve_scenes(group, solver.question)
        else:
            start_s = time.thread_time()
            prediction = solver(group[0])
            found = [SolvedScene(prediction, time.thread_time() - start_s)]
        _solved_before.update(kinds)
        for scene, is_prepared, each in zip(group, are_prepared, found, strict=True):
            # Do not record times of closed forms: planning takes about as long as evaluating them.
            if is_prepared and each.prediction.method is not Method.CLOSED_FORM:
                learn_cost(scene, each.taken_s, solver)
            yield SolvedScene(each.prediction, each.taken_s if is_prepared else math.nan)


Item = TypeVar("Item")


class ThreadExecutor:
    """Executor with the requested number of threads, by default one per processor.

    Raises InvalidStudy when fewer than one worker is requested.
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
        """Description of the executor, which the study's file stores."""
        return f"{self._workers} thread(s)"

    @property
    def slots(self) -> int:
        """Number of threads of the executor."""
        return self._workers

    def submit(self, bundle: Bundle) -> None:
        """Add a bundle to the queue for the next free thread."""
        solved: list[SolvedScene] = []
        future = self._pool.submit(self._solve_into, solved, bundle.scenes)
        future.add_done_callback(partial(self._note, bundle, solved))

    def replies(self, timeout_s: float) -> Sequence[Reply]:
        """Return the replies for finished bundles; wait at most ``timeout_s`` for the first."""
        return empty_queue(self._arrived, timeout_s)

    def cancel(self) -> Sequence[Reply]:
        """Start no more scenes, not even in a running bundle; return the replies once running scenes end."""
        self._is_cancelled.set()
        self._pool.shutdown(wait=True, cancel_futures=True)
        return self.replies(0.0)

    def close(self) -> None:
        """End the threads of the executor."""
        self.cancel()

    def _solve_into(self, solved: list[SolvedScene], scenes: Sequence[Scene]) -> None:
        if self._is_cancelled.is_set():
            return
        for each in solve_timed(scenes, self._solver):
            solved.append(each)
            if self._is_cancelled.is_set():
                return

    def _note(self, bundle: Bundle, solved: list[SolvedScene], future: Future[None]) -> None:
        error = None if future.cancelled() else future.exception()
        self._arrived.put(Reply(bundle, tuple(solved), error))


def empty_queue(arrivals: queue.SimpleQueue[Item], timeout_s: float) -> list[Item]:
    """Return all items now in a queue; wait at most ``timeout_s`` for the first item."""
    items: list[Item] = []
    try:
        items.append(arrivals.get(timeout=timeout_s))
        while True:
            items.append(arrivals.get_nowait())
    except queue.Empty:
        return items


PACKAGES = ("vibench", "numpy", "scipy")


@cache
def software() -> str:
    """Return package versions and a digest of the simulation's sources, as JSON text with sorted keys."""
    found = {"python": platform.python_version(), "sim_sources": physics_digest()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return json.dumps(found, sort_keys=True)
