"""Integration with tangent vectors, whose growth is recorded at equal intervals. SI units.

Within an interval the tangent vectors are propagated exactly. At the end of the interval, they are
orthonormalised in the energy norm s' diag(K, M) s, and the logarithms of the divisors are recorded (Benettin,
Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980) 9 and 21). This norm is the energy without stops, which
decays in free motion: any growth is due to impacts.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.batch import BatchedMotion, follow_batch, is_batchable
from ..engine.run import (
    MAX_IMPACT_RATE_HZ,
    Accuracy,
    GrowthReadings,
    NativeRun,
    Outcome,
    RunRecord,
    most_impacts,
    start_motion,
)
from ..motion.integrate import check_impact_rate
from ..periodic.shooting import smallest_period
from ..specimen.drive import Harmonic
from ..specimen.modes import modal_form
from ..specimen.specimen import Floats, Specimen, energy_metric
from ..specimen.stops import require_positive

# Standard error of the mean of a correlated series, from sufficiently long blocks.
#
# Averaging neighbouring values in pairs doubles the length of blocks; this is repeated. The estimated error
# of the mean grows with the block length up to the correlation length, and then stays constant (Flyvbjerg and
# Petersen, J. Chem. Phys. 91 (1989) 461). The block length is the shortest length from which on a test finds
# no correlation between blocks (Jonsson, Phys. Rev. E 98 (2018) 043304).

FEWEST_BLOCKS = 16
"""Smallest number of uncorrelated blocks; with fewer, a standard error is uncertain by more than 20 %."""
CONFIDENCE = 0.99
"""Confidence level of the test for correlation between neighbouring blocks."""


@dataclass(frozen=True)
class BlockedMean:
    """Mean of a correlated series, with the standard error of the mean."""

    mean: float
    standard_error: float
    """Standard error of the mean; zero if all values are equal, NaN for a single value."""
    block_length: int
    """Number of values in a block: the smallest power of two that leaves adjacent blocks uncorrelated."""
    blocks: int
    correlation_length: float
    """Number of successive values that carry as much information as one independent value: the ratio of the
    squared standard errors for correlated and for independent values."""
    is_long_enough: bool
    """Whether there are at least `FEWEST_BLOCKS` blocks; otherwise the standard error is a lower bound."""


def block_mean(values: ArrayLike) -> BlockedMean:
    """Return the mean of evenly spaced values, shape (n,), n >= 1, with its standard error.

    Raises ValueError when there is no value, or a value is not finite.
    """
    series = np.asarray(values, dtype=np.float64)
    if series.ndim != 1 or len(series) == 0 or not bool(np.all(np.isfinite(series))):
        raise ValueError(f"A series of shape {series.shape} is not allowed: give one row of finite numbers.")
    mean = float(series.mean())
    variances, correlations, counts = _levels(series - mean)
    if len(counts) == 0 or variances[0] == 0.0:
        error = 0.0 if len(series) > 1 else math.nan
        return BlockedMean(mean, error, 1, len(series), 1.0, len(series) >= FEWEST_BLOCKS)
    # Choose the smallest block length from which on neighbouring blocks are uncorrelated.
    ratios = np.divide(correlations, variances, out=np.zeros_like(variances), where=variances > 0.0)
    # The correlation of neighbours among n independent values has the mean -1/n and the variance 1/n.
    evidence = np.cumsum((counts * (ratios + 1.0 / counts) ** 2)[::-1])[::-1]
    passes = np.flatnonzero(evidence < _largest_by_chance(len(counts)))
    level = int(passes[0]) if len(passes) else len(counts) - 1
    variance = variances[level] / (counts[level] - 1)
    return BlockedMean(
        mean=mean,
        standard_error=math.sqrt(variance),
        block_length=2**level,
        blocks=int(counts[level]),
        correlation_length=float(variance / (variances[0] / (counts[0] - 1))),
        is_long_enough=bool(counts[level] >= FEWEST_BLOCKS),
    )


def _levels(centred: Floats) -> tuple[Floats, Floats, Floats]:
    """Return variance, covariance of neighbours and number of blocks (2 or more), for each block length."""
    variances, correlations, counts = [], [], []
    while len(centred) > 1:
        variances.append(float(centred @ centred) / len(centred))
        correlations.append(float(centred[:-1] @ centred[1:]) / len(centred))
        counts.append(len(centred))
        pairs = len(centred) // 2
        centred = 0.5 * (centred[: 2 * pairs : 2] + centred[1 : 2 * pairs : 2])
    return np.array(variances), np.array(correlations), np.array(counts, dtype=np.float64)


@cache
def _largest_by_chance(levels: int) -> Floats:
    """Return the correlation test's limit for each block length; a test includes all longer lengths."""
    from scipy.special import chdtri  # noqa: PLC0415 - a fifth of a second, which few motions need

    return np.asarray(chdtri(np.arange(levels, 0, -1), 1.0 - CONFIDENCE))


