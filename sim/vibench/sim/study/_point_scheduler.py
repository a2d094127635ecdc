"""Which points of a study may be computed now: those whose predecessor is done, longest first.

How long each point of a study will take: first as planned, then as its neighbours took.
"""

import heapq
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..model.arrays import Floats
from ..model.frozen_model import FrozenModel
from ._axes import Grid, StudyAxis, grid_of
from ._columns import Column

SHORTEST_S = 1e-6
"""No point is thought to take less: it keeps ratios finite."""


class Costs:
    """Estimates that get better as points are done.

    A run costs about 4 us an impact, and neighbours strike about as often: once a neighbour's time is
    known, it says more than any plan.
    """

    def __init__(self, grid: Grid, planned_s: Floats) -> None:
        self._grid = grid
        self._planned_s = np.maximum(planned_s, SHORTEST_S)
        self._taken_s = np.full(grid.size, np.nan)
        self._estimate_s = self._planned_s.copy()
        self._is_informed = np.zeros(grid.size, dtype=np.bool_)

    def estimate_s(self, number: int) -> float:
        """Time that a point is expected to take on one worker."""
        return float(self._estimate_s[number])

    def learn(self, number: int, taken_s: float) -> Iterator[int]:
        """Note what a point took; the neighbours whose estimates change come back."""
        self._taken_s[number] = max(taken_s, SHORTEST_S)
        for each in self._grid.neighbours(number):
            if np.isnan(self._taken_s[each]):
                known = [self._taken_s[other] for other in self._grid.neighbours(each)]
                self._estimate_s[each] = np.nanmean(known)
                self._is_informed[each] = True
                yield each

    def left_s(self, is_missing: NDArray[np.bool_]) -> float:
        """Worker time of the points that are missing, shape (points,).

        Plans that no neighbour has corrected are scaled by how far plans have been off so far.
        """
        known = ~np.isnan(self._taken_s)
        off = self._taken_s[known].sum() / self._planned_s[known].sum() if known.any() else 1.0
        informed = is_missing & self._is_informed
        planned = is_missing & ~self._is_informed
        return float(self._estimate_s[informed].sum() + off * self._planned_s[planned].sum())


NOBODY = -1
"""Predecessor of a point that depends on none."""


class PointScheduler:
    """The work that is left, in the order in which it should begin.

    Starting the longest first keeps all workers busy to the end; a point counts with the planned time of
    all that wait for it in its chain. Points are handed out once, until they are put back.
    """

    def __init__(self, after: NDArray[np.int64], is_done: NDArray[np.bool_], costs: Costs) -> None:
        self._after = after
        self._costs = costs
        self._is_done = is_done.copy()
        self._is_released = np.zeros(len(after), dtype=np.bool_)
        self._left = 0
        self._is_out = np.zeros(len(after), dtype=np.bool_)
        self._is_alone = np.zeros(len(after), dtype=np.bool_)
        self._next = np.full(len(after), NOBODY, dtype=np.int64)
        chained = np.flatnonzero(after != NOBODY)
        self._next[after[chained]] = chained
        self._behind_s = self._times_behind()
        self._queue: list[tuple[float, int]] = []

    def release(self, numbers: NDArray[np.int64]) -> None:
        """Let these points be computed, those that have an answer excepted."""
        new = numbers[~self._is_released[numbers]]
        self._is_released[new] = True
        self._left += int(np.count_nonzero(~self._is_done[new]))
        for number in new:
            if self._is_ready(int(number)):
                self._push(int(number))

    @property
    def released(self) -> int:
        """How many points were let be computed, those with an answer too."""
        return int(np.count_nonzero(self._is_released))

    @property
    def is_missing(self) -> NDArray[np.bool_]:
        """Released points without an answer, shape (points,); those under way too."""
        return self._is_released & ~self._is_done

    @property
    def left(self) -> int:
        """How many released points have no answer."""
        return self._left

    def take(self, worth_s: float, most: int) -> tuple[int, ...]:
        """Hand out the longest point that is ready, and short ones with it until they are ``worth_s``."""
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
        """Note what a point took: its neighbours' times are known better."""
        for changed in self._costs.learn(number, taken_s):
            if self._is_ready(changed):
                self._push(changed)

    def finish(self, number: int) -> None:
        """Take note of an answer, good or bad: who waited for it may begin."""
        self._is_done[number] = True
        self._left -= 1
        self._is_out[number] = False
        follower = int(self._next[number])
        if follower != NOBODY and self._is_ready(follower):
            self._push(follower)

    def put_back(self, number: int) -> None:
        """Let a point that was handed out be handed out again."""
        self._is_out[number] = False
        self._push(number)

    def put_back_alone(self, number: int) -> None:
        """Put back one that came to grief among others, to see whether it does so by itself."""
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
        """Longest point that is ready; entries overtaken by an answer or a better estimate are dropped."""
        while self._queue:
            weight, number = heapq.heappop(self._queue)
            if self._is_ready(number) and -weight == self._weight(number):
                return number
        return None

    def _times_behind(self) -> NDArray[np.float64]:
        """Planned time of everything that waits for a point, directly or through others, shape (points,)."""
        behind = np.zeros(len(self._after))
        for last in np.flatnonzero(self._next == NOBODY):
            number, sum_s = int(last), 0.0
            while self._after[number] != NOBODY:
                if not self._is_done[number]:
                    sum_s += self._costs.estimate_s(number)
                number = int(self._after[number])
                behind[number] = sum_s
        return behind


class GridPlan(FrozenModel, ABC):
    """What is to be computed, completely: two equal plans have equal answers."""

    called: ClassVar[str]
    """How messages call such a plan."""
    format: ClassVar[str]
    """How its files call themselves."""

    @property
    @abstractmethod
    def axes(self) -> tuple[StudyAxis, ...]:
        """Dimensions of the results, in order."""

    @property
    @abstractmethod
    def columns(self) -> tuple[Column, ...]:
        """What is kept of each point."""

    @property
    def grid(self) -> Grid:
        """All points."""
        return grid_of(self.axes)

    def differences(self, other: Self) -> tuple[str, ...]:
        """Names of what differs between two plans."""
        mine, theirs = self.model_dump(mode="json"), other.model_dump(mode="json")
        return tuple(name for name in mine if mine[name] != theirs[name])
