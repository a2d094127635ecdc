"""Motions integrated without a tangent vector until they repeat: transients, lasting chaos, other starts.

A motion is integrated alone (`StatesAlone.follow`), or with others in SIMD batches of the native engine
(`in_batches`). The states of a motion do not depend on the other motions in a batch. SI units.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from ..engine.batch import batches_pay, is_batchable
from ..engine.run import Outcome
from ..specimen.specimen import Floats, Specimen
from .followed_run import (
    FollowedRun,
    Stretch,
    follow_together,
    follow_with_section,
    samples_between,
    whole_periods,
)
from .repetition import Growth, Pace, Repetition, first_repetition, growth_of, longest_section
from .scene import AutomaticDuration, FixedDuration

SLICE_S = 0.5
"""Shortest time between two checks for repetition [s]."""
PARTS = 4
"""Number of parts of a stretch in which growth is measured, to see if a perturbation keeps growing."""
REMEMBERED = 16.0
"""Time for which states are stored, in decay times of the slowest mode; settling at *standard* takes ten."""


class StatesAlone:
    """A run without a tangent vector, regularly checked for repetition.

    Parameters
    ----------
    run, pace
        The motion, with its time scales and tolerances.
    recent
        Previous states once per drive period, shape (n, 6).
    slice_periods
        Drive periods between two checks.
    every
        Every n-th state is stored in `path`; None for no states.
    by_itself_s
        Time [s] before which the motion may not join a batch, because errors made in a transient persist.
        This time is a whole number of drive periods, because batches begin at the end of a period.
    """

    def __init__(
        self,
        run: FollowedRun,
        pace: Pace,
        recent: Floats | None = None,
        slice_periods: int | None = None,
        every: int | None = None,
        by_itself_s: float = 0.0,
    ) -> None:
        run.drop_tangent()
        self.run = run
        self.until_s = self.cost_s = math.inf
        self.by_itself_s = by_itself_s
        self.path: list[Stretch] = []
        """Stretches of the run so far, with every n-th state."""
        self.repeats: Repetition | None = None
        """Repetition of the motion; the run ends once a repetition is found."""
        self.recent = np.empty((0, 6)) if recent is None else recent
        """Latest states of the run, once per drive period, shape (n, 6)."""
        self._settled_s: float | None = None
        self._pace = pace
        self._every = every
        self._slice_periods = slice_periods or max(1, math.ceil(SLICE_S * pace.frequency_hz))
        self._kept = longest_section(pace.forgetting_periods) + math.ceil(
            REMEMBERED * pace.forgetting_periods
        )

    @property
    def is_over(self) -> bool:
        """Whether the motion repeats or its integration failed."""
        return self.repeats is not None or self.run.outcome is not Outcome.REACHED_END

    @property
    def wandered_until_s(self) -> float:
        """Last time at which two successive periods differed [s]; the current time before any repetition."""
        return self.run.time_s if self._settled_s is None else self._settled_s

    def aim(self, until_s: float, cost_s: float = math.inf) -> Self:
        """Set the time and the nominal computing cost [s], from the run's start, at which the run ends."""
        self.until_s, self.cost_s = until_s, cost_s
        return self

    def follow(self, at_most_s: float = math.inf) -> None:
        """Integrate until the motion repeats or the run ends, at the latest until ``at_most_s`` [s]."""
        run, frequency_hz, until_s = self.run, self._pace.frequency_hz, min(self.until_s, at_most_s)
        while not self.is_over and run.time_s < until_s and run.cost_s < self.cost_s:
            made = round(run.time_s * frequency_hz)
            goal_s = min(until_s, self.by_itself_s) if run.time_s < self.by_itself_s else until_s
            # If the last part of the run is shorter than a period, this part is not checked for repetition.
            end_s = min((made + self._slice_periods) / frequency_hz, goal_s)
            stretch = run.follow(end_s, samples=samples_between(frequency_hz, run.time_s, end_s))
            self.repeats = self.note(stretch)
            if self.repeats is not None:
                since = first_repetition(self.recent, 2.0 * math.pi * frequency_hz, self.repeats.period)
                self._settled_s = run.time_s - (len(self.recent) - since) / frequency_hz

    @property
    def batch_periods(self) -> int:
        """Number of drive periods that a batch may integrate next; 0 within a period or at the end."""
        run = self.run
        if self.is_over or run.periods is None or not run.cost_s < self.cost_s:
            return 0
        frequency_hz = run.drive.frequency_hz
        left = whole_periods(self.until_s, frequency_hz) - run.periods
        return min(left, math.ceil(ROUND_S * frequency_hz), ROUND_PERIODS)

    def note(self, stretch: Stretch) -> Repetition | None:
        """Store the states of a stretch; return the repetition of the motion, or None."""
        if self._every is not None:
            self.path.append(stretch.every_nth(self._every))
        self.recent = np.concatenate([self.recent, stretch.states])[-self._kept :]
        return self._pace.repeats_in(self.recent)

    def growth_over(self, length_s: float) -> Growth:
        """Integrate for ``length_s``; return the growth of a tangent vector (empty for zero length)."""
        self.run.follow_tangent()
        begin_s = self.run.time_s
        ends_s = [begin_s + length_s * (part + 1) / PARTS for part in range(PARTS)] if length_s > 0.0 else []
        stretches = [follow_with_section(self.run, end_s) for end_s in ends_s]
        self.run.drop_tangent()
        return growth_of(stretches)


