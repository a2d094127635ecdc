"""Classify a motion from its states once per drive period and the growth of a small perturbation.

The states show whether the motion repeats. A motion that does not repeat is chaotic if a small perturbation
keeps growing, and quasi-periodic if the perturbation neither grows nor decays (Lichtenberg and Lieberman,
Regular and Chaotic Dynamics (1992), section 5.3). Growth is stated as a natural logarithm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..engine.run import Accuracy
from ..specimen.contact_laws import ContactLaw, PowerLaw
from ..specimen.specimen import Floats, Specimen
from .followed_run import Stretch, states_of
from .prediction import MotionKind

MOST_PERIODS = 32
"""Longest detected period of a motion, in drive periods."""
FEWEST_BETWEEN = 8
"""Smallest number of drive periods between two states that are compared to detect repetition."""
SLOWEST_RATIO = 0.99
"""Largest assumed ratio of successive changes of state, which corresponds to the slowest settling."""
NEARLY = 0.01
"""Relative change of state from one period to the next, below which a motion counts as settling."""
TINY = 1e-300
"""Size assumed for a motion at rest, to avoid division by zero."""
DISTINCT = 20.0
"""Smallest change of state within a period [tolerances]. If a change is smaller, the motion may still be
settling to a shorter period."""
CERTAIN_GROWTH = 12.0
"""Growth that proves chaos: a factor of e^12 = 160 000, which shear in regular motions does not reach."""
NEUTRAL = 0.1
"""Largest growth, per decay time of the slowest mode, that counts as zero; damping alone gives -1."""
DRIFT_PARTS = 6
"""Number of consecutive parts of a motion that are compared. In a drift, the change of state steadily grows,
or steadily shrinks, from part to part. This happens by chance in 2 of 720 cases."""
FEWEST_NEUTRAL = 8.0
"""Time [decay times] after which a motion without growth or decay of perturbations is quasi-periodic."""


@dataclass(frozen=True)
class Repetition:
    """Period of a repeating motion in drive periods, and distance from the exact periodic motion."""

    period: int
    distance: float
    """Estimated distance of the run from the periodic motion, relative to the size of the motion."""


@dataclass(frozen=True, eq=False)
class Growth:
    """Growth of a small perturbation of a motion over consecutive stretches of the run."""

    logarithms: Floats
    """Natural logarithm of the growth over each stretch, shape (stretches,)."""
    duration_s: float
    """Total duration of the observed stretches [s]."""

    @property
    def total(self) -> float:
        """Natural logarithm of the perturbation's growth over all stretches."""
        return float(self.logarithms.sum())

    @property
    def is_certain(self) -> bool:
        """Whether the growth is large enough to prove chaos."""
        return self.total > CERTAIN_GROWTH

    @property
    def halves(self) -> tuple[float, float]:
        """Logarithmic growth over the first and over the second half of the stretches."""
        middle = len(self.logarithms) // 2
        return float(self.logarithms[:middle].sum()), float(self.logarithms[middle:].sum())


@dataclass(frozen=True)
class Sharpness:
    """Tolerances of the test for repetition, relative to the size of the motion."""

    tolerance: float
    """Largest distance from the periodic motion at which a motion counts as settled."""
    noise: float
    """Change of state from one period to the next that the integration's time steps may cause."""


def repetition(
    section: Floats, omega: float, forgetting_periods: float, sharpness: Sharpness
) -> Repetition | None:
    """Return the shortest period with which a motion repeats at its end; None if it does not repeat.

    Two changes, each over about one decay time, are compared, because a small change in one period may be
    part of a slow drift. The ratio of the two changes gives the remaining distance.

    Parameters
    ----------
    section
        States once per drive period, shape (n, 6); a longer period requires more states.
    omega
        Angular frequency of the drive [rad/s]; velocities are divided by this frequency.
    forgetting_periods
        Drive periods in which the slowest mode without contact decays by a factor of e.
    sharpness
        Tolerances of the test.
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
    """Return whether the last state alone excludes repetition; this fast test detects most chaos."""
    changes = np.abs(points[-1 - MOST_PERIODS : -1] - points[-1]).max(axis=1)
    return bool(np.all(changes >= tolerance))


def first_repetition(section: Floats, omega: float, period: int) -> int:
    """Return the index of the first state after which a motion nearly repeats with this period."""
    points = section / np.repeat([1.0, omega], 3)
    points = points / max(float(np.abs(points).max(initial=0.0)), TINY)
    changes = np.abs(points[period:] - points[:-period]).max(axis=1)
    wandering = np.flatnonzero(changes > NEARLY)
    return int(wandering[-1]) + period + 1 if len(wandering) else 0


def is_drifting(section: Floats, omega: float) -> bool:
    """Return whether the changes of a motion from one period to the next steadily shrink or steadily grow.

    Near a bifurcation a motion settles so slowly that, as on a torus, perturbations neither grow nor decay
    measurably. On a torus, however, the changes from period to period keep their size.

    Parameters
    ----------
    section
        States once per drive period, shape (n, 6).
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
    """Return the remaining distance from the periodic motion, extrapolated from shrinking changes."""
    late = _change(points[-period:], points[-period - lag : -lag])
    if late < noise:
        return late
    early = _change(points[-period - lag : -lag], points[-period - 2 * lag : -2 * lag])
    ratio = min(late / early, SLOWEST_RATIO) if early > 0.0 else SLOWEST_RATIO
    return late * max(1.0, ratio / (1.0 - ratio))