LONGEST_TURN, LONGEST_DECAY = 2.0 * math.pi, 20.0
"""Longest time between orthogonalisations: in radians and in decay times of the fastest mode. After this time
the tangent vectors are still independent to several digits."""
FIRST_CHECK, NEXT_CHECK = 1.0 / 32.0, 0.8
"""Share of a run before the first test for an early end, and of the expected rest before the next test."""
ALMOST = 1e-9
"""Relative tolerance within which a duration counts as a whole number of intervals."""
Needed = Callable[[Floats], float]
"""Function that returns about how many intervals a run needs, from the growth in each, shape (n, m)."""
SLICE_INTERVALS = 64
"""Number of intervals between two moments at which Python sees Ctrl-C."""
CYCLES = math.sqrt(3.0)
"""Default length of an interval in cycles of the slowest mode. It is irrational: after whole cycles tangent
vectors of free motion have the same phase, which hides the fluctuation of their growth from the error."""


@dataclass(frozen=True)
class Interval:
    """Time interval in which the growth of tangent vectors is measured."""

    length_s: float
    periods: int
    """Number of drive periods in the interval; 0 if the interval is not a whole number of periods."""

    def count_in(self, duration_s: float) -> int:
        """Return the number of whole intervals in a duration [s]."""
        return math.floor(duration_s / self.length_s * (1.0 + ALMOST))


def interval_for(specimen: Specimen, drive: Harmonic, about_s: float | None = None) -> Interval:
    """Return an interval of about ``about_s`` [s], by default `CYCLES` cycles of the slowest mode.

    It contains whole drive periods, unless one drive period is longer than twice ``about_s``.
    """
    about = CYCLES / float(specimen.natural_frequencies_hz[0]) if about_s is None else about_s
    require_positive("Interval", about, "s")
    periods = max(1, round(about * drive.frequency_hz))
    if periods > 2.0 * about * drive.frequency_hz:
        return Interval(about, 0)
    return Interval(periods / drive.frequency_hz, periods)


@dataclass(frozen=True, eq=False)
class TangentRun:
    """Growth of m tangent vectors of a motion in each of n intervals."""

    interval: Interval
    growth: Floats
    """Natural logarithm of the growth of each tangent vector in each interval, shape (n, m)."""
    impacts: NDArray[np.int64]
    """Number of impacts in each interval, shape (n,)."""
    section: Floats
    """x, y, z, vx, vy, vz at the end of each interval, shape (n, 6)."""
    total_impacts: int
    """Number of impacts in the whole run."""
    is_quiet: bool
    """Whether a bound on p proves that no impact will follow after the run."""
    final_state: Floats
    """State (x, y, z, vx, vy, vz) at ``end_time_s``, shape (6,)."""
    end_time_s: float
    outcome: Outcome

    @property
    def rates(self) -> Floats:
        """Growth rate of each tangent vector in each interval (local exponents), shape (n, m) [1/s]."""
        return self.growth / self.interval.length_s


