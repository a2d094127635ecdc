"""Classify a motion from its states once per drive period and the growth of a small change.

The states alone show whether it repeats. A motion that does not repeat is chaotic if a small change keeps
growing, quasi-periodic if it neither grows nor decays (Lichtenberg and Lieberman, Regular and Chaotic
Dynamics (1992), section 5.3; growth is counted in natural logarithms).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..specimen.accuracy import Accuracy
from ..specimen.contact_law import ContactLaw
from ..specimen.power_law import PowerLaw
from ..specimen.specimen import Specimen
from ..specimen.state import Floats
from .followed_run import Stretch, states_of
from .prediction import MotionKind

MOST_PERIODS = 32
"""Longest period to search, in drive periods."""
FEWEST_BETWEEN = 8
"""Fewest drive periods between compared states."""
SLOWEST_RATIO = 0.99
"""Largest assumed ratio of a change to the previous one, for the slowest settling."""
NEARLY = 0.01
"""Largest relative change of a settling motion from one of its periods to the next."""
TINY = 1e-300
"""Size used for a motion at rest."""
DISTINCT = 20.0
"""Difference, in tolerances, between a motion of several periods and one of fewer; with a smaller difference
it may still be settling."""
CERTAIN_GROWTH = 12.0
"""Growth of a small change by e^12 = 160 000: more than shear of regular motions causes."""
NEUTRAL = 0.1
"""Growth per forgetting time that counts as zero; the specimen's damping alone gives -1."""
DRIFT_PARTS = 6
"""Number of consecutive parts over which the changes of a drift grow or shrink: by chance in 2 cases of
720."""
FEWEST_NEUTRAL = 8.0
"""Forgetting times without growth or decay that make a motion quasi-periodic."""


@dataclass(frozen=True)
class Repetition:
    """Period of a repeating motion, with the remaining distance."""

    period: int
    distance: float
    """Remaining distance relative to the size of the motion."""


@dataclass(frozen=True, eq=False)
class Growth:
    """Growth of a small change over consecutive stretches of a motion."""

    logarithms: Floats
    """Natural logarithm of the growth over each stretch, shape (stretches,)."""
    duration_s: float
    """Duration of all stretches together."""

    @property
    def total(self) -> float:
        """Return the growth over all stretches."""
        return float(self.logarithms.sum())

    @property
    def is_certain(self) -> bool:
        """Return whether a small change has certainly grown."""
        return self.total > CERTAIN_GROWTH

    @property
    def halves(self) -> tuple[float, float]:
        """Return the growth over the earlier and the later stretches."""
        middle = len(self.logarithms) // 2
        return float(self.logarithms[:middle].sum()), float(self.logarithms[middle:].sum())


@dataclass(frozen=True)
class Sharpness:
    """Tolerances relative to the size of a motion."""

    tolerance: float
    """Remaining distance that counts as settled."""
    noise: float
    """Changes from one period to the next due to integration steps alone."""


def repetition(
    section: Floats, omega: float, forgetting_periods: float, sharpness: Sharpness
) -> Repetition | None:
    """Find the fewest drive periods after which the end of a section repeats; None if it does not.

    States one forgetting time apart are compared twice, because a small change per period may belong to a
    slow drift over a long way. The ratio of the two changes gives the remaining distance.

    Parameters
    ----------
    section
        States once a drive period, shape (n, 6); longer ones find longer periods.
    omega
        Angular frequency of the drive [rad/s], which scales velocities to displacements.
    forgetting_periods
        Drive periods in which the slowest mode without contact decays by a factor of e.
    sharpness
        Tolerances.
    """
    points = section / np.repeat([1.0, omega], 3)
    points = points / max(float(np.abs(points).max(initial=0.0)), TINY)
    if len(points) > MOST_PERIODS and _returns_nowhere(points, sharpness.tolerance):
        return None
    apart = np.inf
    for period in range(1, MOST_PERIODS + 1):
        lag = period * int(np.ceil(max(forgetting_periods, FEWEST_BETWEEN) / period))
        if len(points) < 2 * lag + period:
            return None
        step = _change(points[-lag:], points[-lag - period : -period])
        if step < sharpness.tolerance:
            distance = _still_to_go(points, period, lag, sharpness.noise)
            is_there = distance < sharpness.tolerance and apart > DISTINCT * sharpness.tolerance
            return Repetition(period, distance) if is_there else None
        apart = min(apart, step)
    return None


