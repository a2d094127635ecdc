"""Where a run comes to rest in its final kind of motion, and whether it was chaotic before. SI units.

A run can strike its stops thousands of times and then leave them for good: chaos that was a transient
(Grebogi, Ott and Yorke, Physica D 7 (1983) 181). An exponent averaged over such a run belongs to no state
at all.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..model.arrays import Floats
from ..motion.poincare import smallest_period
from .blocking import blocked_mean
from .tangent_run import TangentRun

SAME_STATE, NEARLY_SAME = 1e-6, 1e-3
"""A section repeats when it changes by less than the first, over the state's scale, from cycle to cycle; it
has done so since it last changed by more than the second."""
LONGEST_CYCLE = 16
"""Intervals in a cycle that is looked for."""
SURE = 3.0
"""Standard errors that a number must be away from zero to have a sign."""
CHANGED = 5.0
"""Standard errors between the means before and after a change: the best of many places is looked for."""
FEWEST_INTERVALS = 32
"""Intervals on each side of a change of the exponent's sign."""
ALIGNING = 8
"""Intervals in which a small change of the state turns towards its direction of growth."""


class FinalMotion(StrEnum):
    """What a run ends in."""

    QUIET = "no impact will follow: the linear motion"
    PERIODIC = "a periodic motion"
    SETTLED = "a motion of another kind than before"
    THROUGHOUT = "the motion of the whole run"


@dataclass(frozen=True)
class Settling:
    """Since when a run was in its final kind of motion."""

    motion: FinalMotion
    since: int
    """Intervals before it."""
    cycle: int = 0
    """Intervals of a periodic motion's cycle."""


def settling(run: TangentRun, scales: Floats) -> Settling:
    """Find the final motion of a run and its beginning; ``scales`` measure a state, shape (6,)."""
    if run.is_quiet:
        struck = np.flatnonzero(run.impacts)
        return Settling(FinalMotion.QUIET, int(struck[-1]) + 1 if len(struck) else 0)
    cycle = (
        smallest_period(run.section, scales, SAME_STATE, LONGEST_CYCLE) if run.interval.periods > 0 else None
    )
    if cycle is not None:
        points = run.section / scales
        moved = np.abs(points[cycle:] - points[:-cycle]).max(axis=1)
        changing = np.flatnonzero(~(moved < NEARLY_SAME))
        return Settling(FinalMotion.PERIODIC, int(changing[-1]) + 1 if len(changing) else 0, cycle)
    change = _change_of_sign(run.growth[:, 0])
    if change is not None:
        return Settling(FinalMotion.SETTLED, change)
    return Settling(FinalMotion.THROUGHOUT, 0)


def _change_of_sign(growth: Floats) -> int | None:
    """Find where the mean growth falls from surely positive to not positive."""
    count = len(growth)
    if count < 2 * FEWEST_INTERVALS or not bool(np.all(np.isfinite(growth))):
        return None
    places = np.arange(FEWEST_INTERVALS, count - FEWEST_INTERVALS + 1)
    sums = np.cumsum(growth)
    before, after = sums[places - 1] / places, (sums[-1] - sums[places - 1]) / (count - places)
    # The split that leaves the least scatter about the two means.
    place = int(places[np.argmax((before - after) * np.sqrt(places * (count - places)))])
    head, tail = blocked_mean(growth[:place]), blocked_mean(growth[place:])
    is_falling = head.mean > SURE * head.standard_error and tail.mean <= SURE * tail.standard_error
    apart = CHANGED * math.hypot(head.standard_error, tail.standard_error)
    return place if is_falling and head.mean - tail.mean > apart else None