class TangentCourse:
    """A motion from time zero of its drive with ``changes`` (1 to 6) tangent vectors, integrated in parts.

    It ends after the last whole interval in the duration, or earlier if ``needed`` is reached. Parts are
    integrated alone (`follow`), or with those of other motions in SIMD batches (`follow_courses`).
    """

    def __init__(
        self,
        specimen: Specimen,
        drive: Harmonic,
        changes: int,
        duration_s: float,
        interval: Interval,
        accuracy: Accuracy = Accuracy.STANDARD,
        initial_state: ArrayLike | None = None,
        max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
        needed: Needed | None = None,
    ) -> None:
        check_impact_rate(max_impact_rate_hz)
        self._interval, self._needed = interval, needed
        self._count = count = interval.count_in(duration_s)
        self.run = run = NativeRun(specimen, drive, start_motion(initial_state), accuracy.tolerance)
        self._metric = metric = energy_metric(specimen)
        # Initial tangents, orthonormal in the metric and fixed for all runs.
        size = len(metric)
        general = np.cos(np.outer(np.arange(1.0, changes + 1.0), np.arange(1.0, size + 1.0)))
        root = np.linalg.cholesky(metric)
        rows, lengths = np.linalg.qr((general / np.sqrt(np.diag(metric)) @ root).T)
        run.carry(np.linalg.solve(root.T, rows * np.sign(np.diag(lengths))).T)
        self._record = RunRecord(most_impacts(max_impact_rate_hz, duration_s))
        self._batched_impacts = 0
        parts = _parts(specimen, interval.length_s) if changes > 1 else 1
        self._readings = GrowthReadings(changes, count, interval.length_s, parts, metric)
        self._outcome = Outcome.REACHED_END
        self._first = self._goal = count if needed is None else math.ceil(count * FIRST_CHECK)
        self._is_alone = changes > 1 or interval.periods == 0
        self.is_over = count == 0
        """Whether the motion has reached its end or failed."""

    def follow(self, intervals: int | None = None) -> None:
        """Integrate the motion alone to its end, or for a number of intervals."""
        readings = self._readings
        while not self.is_over:
            last = min(self._goal, readings.completed + (intervals or SLICE_INTERVALS))
            self._outcome = self.run.read(readings, last, self._record)
            self._look()
            if intervals is not None:
                break

    @property
    def batch_periods(self) -> int:
        """Number of drive periods that a batch may integrate next; 0 for a motion to integrate alone."""
        if self._is_alone or not self.run.is_in_flight:
            return 0
        return (self._goal - self._readings.completed) * self._interval.periods

    def note(self, motion: BatchedMotion | None) -> None:
        """Add a part of the motion that was integrated in a batch; None if the batch failed."""
        if motion is None:
            self._is_alone = True
            return
        every = self._interval.periods
        growth, struck = motion.growth[every - 1 :: every], motion.struck[every - 1 :: every]
        self._readings.add(
            *(np.ediff1d(growth, to_begin=growth[:1]), np.ediff1d(struck, to_begin=struck[:1])),
            motion.states[every - 1 :: every],
        )
        self._batched_impacts += motion.impacts
        change = self.run.changes
        self.run.carry(change / math.sqrt((change @ self._metric @ change.T).item()))
        self._look()

    def _look(self) -> None:
        done = self._readings.completed
        self.is_over = self._outcome is not Outcome.REACHED_END or done >= self._count
        if self._needed is not None and not self.is_over and done >= self._goal:
            left = self._needed(self._readings.growth) - done
            self.is_over = left <= 0.0
            self._goal = min(self._count, done + max(self._first, math.ceil(min(NEXT_CHECK * left, done))))

    def result(self) -> TangentRun:
        """Return the growth of the tangent vectors so far."""
        run, readings = self.run, self._readings
        return TangentRun(
            interval=self._interval,
            growth=readings.growth,
            impacts=readings.impacts,
            section=readings.motions,
            total_impacts=self._record.impacts + self._batched_impacts,
            # Without impacts all modes decay, so the bound on abs(p) holds from now on.
            is_quiet=run.reach_m < min(run.specimen.gaps_m),
            final_state=run.motion,
            end_time_s=run.time_s,
            outcome=self._outcome,
        )


