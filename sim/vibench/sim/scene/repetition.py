"""Classify a motion from its states once per drive period and the growth of a small change.

Whether it repeats is read from the states alone. A motion that does not repeat is chaotic when a small change
grows without end, quasi-periodic when it does neither grow nor die (Lichtenberg and Lieberman, Regular and
Chaotic Dynamics (1992), section 5.3; growth is counted in natural logarithms).
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
"""States that are compared lie at least this many drive periods apart."""
SLOWEST_RATIO = 0.99
"""A change that shrinks less than this between two comparisons is taken to shrink by this."""
NEARLY = 0.01
"""Change over the size of a motion, from one of its periods to the next, up to which it may be settling."""
TINY = 1e-300
"""Size of a motion that has none."""
DISTINCT = 20.0
"""A motion of several periods differs from one of fewer by this many tolerances; one that differs by less may
be settling down to it still."""
CERTAIN_GROWTH = 12.0
"""A small change has grown by e^12 = 160 000: more than shear makes of it."""
NEUTRAL = 0.1
"""Growth per forgetting time that counts as none: the specimen's own damping has -1."""
DRIFT_PARTS = 6
"""A motion drifts whose changes grow or shrink over this many parts in turn: by chance in 2 cases of 720."""
FEWEST_NEUTRAL = 8.0
"""Forgetting times that a motion must neither grow nor die to be called quasi-periodic."""


@dataclass(frozen=True)
class Repetition:
    """Period of a repeating motion, with the remaining distance."""

    period: int
    distance: float
    """Remaining distance relative to its size."""


@dataclass(frozen=True, eq=False)
class Growth:
    """How a small change has grown over stretches of a motion, one after the other."""

    logarithms: Floats
    """Natural logarithm of the growth over each stretch, shape (stretches,)."""
    duration_s: float
    """Duration of all stretches together."""

    @property
    def total(self) -> float:
        """Over all stretches."""
        return float(self.logarithms.sum())

    @property
    def is_certain(self) -> bool:
        """A small change has certainly grown."""
        return self.total > CERTAIN_GROWTH

    @property
    def halves(self) -> tuple[float, float]:
        """Over the earlier and the later stretches."""
        middle = len(self.logarithms) // 2
        return float(self.logarithms[:middle].sum()), float(self.logarithms[middle:].sum())


@dataclass(frozen=True)
class Sharpness:
    """Tolerances relative to the size of a motion."""

    tolerance: float
    """Distance still to go that counts as there."""
    noise: float
    """Changes from one period to the next that come from the steps of the integration alone."""


def repetition(
    section: Floats, omega: float, forgetting_periods: float, sharpness: Sharpness
) -> Repetition | None:
    """Find the fewest drive periods after which the end of a section repeats; None if it does not.

    States a forgetting time apart are compared, twice over: a small change from one period to the next may
    be a slow drift that goes far. What is still to go follows from how the change shrinks.

    Parameters
    ----------
    section
        States once a drive period, shape (n, 6); longer ones find longer periods.
    omega
        Of the drive [rad/s]: measures velocities against displacements.
    forgetting_periods
        Drive periods in which the slowest mode without contact fades by e.
    sharpness
        What counts as the same.
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
    """Return whether the last state alone excludes repetition, which saves time in chaos."""
    changes = np.abs(points[-1 - MOST_PERIODS : -1] - points[-1]).max(axis=1)
    return bool(np.all(changes >= tolerance))


def wandered_until(section: Floats, omega: float, period: int) -> int:
    """Return the number of states before the end during which a section nearly repeats after a period."""
    points = section / np.repeat([1.0, omega], 3)
    points = points / max(float(np.abs(points).max(initial=0.0)), TINY)
    changes = np.abs(points[period:] - points[:-period]).max(axis=1)
    wandering = np.flatnonzero(changes > NEARLY)
    return int(wandering[-1]) + period + 1 if len(wandering) else 0


def is_drifting(section: Floats, omega: float) -> bool:
    """Return whether the changes of a motion from period to period shrink or grow steadily.

    Near a bifurcation a motion settles so slowly that a small change neither grows nor fades in the time
    that was watched, as on a torus. On a torus the changes keep their size.

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
    """Return the number of states needed to find every period up to the longest."""
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
"""Forgetting times after which a motion that does not repeat is taken to be on its attractor."""
FEWEST_TIMES = 40.0
"""The longest run holds this many forgetting times; slower modes, and undamped ones, count as so slow."""
MOST_STATES = 2_000_000
"""A window holds no more drive periods. Their states, two windows of them and a copy, take 300 MB."""
FEWEST_PERIODS = 32
"""Drive periods after which a motion that does not repeat is taken to be on its attractor, at least."""
SETTLED = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-8}
"""Distance from the motion that it repeats, over its size, at which it counts as settled."""
ROUNDING = 1e-10
"""Noise of exact flight and of contacts that begin and end as they did a period before."""
EXACTLY = 1e-9
"""Distance at which a motion is passed over: what is left of the way is less than any level promises."""
STEPPING = 100.0
"""Noise over the tolerance where steps follow one another without a break: they fall elsewhere in each
period. Measured: 70 at most (p^7 at 130 Hz and 20 um)."""