Follow = Callable[[Sequence[StatesAlone]], None]
"""Function that integrates runs to their ends: `one_by_one` or `in_batches`."""


def one_by_one(several: Sequence[StatesAlone]) -> None:
    """Integrate the motions one after the other, without batches."""
    for each in several:
        each.follow()


WORTH_A_FIT_S = 3000.0
"""Simulated time of a specimen above which batches save more time than their collision fit takes [s]."""
AUTOMATIC_S = 10.0
"""Assumed length of a run with an automatic duration, to compare batches with single runs [s]."""


def batches_are_worth_it(motions: int, duration: FixedDuration | AutomaticDuration) -> bool:
    """Return whether batches are faster for this number of motions of one specimen.

    The decision depends on request and processor, not on measured times, so results are reproducible.
    """
    each_s = duration.duration_s if isinstance(duration, FixedDuration) else AUTOMATIC_S
    return motions * each_s >= WORTH_A_FIT_S and batches_pay()


ROUND_S, ROUND_PERIODS = 4.0, 1 << 16
"""Largest time [s] and number of drive periods between two checks of a batch, to limit memory."""
HELD_STATES, FULL = 1 << 20, 16
"""Largest number of states stored for a batch, and number of motions that fill the SIMD registers."""


def in_batches(several: Sequence[StatesAlone]) -> None:
    """Integrate motions in SIMD batches if the specimen allows it, otherwise one by one.

    A batch only computes states. Repetition is detected in the same way as without batches.
    """
    alike = defaultdict[tuple[Specimen, float], list[StatesAlone]](list)
    for each in several:
        if is_batchable(each.run.specimen, each.run.tolerance):
            each.follow(each.by_itself_s)
            alike[each.run.specimen, each.run.tolerance].append(each)
    for group in alike.values():
        _follow_rounds(group)
    one_by_one(several)


def _follow_rounds(group: Sequence[StatesAlone]) -> None:
    under_way = list(group)
    while under_way:
        ready = [(each, periods) for each in under_way if (periods := each.batch_periods) > 0]
        longest = max((periods for _, periods in ready), default=1)
        size = max(FULL, HELD_STATES // longest)
        under_way = []
        for first in range(0, len(ready), size):
            part = ready[first : first + size]
            found = follow_together([each.run for each, _ in part], [periods for _, periods in part])
            under_way += [
                each for (each, _), seen in zip(part, found, strict=True) if each.note(seen) is None
            ]