def follow_courses(courses: Sequence[TangentCourse]) -> None:
    """Integrate motions to their ends, alone or in SIMD batches if the specimen allows it."""
    alike = defaultdict[tuple[Specimen, float], list[TangentCourse]](list)
    for each in courses:
        if is_batchable(each.run.specimen, each.run.tolerance):
            alike[each.run.specimen, each.run.tolerance].append(each)
        else:
            each.follow()
    for group in alike.values():
        while under_way := [each for each in group if not each.is_over]:
            ready = [(each, periods) for each in under_way if (periods := each.batch_periods) > 0]
            if ready:
                found = follow_batch([each.run for each, _ in ready], [periods for _, periods in ready])
                for (each, _), motion in zip(ready, found, strict=True):
                    each.note(motion)
            for each in under_way:
                if each.batch_periods == 0:
                    each.follow(1)


def _parts(specimen: Specimen, interval_s: float) -> int:
    """Return how many parts an interval needs for the tangent vectors to stay numerically independent."""
    modes = modal_form(specimen).rates
    turns, decays = float(np.max(np.abs(modes))), float(np.max(-modes.real))
    return max(1, math.ceil(interval_s * max(turns / LONGEST_TURN, decays / LONGEST_DECAY)))


# Time at which a run settles into its final type of motion, and transient chaos before. SI units.
#
# After thousands of impacts, m1 may never touch its stops again (Grebogi, Ott and Yorke, Physica D 7 (1983)
# 181). An exponent averaged over such a run describes neither the chaos nor the final motion.

SAME_STATE, NEARLY_SAME = 1e-6, 1e-3
"""Relative change of state per cycle: a motion repeats below the first limit, changes above the second."""
LONGEST_CYCLE = 16
"""Longest detected cycle of a periodic motion, in intervals."""
SURE = 3.0
"""Distance of a mean growth rate from zero, in standard errors, above which its sign is significant."""
CHANGED = 5.0
"""Smallest significant difference between mean growth before and after a change, in standard errors. It is
larger than SURE, because the time of the change is chosen to make the difference largest."""
FEWEST_INTERVALS = 32
"""Smallest number of intervals from which mean growth and its error are estimated."""
ALIGNING = 8
"""Number of intervals in which an initial tangent vector turns to the direction of fastest growth."""


class FinalMotion(StrEnum):
    """Kind of the final motion of a run, compared with the preceding motion."""

    QUIET = "no impact will follow: the linear motion"
    PERIODIC = "a periodic motion"
    SETTLED = "a motion of another kind than before"
    THROUGHOUT = "the motion of the whole run"


@dataclass(frozen=True)
class Settling:
    """Kind of the final motion of a run, and the interval in which this motion begins."""

    motion: FinalMotion
    since: int
    """Number of intervals before the final motion begins."""
    cycle: int = 0
    """Number of intervals in a cycle of a periodic motion."""


def settling(run: TangentRun, scales: Floats) -> Settling:
    """Return a run's final motion and the interval in which it begins; ``scales`` as from `state_scales`."""
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
    """Return the interval after which mean growth is no longer significantly positive, or None."""
    count = len(growth)
    if count < 2 * FEWEST_INTERVALS or not bool(np.all(np.isfinite(growth))):
        return None
    places = np.arange(FEWEST_INTERVALS, count - FEWEST_INTERVALS + 1)
    sums = np.cumsum(growth)
    before, after = sums[places - 1] / places, (sums[-1] - sums[places - 1]) / (count - places)
    # Split the series so that the squared deviations from the two means have the smallest sum.
    place = int(places[np.argmax((before - after) * np.sqrt(places * (count - places)))])
    head, tail = block_mean(growth[:place]), block_mean(growth[place:])
    is_falling = head.mean > SURE * head.standard_error and tail.mean <= SURE * tail.standard_error
    apart = CHANGED * math.hypot(head.standard_error, tail.standard_error)
    return place if is_falling and head.mean - tail.mean > apart else None
