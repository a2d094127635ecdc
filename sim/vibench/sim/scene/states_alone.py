"""A motion followed by its states alone, until it repeats: leads, lasting chaos, other starts. SI units.

Who needs one yields it, and goes on when it has been followed: alone, or in lanes beside others.
"""

import math
from collections import defaultdict
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar, cast

import numpy as np

from ..engine.batch import batches_pay, is_batchable
from ..model.arrays import Floats
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from .followed_run import FollowedRun, Stretch, follow_strobed, follow_together, whole_periods
from .repetition import Growth, Pace, Repetition, growth_of, section_needed, wandered_until
from .scene import AutomaticDuration, FixedDuration

SLICE_S = 0.5
"""Time between two looks, at least."""
PARTS = 4
"""Of a stretch over which growth is seen: whether it goes on growing."""
REMEMBERED = 16.0
"""Forgetting times whose states are kept: from wandering to settled a motion needs ten, at standard."""


class StatesAlone:
    """A run without a tangent, looked at now and then."""

    def __init__(
        self,
        run: FollowedRun,
        pace: Pace,
        recent: Floats | None = None,
        slice_periods: int | None = None,
        every: int | None = None,
    ) -> None:
        run.drop_tangent()
        self.run = run
        self.path: list[Stretch] = []
        """What was seen of it, with ``every`` so manyth state; nothing unless that is asked for."""
        self.repeats: Repetition | None = None
        """Found; it is followed no further then."""
        self.recent = np.empty((0, 6)) if recent is None else recent
        """States once a drive period, up to now."""
        self._settled_s: float | None = None
        self._pace = pace
        self._every = every
        self._slice_periods = slice_periods or max(1, math.ceil(SLICE_S * pace.frequency_hz))
        self._kept = section_needed(pace.forgetting_periods) + math.ceil(REMEMBERED * pace.forgetting_periods)

    @property
    def is_over(self) -> bool:
        """It repeats, or was lost."""
        return self.repeats is not None or self.run.outcome is not Outcome.REACHED_END

    @property
    def wandered_until_s(self) -> float:
        """When it was last seen to change from period to period; now, if it does not repeat."""
        return self.run.time_s if self._settled_s is None else self._settled_s

    def follow(self, until_s: float, cost_s: float = math.inf) -> None:
        """Follow it until it repeats, an instant is reached, or its cost from its beginning is."""
        frequency_hz = self._pace.frequency_hz
        while not self.is_over and self.run.time_s < until_s and self.run.cost_s < cost_s:
            made = round(self.run.time_s * frequency_hz)
            # An end between two periods is reached, but nothing is looked for there.
            end_s = min((made + self._slice_periods) / frequency_hz, until_s)
            stretch = follow_strobed(self.run, end_s)
            self.repeats = self._noted(stretch)
            if self.repeats is not None:
                since = wandered_until(self.recent, 2.0 * math.pi * frequency_hz, self.repeats.period)
                self._settled_s = self.run.time_s - (len(self.recent) - since) / frequency_hz

    def note(self, stretch: Stretch) -> bool:
        """Keep the states of a stretch that lanes have followed; says whether the motion seems to repeat.

        `follow` finds that out: it goes on from here by itself.
        """
        return self._noted(stretch) is not None

    def _noted(self, stretch: Stretch) -> Repetition | None:
        """Keep the states of a stretch, and say whether the motion repeats."""
        if self._every is not None:
            self.path.append(stretch.thinned(self._every))
        self.recent = np.concatenate([self.recent, stretch.states])[-self._kept :]
        return self._pace.repeats_in(self.recent)

    def growth_over(self, length_s: float) -> Growth:
        """Follow it on, and see how a small change grows meanwhile; nothing, over no time."""
        self.run.follow_tangent()
        begin_s = self.run.time_s
        ends_s = [begin_s + length_s * (part + 1) / PARTS for part in range(PARTS)] if length_s > 0.0 else []
        stretches = [follow_strobed(self.run, end_s) for end_s in ends_s]
        self.run.drop_tangent()
        return growth_of(stretches)


