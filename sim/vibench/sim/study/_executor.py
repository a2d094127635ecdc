"""The boundary between the queue and whatever computes: threads here, processes elsewhere.

What a scene costs, without what a process pays once: modules loaded, tables of its law.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from ..scene.measured_cost import Solver as SceneSolver, learn_cost
from ..scene.prediction import Method, ScenePrediction
from ..scene.scene import Scene
from ..scene.solve import Question, Solved, solve_scenes


@dataclass(frozen=True)
class Bundle:
    """Scenes that are handed over together, so that short ones do not drown in overhead."""

    numbers: tuple[int, ...]
    """Which points of the study they are."""
    scenes: tuple[Scene, ...]


@dataclass(frozen=True, eq=False)
class Reply:
    """What came back for a bundle."""

    bundle: Bundle
    solved: tuple[Solved, ...]
    """One for each scene, in order; fewer when it was cancelled or failed on the way."""
    error: BaseException | None = None
    """Why there are fewer, if that was an error."""


class Executor(Protocol):
    """What computes bundles. It may lose workers, but no bundle; the order of replies is its own."""

    @property
    def description(self) -> str:
        """What it is, for the record."""

    @property
    def slots(self) -> int:
        """How many bundles it computes at the same time; may change. None at the moment: 0."""

    def submit(self, bundle: Bundle) -> None:
        """Take a bundle, and compute it when its turn comes."""

    def replies(self, timeout_s: float) -> Sequence[Reply]:
        """Give what has come back; waits for the first, at most ``timeout_s``.

        Raises ClusterLost when nothing can come back any more.
        """

    def cancel(self) -> Sequence[Reply]:
        """Begin nothing more, end soon, and give what has come back until then. Legal at any time."""

    def close(self) -> None:
        """Let go of every worker. Legal at any time."""


Solver: TypeAlias = SceneSolver
Kind = tuple[object, ...]
_solved_before: set[Kind] = set()
"""Kinds of scenes for which this process is prepared."""


def solve_timed(scenes: Sequence[Scene], solver: Solver) -> Iterator[Solved]:
    """Solve scenes, in batches or one by one, and say what each cost this thread.

    What they cost is learnt. A scene that begins before one of its kind has ended may have loaded modules and
    made tables: its time says nothing.
    """
    for group in [scenes] if isinstance(solver, Question) else [[scene] for scene in scenes]:
        kinds: list[Kind] = [
            (solver, type(each.specimen.contact), each.observe, type(each.duration)) for each in group
        ]
        are_prepared = [kind in _solved_before for kind in kinds]
        found = solve_scenes(group, solver) if isinstance(solver, Question) else [_timed(group[0], solver)]
        _solved_before.update(kinds)
        for scene, is_prepared, each in zip(group, are_prepared, found, strict=True):
            # To plan a closed form takes about as long as to evaluate it.
            if is_prepared and each.prediction.method is not Method.CLOSED_FORM:
                learn_cost(scene, each.taken_s, solver)
            yield Solved(each.prediction, each.taken_s if is_prepared else math.nan)


def _timed(scene: Scene, solver: Callable[[Scene], ScenePrediction]) -> Solved:
    start_s = time.thread_time()
    prediction = solver(scene)
    return Solved(prediction, time.thread_time() - start_s)
