"""Solve the points of a study from a queue, on any executor; store results as they arrive."""

import heapq
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..background import Cancelled, Observer, Progress
from ..engine.run import Outcome
from ..scene.cost import expected_cost_s
from ..scene.prediction import ScenePrediction, state_of
from ..scene.scene import Given, Scene
from ..scene.solve import InBatches, SolvedScene, Solver
from ..specimen.specimen import Floats
from ._executor import Bundle, Executor, Reply
from ._grid import (
    CONTINUES,
    FINAL_STATE,
    IDENTITY,
    MESSAGE,
    PHASE,
    TAKEN,
    Cell,
    Grid,
    GridPlan,
    PointState,
)
from ._store import Arrays, PointAnswer, Store, cells_of, cut_text, is_failed, states
from ._study import Start, scene_identity

# If a point continues another point, it is ready when that other point is done. Of all ready points, the
# point with the longest estimated computing time is started first. This time is estimated from the plan, and
# from neighbouring points as soon as these are done.

SHORTEST_S = 1e-6
"""Shortest assumed computing time of a point [s]; avoids division by zero."""


class Costs:
    """Estimated computing times of points; the estimates improve as neighbouring points are done.

    A run takes about 4 us per impact, and neighbouring points have similar numbers of impacts. The time of a
    neighbour is therefore a better estimate than the plan.
    """

    def __init__(self, grid: Grid, planned_s: Floats) -> None:
        self._grid = grid
        self._planned_s = np.maximum(planned_s, SHORTEST_S)
        self._taken_s = np.full(grid.size, np.nan)
        self._estimate_s = self._planned_s.copy()
        self._is_informed = np.zeros(grid.size, dtype=np.bool_)

    def estimate_s(self, number: int) -> float:
        """Return the expected computing time of a point on one worker [s]."""
        return float(self._estimate_s[number])

    def learn(self, number: int, taken_s: float) -> Iterator[int]:
        """Record the computing time of a point; yield the neighbours whose estimates change."""
        self._taken_s[number] = max(taken_s, SHORTEST_S)
        for each in self._grid.neighbours(number):
            if np.isnan(self._taken_s[each]):
                known = [self._taken_s[other] for other in self._grid.neighbours(each)]
                self._estimate_s[each] = np.nanmean(known)
                self._is_informed[each] = True
                yield each

    def remaining_s(self, is_missing: NDArray[np.bool_]) -> float:
        """Return the total computing time of the points marked in ``is_missing`` (shape (points,)) [s].

        Without a finished neighbour, the planned time is scaled by the ratio of actual to planned times.
        """
        known = ~np.isnan(self._taken_s)
        off = self._taken_s[known].sum() / self._planned_s[known].sum() if known.any() else 1.0
        informed = is_missing & self._is_informed
        planned = is_missing & ~self._is_informed
        return float(self._estimate_s[informed].sum() + off * self._planned_s[planned].sum())


NOBODY = -1
"""Predecessor of a point that continues no other point."""


