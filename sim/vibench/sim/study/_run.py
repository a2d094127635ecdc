"""Running a study: one queue, whatever computes; answers are kept as they come."""

import math
import time
from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..background import Cancelled, Observer, Progress
from ..model.arrays import Floats
from ..scene.scene import Scene
from ..scene.solve import Solved
from ._axes import Grid
from ._columns import TAKEN
from ._executor import Bundle, Executor, Reply
from ._expansion import Expansion
from ._layout import PointState
from ._point_scheduler import Costs, PointScheduler
from ._store import Arrays, PointAnswer, Store, is_failed, states
from ._study import Study

MOST_IN_BUNDLE = 64
"""Answers that may be lost together with their worker."""
SHARE = 8
"""A bundle is at most this part of what is left for each worker, so that all end together."""
QUEUED_PER_SLOT = 2
"""Bundles handed over for each worker: one to compute, and the next, so that it never waits."""
LOOK_S = 0.2
"""How often a cancellation is asked for."""


class StudyEnd(StrEnum):
    """How a session ended."""

    COMPLETE = "complete"
    CANCELLED = "cancelled"


class Points(Protocol):
    """The points of a plan as scenes, and which of them are to be computed."""

    bundle_s: float
    """Worker time of the scenes that are handed over together, at most."""

    @property
    def grid(self) -> Grid:
        """All of them."""

    @property
    def after(self) -> NDArray[np.int64]:
        """Point that each one continues, or NOBODY, shape (points,)."""

    @property
    def planned_s(self) -> Floats:
        """Time that each point is planned to take, shape (points,)."""

    def wanted(self, arrays: Arrays) -> NDArray[np.int64]:
        """Numbers of the points that what is known so far asks for; asked again when all have an answer."""

    def scene(self, number: int, arrays: Arrays) -> Scene:
        """Make the scene of a point whose predecessor, if it has one, is done; ValueError if not allowed."""

    def answer(self, number: int, scene: Scene, solved: Solved, arrays: Arrays) -> PointAnswer:
        """Say what is kept of a prediction."""

    def failure(self, number: int, error: BaseException) -> PointAnswer:
        """Say what is kept of a scene that could not be computed."""


def run_study(
    study: Study,
    executor: Executor,
    store: Store,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> StudyEnd:
    """Compute every point that the store misses, longest first.

    The answers do not depend on the executor or on the order: each scene is computed alone, and a point
    that continues another waits for it. An error in one scene is that point's answer.

    Parameters
    ----------
    study, executor, store
        What is asked, who computes, and where it is kept.
    observer
        Told of every answer.
    cancelled
        Asked between answers whether to end.

    Raises
    ------
    StudyError
        When the store or the executor fails; what was kept before is kept.

    """
    return run_points(Expansion(study), executor, store, observer, cancelled)


def run_points(
    points: Points,
    executor: Executor,
    store: Store,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> StudyEnd:
    """Compute all points that are wanted and that the store misses, until ``cancelled``; as `run_study`."""
    session = _Session(points, executor, store)
    if session.is_unfinished:
        store.begin(executor.description)
    while session.is_unfinished:
        session.feed()
        replies = executor.replies(LOOK_S)
        session.keep(replies)
        if replies and observer is not None:
            observer(session.progress())
        if cancelled is not None and cancelled():
            session.keep(executor.cancel())
            return StudyEnd.COMPLETE if not session.is_unfinished else StudyEnd.CANCELLED
    return StudyEnd.COMPLETE


class _Session:
    """One go at a study."""

    def __init__(self, points: Points, executor: Executor, store: Store) -> None:
        self._executor = executor
        self._store = store
        self._points = points
        is_done = states(store.arrays) != PointState.MISSING
        self._costs = Costs(points.grid, points.planned_s)
        for number in np.flatnonzero(is_done & np.isfinite(store.arrays[TAKEN].astype(float))):
            for _ in self._costs.learn(int(number), float(store.arrays[TAKEN][number])):
                pass
        self._scheduler = PointScheduler(points.after, is_done, self._costs)
        self._scheduler.release(points.wanted(store.arrays))
        self._failed = int(np.count_nonzero(is_failed(states(store.arrays))))
        self._out = 0
        self._looked_s = -math.inf
        self._work_left_s = 0.0
        self._first_s = math.nan
        self._taken_s = 0.0

    @property
    def is_unfinished(self) -> bool:
        """Whether points are missing."""
        return self._scheduler.left > 0

    def feed(self) -> None:
        """Hand bundles to the executor until every worker has enough."""
        self._look()
        slots = self._executor.slots
        while self._out < slots * QUEUED_PER_SLOT:
            worth_s = min(self._points.bundle_s, self._work_left_s / (slots * SHARE))
            numbers = self._scheduler.take(worth_s, MOST_IN_BUNDLE)
            if not numbers:
                return
            scenes = tuple(self._points.scene(number, self._store.arrays) for number in numbers)
            self._executor.submit(Bundle(numbers, scenes))
            self._out += 1

    def keep(self, replies: Sequence[Reply]) -> None:
        """Keep all answers in one commit, and note what they mean for the rest."""
        answers = [answer for reply in replies for answer in self._answers(reply)]
        if answers:
            self._store.keep(answers)
        for answer in answers:
            self._scheduler.finish(answer.number)
            self._failed += bool(is_failed(answer.state))
        for number, taken_s in [
            (each.number, each.taken_s) for each in answers if math.isfinite(each.taken_s)
        ]:
            self._scheduler.learn(number, taken_s)
            self._taken_s += taken_s
        if answers and not self.is_unfinished:
            self._scheduler.release(self._points.wanted(self._store.arrays))
        if answers and math.isnan(self._first_s):
            # Workers spend their first moments on starting: what comes after tells their pace.
            self._first_s, self._taken_s = time.monotonic(), 0.0

    def progress(self) -> Progress:
        """Where it stands."""
        released = self._scheduler.released
        note = f"{self._failed} failed" if self._failed else ""
        return Progress(released - self._scheduler.left, released, self._left_s(), note)

    def _left_s(self) -> float | None:
        """Time that the rest takes, at the pace of the workers since the first answer."""
        if not self.is_unfinished:
            return 0.0
        if self._taken_s == 0.0:
            return None
        return self._work_left_s * (time.monotonic() - self._first_s) / self._taken_s

    def _look(self) -> None:
        """Add up the work that is left, now and then: there may be millions of points."""
        now_s = time.monotonic()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            self._work_left_s = self._costs.left_s(self._scheduler.is_missing)

    def _answers(self, reply: Reply) -> Iterable[PointAnswer]:
        """Take a reply apart; what has no answer goes back to the agenda."""
        self._out -= 1
        numbers = reply.bundle.numbers
        for number, scene, solved in zip(numbers, reply.bundle.scenes, reply.solved, strict=False):
            yield self._points.answer(number, scene, solved, self._store.arrays)
        rest = numbers[len(reply.solved) :]
        match reply.error, rest:
            case None, _:
                for number in rest:
                    self._scheduler.put_back(number)
            case error, (number,) if len(numbers) == 1:
                yield self._points.failure(number, error)
            case _:
                for number in rest:
                    self._scheduler.put_back_alone(number)