def _returns_nowhere(points: Floats, tolerance: float) -> bool:
    """Return whether the last state alone excludes repetition (a fast test for chaos)."""
    changes = np.abs(points[-1 - MOST_PERIODS : -1] - points[-1]).max(axis=1)
    return bool(np.all(changes >= tolerance))


def wandered_until(section: Floats, omega: float, period: int) -> int:
    """Return how many states pass before a section nearly repeats after a period."""
    points = section / np.repeat([1.0, omega], 3)
    points = points / max(float(np.abs(points).max(initial=0.0)), TINY)
    changes = np.abs(points[period:] - points[:-period]).max(axis=1)
    wandering = np.flatnonzero(changes > NEARLY)
    return int(wandering[-1]) + period + 1 if len(wandering) else 0


def is_drifting(section: Floats, omega: float) -> bool:
    """Return whether the changes of a motion from period to period shrink or grow steadily.

    Near a bifurcation a motion settles so slowly that a small change neither grows nor decays in the watched
    time, as on a torus. But on a torus the changes keep their size.

    Parameters
    ----------
    section
        States once a drive period, shape (n, 6).
    omega
        Angular frequency of the drive [rad/s].
    """
    points = section / np.repeat([1.0, omega], 3)
    periods = range(1, min(MOST_PERIODS, len(points) // (2 * DRIFT_PARTS)) + 1)
    changes = [np.square(points[period:] - points[:-period]).sum(axis=1) for period in periods]
    if not changes:
        return False
    smallest = min(changes, key=lambda squares: float(squares.mean()))
    trend = np.diff([float(part.mean()) for part in np.array_split(smallest, DRIFT_PARTS)])
    return bool(np.all(trend < 0.0) or np.all(trend > 0.0))


def _still_to_go(points: Floats, period: int, lag: int, noise: float) -> float:
    """Return the remaining distance of a motion if its changes continue to shrink."""
    late = _change(points[-period:], points[-period - lag : -lag])
    if late < noise:
        return late
    early = _change(points[-period - lag : -lag], points[-period - 2 * lag : -2 * lag])
    ratio = min(late / early, SLOWEST_RATIO) if early > 0.0 else SLOWEST_RATIO
    return late * max(1.0, ratio / (1.0 - ratio))


def longest_section(forgetting_periods: float) -> int:
    """Return the number of states that are needed to find every period up to the longest."""
    return 2 * (int(np.ceil(max(forgetting_periods, FEWEST_BETWEEN))) + MOST_PERIODS) + MOST_PERIODS


def kind_of(repeats: Repetition | None, growth: Growth, fading_s: float) -> MotionKind:
    """Return the kind of a motion; undecided if it may still be settling, within eight times ``fading_s``."""
    if repeats is not None:
        return MotionKind.PERIODIC
    times = growth.duration_s / fading_s
    per_time = growth.total / times if times > 0.0 else 0.0
    earlier, later = growth.halves
    if growth.is_certain and per_time > NEUTRAL and min(earlier, later) > 0.25 * growth.total:
        return MotionKind.CHAOTIC
    if times >= FEWEST_NEUTRAL and abs(per_time) < NEUTRAL:
        return MotionKind.QUASI_PERIODIC
    return MotionKind.UNDECIDED


def _change(after: Floats, before: Floats) -> float:
    return float(np.abs(after - before).max(initial=0.0))


FORGETTING = 8.0
"""Forgetting times after which a non-repeating motion counts as on its attractor."""
FEWEST_TIMES = 40.0
"""Forgetting times in the longest run; slower and undamped modes count as this slow."""
MOST_STATES = 2_000_000
"""Most drive periods in a window: the states of two windows and a copy take 300 MB."""
FEWEST_PERIODS = 32
"""Fewest drive periods after which a non-repeating motion counts as on its attractor."""
SETTLED = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-8}
"""Relative distance from the repeating motion at which a motion counts as settled."""
ROUNDING = 1e-10
"""Noise of exact flight, and of contacts with the same start and end as a period before."""
EXACTLY = 1e-9
"""Distance at which the rest of a settling motion is skipped: smaller than the error of any accuracy
level."""
STEPPING = 100.0
"""Noise over the tolerance for integration in steps, which differ from period to period. Measured: at most 70
(p^7 at 130 Hz and 20 um)."""


@dataclass(frozen=True)
class Pace:
    """Time scales and tolerances for one drive."""

    frequency_hz: float
    forgetting_s: float
    """Time in which the slowest mode without contact decays by e, at most the longest waiting time."""
    fading_s: float
    """Time of this decay without the limit; for undamped modes, the limit."""
    sharpness: Sharpness
    nearly: Sharpness
    """Sharpness of the least accurate level."""

    @property
    def forgetting_periods(self) -> float:
        """Return the forgetting time in drive periods."""
        return self.forgetting_s * self.frequency_hz

    @property
    def attractor_s(self) -> float:
        """Return the time after which a non-repeating motion counts as on its attractor."""
        return max(FORGETTING * self.forgetting_s, FEWEST_PERIODS / self.frequency_hz)

    @property
    def section_s(self) -> float:
        """Return the length of a section that shows every period."""
        return (longest_section(self.forgetting_periods) + 1) / self.frequency_hz

    @property
    def settling_s(self) -> float:
        """Return the time needed to detect that a motion repeats."""
        return self.attractor_s + self.section_s

    def repeats(self, stretches: Sequence[Stretch]) -> Repetition | None:
        """Return the repetition at the end of these consecutive stretches, if any."""
        return self.repeats_in(states_of(stretches))

    def drifts(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether the motion of these stretches still approaches or leaves another motion."""
        return is_drifting(states_of(stretches), 2.0 * np.pi * self.frequency_hz)

    def cycle(self, stretches: Sequence[Stretch]) -> int:
        """Return the drive periods over which lines are taken: the motion's own, if it has nearly settled.

        The limit for "nearly" is equal at every accuracy level, so that lines are comparable.
        """
        found = self.repeats(stretches) or replace(self, sharpness=self.nearly).repeats(stretches)
        return 1 if found is None else found.period

    def is_chaos(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether a small change grew enough in each half of these stretches to prove chaos."""
        growth = growth_of(stretches)
        is_plenty = min(growth.halves) > CERTAIN_GROWTH
        return is_plenty and kind_of(None, growth, self.fading_s) is MotionKind.CHAOTIC

    def repeats_in(self, section: Floats) -> Repetition | None:
        """Return the repetition at the end of these states once per drive period, shape (n, 6), if any."""
        omega = 2.0 * np.pi * self.frequency_hz
        return repetition(section, omega, self.forgetting_periods, self.sharpness)


def pace_of(
    specimen: Specimen, frequency_hz: float, accuracy: Accuracy, slowest_rate: float, longest_s: float
) -> Pace:
    """Return the pace for a specimen whose slowest mode has ``slowest_rate`` [1/s], zero or negative."""
    slowest_s = min(longest_s / FEWEST_TIMES, MOST_STATES / FEWEST_TIMES / frequency_hz)
    fading_s = -1.0 / slowest_rate if slowest_rate < 0.0 else slowest_s
    own, nearly = (_sharpness(specimen.contact, each) for each in (accuracy, Accuracy.QUICK))
    return Pace(frequency_hz, min(slowest_s, fading_s), fading_s, own, nearly)


def _sharpness(contact: ContactLaw, accuracy: Accuracy) -> Sharpness:
    match contact:
        case PowerLaw():
            noise = STEPPING * accuracy.tolerance
        case _:
            noise = ROUNDING
    return Sharpness(max(SETTLED[accuracy], 2.0 * noise), noise)


def growth_of(stretches: Sequence[Stretch]) -> Growth:
    """Return the growth of a small change over the stretches that propagated one."""
    carried = [stretch for stretch in stretches if np.isfinite(stretch.growth)]
    logarithms = np.array([stretch.growth for stretch in carried])
    return Growth(logarithms, sum(stretch.length_s for stretch in carried))