def longest_section(forgetting_periods: float) -> int:
    """Return the number of states needed to detect every period up to `MOST_PERIODS`."""
    return 2 * (int(np.ceil(max(forgetting_periods, FEWEST_BETWEEN))) + MOST_PERIODS) + MOST_PERIODS


def kind_of(repeats: Repetition | None, growth: Growth, fading_s: float) -> MotionKind:
    """Return the kind of a motion; undecided if growth is unclear or was not observed for long enough."""
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
"""Decay times of the slowest mode after which a non-repeating motion is assumed to be on its attractor."""
FEWEST_TIMES = 40.0
"""Ratio of the longest run to the longest decay time used; longer decay times are cut to this limit."""
MOST_STATES = 2_000_000
"""Largest number of drive periods in a window; the states of two windows, with a copy, take 300 MB."""
FEWEST_PERIODS = 32
"""Smallest number of drive periods until a non-repeating motion is assumed to be on its attractor."""
SETTLED = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-8}
"""Relative distance from the periodic motion below which a motion counts as settled."""
ROUNDING = 1e-10
"""Relative noise of a motion that is exact, or whose contacts have equal time steps in every period."""
EXACTLY = 1e-9
"""Relative distance from the periodic motion below which the rest of a run is skipped; below the error of
every accuracy level."""
STEPPING = 100.0
"""Ratio of the noise to the tolerance of time integration, whose steps differ from period to period.
Measured: at most 70 (p^7 at 130 Hz and 20 um)."""


@dataclass(frozen=True)
class Pace:
    """Time scales and tolerances of the test for repetition, for a specimen under one drive."""

    frequency_hz: float
    forgetting_s: float
    """Decay time of the slowest mode without contact (factor e) [s], at most 1/40 of the longest run."""
    fading_s: float
    """Decay time without the limit of ``forgetting_s`` [s]; equal to this limit for an undamped mode."""
    sharpness: Sharpness
    nearly: Sharpness
    """Tolerances of the least accurate level, for motions that are nearly settled."""

    @property
    def forgetting_periods(self) -> float:
        """Decay time ``forgetting_s`` in drive periods."""
        return self.forgetting_s * self.frequency_hz

    @property
    def attractor_s(self) -> float:
        """Time after which a non-repeating motion counts as being on its attractor [s]."""
        return max(FORGETTING * self.forgetting_s, FEWEST_PERIODS / self.frequency_hz)

    @property
    def section_s(self) -> float:
        """Simulated time that suffices to detect a motion of any period up to `MOST_PERIODS` [s]."""
        return (longest_section(self.forgetting_periods) + 1) / self.frequency_hz

    @property
    def settling_s(self) -> float:
        """Length of a run that suffices to detect whether a motion repeats [s]."""
        return self.attractor_s + self.section_s

    def repeats(self, stretches: Sequence[Stretch]) -> Repetition | None:
        """Return the repetition at the end of consecutive stretches; None if the motion does not repeat."""
        return self.repeats_in(states_of(stretches))

    def drifts(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether the motion still approaches or leaves another motion; see `is_drifting`."""
        return is_drifting(states_of(stretches), 2.0 * np.pi * self.frequency_hz)

    def cycle(self, stretches: Sequence[Stretch]) -> int:
        """Return the period of a nearly settled motion, in drive periods; 1 if no period is found.

        Spectral lines are computed over this period. "Nearly settled" does not depend on the accuracy.
        """
        found = self.repeats(stretches) or replace(self, sharpness=self.nearly).repeats(stretches)
        return 1 if found is None else found.period

    def is_chaos(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether a perturbation grew enough to prove chaos, in each half of the stretches."""
        growth = growth_of(stretches)
        is_plenty = min(growth.halves) > CERTAIN_GROWTH
        return is_plenty and kind_of(None, growth, self.fading_s) is MotionKind.CHAOTIC

    def repeats_in(self, section: Floats) -> Repetition | None:
        """Return the repetition at the end of a series of states, shape (n, 6); None without repetition."""
        omega = 2.0 * np.pi * self.frequency_hz
        return repetition(section, omega, self.forgetting_periods, self.sharpness)


def pace_of(
    specimen: Specimen, frequency_hz: float, accuracy: Accuracy, slowest_rate: float, longest_s: float
) -> Pace:
    """Return time scales and tolerances; ``slowest_rate`` is the rate of the slowest mode, <= 0 [1/s]."""
    slowest_s = min(longest_s / FEWEST_TIMES, MOST_STATES / FEWEST_TIMES / frequency_hz)
    fading_s = -1.0 / slowest_rate if slowest_rate < 0.0 else slowest_s
    own, nearly = (_sharpness(specimen.contact, each) for each in (accuracy, Accuracy.QUICK))
    return Pace(frequency_hz, min(slowest_s, fading_s), fading_s, own, nearly)


def _sharpness(contact: ContactLaw, accuracy: Accuracy) -> Sharpness:
    noise = STEPPING * accuracy.tolerance if isinstance(contact, PowerLaw) else ROUNDING
    return Sharpness(max(SETTLED[accuracy], 2.0 * noise), noise)


def growth_of(stretches: Sequence[Stretch]) -> Growth:
    """Return the growth of the tangent vector over the stretches in which it was propagated."""
    carried = [stretch for stretch in stretches if np.isfinite(stretch.growth)]
    logarithms = np.array([stretch.growth for stretch in carried])
    return Growth(logarithms, sum(stretch.length_s for stretch in carried))