class PointScheduler:
    """Points still to be computed, in the order in which they are started.

    The point with the longest computing time is started first, which keeps all workers busy to the end. A
    point's time includes all points that continue it. A point that is not put back is taken only once.
    """

    def __init__(self, after: NDArray[np.int64], is_done: NDArray[np.bool_], costs: Costs) -> None:
        self._after = after
        self._costs = costs
        self._is_done = is_done.copy()
        self._is_released = np.zeros(len(after), dtype=np.bool_)
        self.left = 0
        """Number of released points that have no result yet."""
        self._is_out = np.zeros(len(after), dtype=np.bool_)
        self._is_alone = np.zeros(len(after), dtype=np.bool_)
        self._next = np.full(len(after), NOBODY, dtype=np.int64)
        chained = np.flatnonzero(after != NOBODY)
        self._next[after[chained]] = chained
        self._behind_s = self._times_behind()
        self._queue: list[tuple[float, int]] = []

    def release(self, numbers: NDArray[np.int64]) -> None:
        """Release points for computation, except points that already have a result."""
        new = numbers[~self._is_released[numbers]]
        self._is_released[new] = True
        self.left += int(np.count_nonzero(~self._is_done[new]))
        for number in new:
            if self._is_ready(int(number)):
                self._push(int(number))

    @property
    def released_points(self) -> int:
        """Number of released points, including those with a result."""
        return int(np.count_nonzero(self._is_released))

    @property
    def is_missing(self) -> NDArray[np.bool_]:
        """Whether each point is released and has no result yet, shape (points,); it may be running."""
        return self._is_released & ~self._is_done

    def take(self, worth_s: float, most: int) -> tuple[int, ...]:
        """Take the ready point with the longest time, and more points up to ``worth_s`` [s] or ``most``."""
        taken: list[int] = []
        sum_s = 0.0
        while len(taken) < most and sum_s < worth_s:
            number = self._pop()
            if number is None:
                break
            if taken and self._is_alone[number]:
                self._push(number)
                break
            self._is_out[number] = True
            taken.append(number)
            sum_s += self._costs.estimate_s(number)
            if self._is_alone[number]:
                break
        return tuple(taken)

    def learn(self, number: int, taken_s: float) -> None:
        """Record the computing time of a point, which improves the estimates of its neighbours."""
        for changed in self._costs.learn(number, taken_s):
            if self._is_ready(changed):
                self._push(changed)

    def finish(self, number: int) -> None:
        """Mark a point as done, so that the next point, which continues this point, may start."""
        self._is_done[number] = True
        self.left -= 1
        self._is_out[number] = False
        follower = int(self._next[number])
        if follower != NOBODY and self._is_ready(follower):
            self._push(follower)

    def put_back(self, number: int) -> None:
        """Return a point to the queue from which it was taken."""
        self._is_out[number] = False
        self._push(number)

    def put_back_alone(self, number: int) -> None:
        """Put a point of a failed bundle back into the queue, to be computed in a separate bundle."""
        self._is_alone[number] = True
        self.put_back(number)

    def _is_ready(self, number: int) -> bool:
        before = int(self._after[number])
        is_free = before == NOBODY or bool(self._is_done[before])
        return bool(
            is_free and self._is_released[number] and not self._is_done[number] and not self._is_out[number]
        )

    def _weight(self, number: int) -> float:
        return self._costs.estimate_s(number) + float(self._behind_s[number])

    def _push(self, number: int) -> None:
        heapq.heappush(self._queue, (-self._weight(number), number))

    def _pop(self) -> int | None:
        """Return the ready point with the longest time; drop entries of done points and outdated entries."""
        while self._queue:
            weight, number = heapq.heappop(self._queue)
            if self._is_ready(number) and -weight == self._weight(number):
                return number
        return None

    def _times_behind(self) -> NDArray[np.float64]:
        """Return for each point the planned time of all points that must wait for it, shape (points,) [s]."""
        behind = np.zeros(len(self._after))
        for last in np.flatnonzero(self._next == NOBODY):
            number, sum_s = int(last), 0.0
            while self._after[number] != NOBODY:
                if not self._is_done[number]:
                    sum_s += self._costs.estimate_s(number)
                number = int(self._after[number])
                behind[number] = sum_s
        return behind


MOST_IN_BUNDLE = 64
"""Largest number of points in a bundle; limits how many results are lost with a worker."""
SHARE, BATCHED_SHARE = 8, 2
"""Ratio of the remaining work per worker to the largest bundle. Larger bundles fill SIMD registers better."""
QUEUED_PER_SLOT = 2
"""Number of bundles per worker: one runs and one waits, so that no worker is idle."""
LOOK_S = 0.2
"""Time between two checks for cancellation [s]."""


class StudyEnd(StrEnum):
    """Reason why a session of a study ended."""

    COMPLETE = "complete"
    CANCELLED = "cancelled"


PLANNED = 2000
"""Largest number of points whose computing time is planned one by one; in a larger grid, one point stands for
several neighbours."""