@dataclass(frozen=True)
class Pace:
    """Time scales and tolerances for one drive."""

    frequency_hz: float
    forgetting_s: float
    """Time in which the slowest mode without contact fades by e, or as slowly as is waited for."""
    fading_s: float
    """The same where it is longer than can be waited for; of undamped modes, what is waited for."""
    sharpness: Sharpness
    nearly: Sharpness
    """That of the least accurate level."""

    @property
    def forgetting_periods(self) -> float:
        """The forgetting time in drive periods."""
        return self.forgetting_s * self.frequency_hz

    @property
    def attractor_s(self) -> float:
        """Time after which a non-repeating motion counts as on its attractor."""
        return max(FORGETTING * self.forgetting_s, FEWEST_PERIODS / self.frequency_hz)

    @property
    def section_s(self) -> float:
        """Length of the section that lets every period be found."""
        return (longest_section(self.forgetting_periods) + 1) / self.frequency_hz

    @property
    def settling_s(self) -> float:
        """Time needed to detect that a motion repeats."""
        return self.attractor_s + self.section_s

    def repeats(self, stretches: Sequence[Stretch]) -> Repetition | None:
        """Return whether the motion of these stretches, one after the other, repeats at their end."""
        return self.repeats_in(states_of(stretches))

    def drifts(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether the motion of these stretches still approaches or leaves another motion."""
        return is_drifting(states_of(stretches), 2.0 * np.pi * self.frequency_hz)

    def cycle(self, stretches: Sequence[Stretch]) -> int:
        """Return the drive periods over which lines are taken: the motion's own, if it has nearly settled.

        What counts as nearly is the same at every level, so that a line is the same question at each.
        """
        found = self.repeats(stretches) or replace(self, sharpness=self.nearly).repeats(stretches)
        return 1 if found is None else found.period

    def is_chaos(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether a small change has grown in each half of these stretches as only chaos makes it."""
        growth = growth_of(stretches)
        is_plenty = min(growth.halves) > CERTAIN_GROWTH
        return is_plenty and kind_of(None, growth, self.fading_s) is MotionKind.CHAOTIC

    def repeats_in(self, section: Floats) -> Repetition | None:
        """Say whether a motion with these states once a drive period, shape (n, 6), repeats at their end."""
        omega = 2.0 * np.pi * self.frequency_hz
        return repetition(section, omega, self.forgetting_periods, self.sharpness)


def pace_of(
    specimen: Specimen, frequency_hz: float, accuracy: Accuracy, slowest_rate: float, longest_s: float
) -> Pace:
    """Choose the pace for a specimen whose slowest mode has ``slowest_rate`` [1/s], zero or negative."""
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