ROUND_S, ROUND_PERIODS = 2.0, 1 << 16
"""Time between two looks at motions in lanes, and drive periods at most: their states are held meanwhile."""
HELD_STATES, FULL = 1 << 20, 16
"""States of all motions in lanes together, at most, and motions at least: more fill lanes no better."""
TRIES = 8
"""Drive periods that a motion is followed by itself until one ends in flight: lanes begin there."""


@dataclass(frozen=True, eq=False)
class Following:
    """A motion to be followed, and how far."""

    alone: StatesAlone
    until_s: float
    cost_s: float
    """From its beginning; see `StatesAlone.follow`."""

    def by_itself(self) -> None:
        """Follow it, and nothing beside it."""
        self.alone.follow(self.until_s, self.cost_s)

    @property
    def periods(self) -> int:
        """Whole drive periods of the next round in lanes; none between two periods, or within a contact."""
        run = self.alone.run
        if self.alone.is_over or run.periods is None or not run.is_in_flight or not run.cost_s < self.cost_s:
            return 0
        frequency_hz = run.drive.frequency_hz
        left = whole_periods(self.until_s, frequency_hz) - run.periods
        return min(left, math.ceil(ROUND_S * frequency_hz), ROUND_PERIODS)

    def to_flight(self) -> None:
        """Follow a motion that is in contact now until a drive period ends in flight, if one does soon."""
        run = self.alone.run
        for _ in range(TRIES):
            if run.is_in_flight or run.periods is None:
                return
            self.alone.follow(min((run.periods + 1) / run.drive.frequency_hz, self.until_s), self.cost_s)


Answer = TypeVar("Answer")
Asking = Generator[Sequence[Following], None, Answer]
"""What asks for motions to be followed, and goes on when they have been."""


def alone(asking: Asking[Answer]) -> Answer:
    """Bring what asks to its end by itself, one motion after the other."""
    try:
        while True:
            for each in next(asking):
                each.by_itself()
    except StopIteration as end:
        return cast("Answer", end.value)


WORTH_A_FIT_S = 3000.0
"""Motion of one specimen that is worth fitting its collisions, which takes a second [s]."""
AUTOMATIC_S = 10.0
"""What an automatic duration counts for there [s]."""


def lanes_are_worth_it(motions: int, duration: FixedDuration | AutomaticDuration) -> bool:
    """Whether so many motions of one specimen are followed in less time in lanes than one after the other.

    It hangs on what is asked for and on the processor, and not on what runs took lately: who asks twice has
    the same answer twice.
    """
    each_s = duration.duration_s if isinstance(duration, FixedDuration) else AUTOMATIC_S
    return motions * each_s >= WORTH_A_FIT_S and batches_pay()


def in_lanes(asking: Asking[Answer]) -> Answer:
    """Bring what asks to its end, its motions side by side as far as lanes serve."""
    try:
        while True:
            follow_all(next(asking))
    except StopIteration as end:
        return cast("Answer", end.value)


def follow_all(several: Sequence[Following]) -> None:
    """Follow motions as far as is asked: in lanes where these serve, else one by one.

    Each comes to the same states whatever is followed beside it. Lanes follow states and nothing else:
    whether a motion repeats is found, and its last state reached, as it is without them.
    """
    alike = defaultdict[tuple[Specimen, float], list[Following]](list)
    for each in several:
        run = each.alone.run
        if is_batchable(run.specimen, run.tolerance):
            alike[run.specimen, run.tolerance].append(each)
    for group in alike.values():
        _follow_rounds(group)
    for each in several:
        each.by_itself()


def _follow_rounds(group: Sequence[Following]) -> None:
    under_way = list(group)
    while under_way:
        for each in under_way:
            each.to_flight()
        ready = [(each, each.periods) for each in under_way if each.periods > 0]
        longest = max((periods for _, periods in ready), default=1)
        size = max(FULL, HELD_STATES // longest)
        under_way = [
            each for first in range(0, len(ready), size) for each in _round(ready[first : first + size])
        ]


def _round(ready: Sequence[tuple[Following, int]]) -> list[Following]:
    """Follow motions in lanes, each for so many drive periods; gives those that are to be followed on."""
    found = follow_together([each.alone.run for each, _ in ready], [periods for _, periods in ready])
    # One that a lane has lost is where it was, and followed by itself.
    return [
        each
        for (each, _), stretch in zip(ready, found, strict=True)
        if stretch is not None and not each.alone.note(stretch)
    ]