class Points:
    """Points of a plan: their scenes, created on demand, and the selection of the points to compute.

    ``bundle_s`` is the largest planned computing time of a bundle [s].
    """

    def __init__(self, plan: GridPlan, starts: Sequence[object], solver: Solver, bundle_s: float) -> None:
        self.bundle_s = bundle_s
        self._plan, self.grid, self._starts, self._solver = plan, plan.grid, starts, solver
        self._kept = {column.name for column in plan.columns}
        self.share = BATCHED_SHARE if isinstance(solver, InBatches) else SHARE

    @cached_property
    def after(self) -> NDArray[np.int64]:
        """Number of the point that each point continues, or `NOBODY`, shape (points,)."""
        blocks = np.full(self.grid.shape, NOBODY)
        numbers = np.arange(self.grid.size).reshape(self.grid.shape)
        for index, start in enumerate(self._starts):
            match start:
                case Start.UP:
                    blocks[..., index, 1:] = numbers[..., index, :-1]
                case Start.DOWN:
                    blocks[..., index, :-1] = numbers[..., index, 1:]
                case _:
                    pass
        return blocks.reshape(-1)

    @cached_property
    def planned_s(self) -> Floats:
        """Planned computing time of each point, shape (points,) [s]."""
        return self.times_s()

    def times_s(self, *, may_repeat: bool = True) -> Floats:
        """Return the expected computing time of each point, shape (points,) [s]; 0 for a forbidden scene."""

        def time_s(number: int) -> float:
            try:
                return expected_cost_s(self.new_scene(number), self._solver, may_repeat=may_repeat)
            except ValueError:
                return 0.0

        every = max(1, math.ceil(self.grid.size / PLANNED))
        some = [time_s(number) for number in range(0, self.grid.size, every)]
        return np.repeat(some, every)[: self.grid.size]

    def predecessor(self, number: int, arrays: Arrays) -> int:
        """Return the point to continue; `NOBODY` if there is no such point, or the point's state is NaN."""
        before = int(self.after[number])
        if before == NOBODY or not np.all(np.isfinite(arrays[FINAL_STATE][before].astype(np.float64))):
            return NOBODY
        return before

    def scene(self, number: int, arrays: Arrays) -> Scene:
        """Return the scene of a point; the point that it continues, if any, must be done.

        If that point has no finite final state, the scene has the plan's start instead. Raises ValueError
        when a scene with these values is not allowed.
        """
        before, place = self.predecessor(number, arrays), self.grid.place(number)
        if before == NOBODY:
            return self._plan.first_scene(place)
        state = state_of(arrays[FINAL_STATE][before].astype(np.float64))
        start = Given(state, self._plan.label_after(place, self.grid.place(before)))
        return self._plan.scene(place, start, self._plan.phase_after(before, arrays))

    def new_scene(self, number: int) -> Scene:
        """Return the scene of a point that continues no other point."""
        return self._plan.first_scene(self.grid.place(number))

    def answer(self, number: int, scene: Scene, solved: SolvedScene, arrays: Arrays) -> PointAnswer:
        """Return the result to store for the solution of a point."""
        found, before = solved.prediction, self.predecessor(number, arrays)
        cells: dict[str, Cell] = {
            **cells_of(found),
            CONTINUES: before,
            PHASE: scene.drive.phase_rad,
            TAKEN: solved.taken_s,
            **self.own_cells(scene, found),
        }
        if IDENTITY in self._kept:
            known = "" if before == NOBODY else bytes(arrays[IDENTITY][before]).decode()
            cells[IDENTITY] = scene_identity(scene, known).encode()
        state = PointState.DONE if found.outcome is Outcome.REACHED_END else PointState.STOPPED
        kept = {name: cell for name, cell in cells.items() if name in self._kept}
        return PointAnswer(number, state, kept, solved.taken_s)

    def failure(self, number: int, error: BaseException) -> PointAnswer:
        """Return the result to store for a scene that raised an error."""
        message = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        return PointAnswer(number, PointState.FAILED, {MESSAGE: cut_text(message)})

    def next_points(self, arrays: Arrays) -> NDArray[np.int64]:  # noqa: ARG002 - the same for all results
        """Return the points to compute next, given the results so far; called when these are complete."""
        return np.arange(self.grid.size)

    def own_cells(self, scene: Scene, found: ScenePrediction) -> dict[str, Cell]:  # noqa: ARG002
        """Return the values to store that only this kind of plan has, for the solution of a point."""
        return {}


def run_points(
    points: Points,
    executor: Executor,
    store: Store,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> StudyEnd:
    """Compute the requested points that are not in the store, until ``cancelled``, as `run_study` does."""
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
    """One session of a study: its first run, or a resumption."""

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
        self._scheduler.release(points.next_points(store.arrays))
        self._failed = int(np.count_nonzero(is_failed(states(store.arrays))))
        self._out = 0
        self._looked_s = -math.inf
        self._work_left_s = 0.0
        self._first_s = math.nan
        self._taken_s = 0.0

    @property
    def is_unfinished(self) -> bool:
        """Whether any point to be computed has no result yet."""
        return self._scheduler.left > 0

    def feed(self) -> None:
        """Send bundles to the executor until each worker has `QUEUED_PER_SLOT` bundles."""
        now_s = time.monotonic()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            self._work_left_s = self._costs.remaining_s(self._scheduler.is_missing)
        slots = self._executor.slots
        while self._out < slots * QUEUED_PER_SLOT:
            worth_s = min(self._points.bundle_s, self._work_left_s / (slots * self._points.share))
            numbers = self._scheduler.take(worth_s, MOST_IN_BUNDLE)
            if not numbers:
                return
            scenes = tuple(self._points.scene(number, self._store.arrays) for number in numbers)
            self._executor.submit(Bundle(numbers, scenes))
            self._out += 1

    def keep(self, replies: Sequence[Reply]) -> None:
        """Store all results of the replies at once, and update the remaining work."""
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
            self._scheduler.release(self._points.next_points(self._store.arrays))
        if answers and math.isnan(self._first_s):
            # Workers need time to start, so measure their speed only after the first results.
            self._first_s, self._taken_s = time.monotonic(), 0.0

    def progress(self) -> Progress:
        """Return the number of done points and of all points, the remaining time, and the failures."""
        released = self._scheduler.released_points
        note = f"{self._failed} failed" if self._failed else ""
        return Progress(released - self._scheduler.left, released, self._remaining_s(), note)

    def _remaining_s(self) -> float | None:
        """Return the remaining time of the session [s], from the workers' speed so far; None if unknown."""
        if not self.is_unfinished:
            return 0.0
        if self._taken_s == 0.0:
            return None
        return self._work_left_s * (time.monotonic() - self._first_s) / self._taken_s

    def _answers(self, reply: Reply) -> Iterable[PointAnswer]:
        """Yield the results in a reply; put points without a result back into the queue."""
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
