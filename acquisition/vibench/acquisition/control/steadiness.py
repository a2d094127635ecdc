"""Test whether a motion, sampled once per period, repeats after k periods or has steady statistics."""

from collections import deque
from dataclasses import dataclass, replace
from math import hypot, pi, sqrt

import numpy as np
import scipy
from numpy.typing import NDArray

from ..excitation.plan import Settling
from ..instruments import Samples
from ..recording import Steadiness

# One sample of the motion consists of its Fourier coefficients over one drive period. The recorded drive
# shows when each drive period begins, although the generator has a separate clock.

_MEMORY = 40
"""Number of blocks whose phases are fitted by a line; the slope of the line gives the drive frequency."""


class DriveClock:
    """Frequency and phase of one tone, estimated from the recorded drive channel.

    The clocks of generator and converter differ by about ten parts in a million: a tenth of a cycle after
    40 s at 260 Hz. The commanded frequency is therefore only approximate. The phase of every block is fitted,
    and a line through the phases gives the frequency.
    """

    def __init__(self, near_hz: float, sample_rate_hz: float) -> None:
        self._near_hz = near_hz
        self._rate_hz = sample_rate_hz
        self._centres_s: deque[float] = deque(maxlen=_MEMORY)
        self._phases: deque[float] = deque(maxlen=_MEMORY)
        self.frequency_hz = near_hz
        """Present estimate of the drive frequency, by the converter's clock [Hz]."""
        self.phase_cycles = 0.0
        """Phase of the drive's sine at sample 0, in cycles modulo 1."""

    def follow(self, drive: Samples, first_sample: int) -> None:
        """Add a block of the drive signal, at least two periods long, in any unit, shape (samples,)."""
        count = len(drive)
        centre_s = (first_sample + 0.5 * (count - 1)) / self._rate_hz
        offset_s = (np.arange(count) - 0.5 * (count - 1)) / self._rate_hz
        angle = 2 * pi * self._near_hz * offset_s
        basis = np.stack([np.sin(angle), np.cos(angle), np.ones(count)], axis=1)
        solution = np.linalg.lstsq(basis, drive)[0]
        # Phase c [cycles] at the block's centre, relative to a sine of the nominal frequency.
        turns = float(np.arctan2(solution[1], solution[0])) / (2 * pi) - self._near_hz * centre_s
        before = self._phases[-1] if self._phases else turns
        turns = before + (turns - before + 0.5) % 1.0 - 0.5
        self._centres_s.append(centre_s)
        self._phases.append(turns)
        self._draw_line()

    def starts_s(self, first_s: float, last_s: float) -> Samples:
        """Return the times from ``first_s`` to ``last_s`` at which the drive rises through zero [s]."""
        first = np.ceil(self.frequency_hz * first_s + self.phase_cycles - 1e-6)
        last = np.floor(self.frequency_hz * last_s + self.phase_cycles)
        return np.asarray((np.arange(first, last + 1) - self.phase_cycles) / self.frequency_hz)

    def _draw_line(self) -> None:
        centre_s, phase = np.array(self._centres_s), np.array(self._phases)
        mean_s, mean = float(centre_s.mean()), float(phase.mean())
        away_s = centre_s - mean_s
        spread = float(away_s @ away_s)
        slope = float(away_s @ (phase - mean)) / spread if spread > 0 else 0.0
        self.frequency_hz = self._near_hz + slope
        self.phase_cycles = mean - slope * mean_s


Phasors = NDArray[np.complex128]

ORDERS = 5
"""Number of Fourier orders of a period: mean and four harmonics, enough to distinguish periods."""


@dataclass(frozen=True, eq=False)
class Periods:
    """Fourier coefficients of the motion, one row per period, which is one or several drive periods long.

    Phases are relative to an upward zero crossing of the drive, so that the coefficient of a sine is real. If
    a period has several drive periods, the crossing of any of them may be the reference.
    """

    base: Phasors
    """Base coefficients at the drive frequency, in the unit of the channel, shape (periods,)."""
    response: Phasors
    """Response coefficients of orders 0 to 4, in the unit of the channel, shape (periods, 5)."""

    @property
    def count(self) -> int:
        """Number of periods stored here."""
        return len(self.base)

    def last(self, count: int) -> "Periods":
        """Return the newest ``count`` periods of the motion."""
        return Periods(self.base[-count:], self.response[-count:])


class Stroboscope:
    """Splitter of samples into periods of ``drives`` drive periods; keeps the rest for the next block."""

    def __init__(self, near_hz: float, sample_rate_hz: float, drives: int = 1) -> None:
        self._rate_hz = sample_rate_hz
        self._drives = drives
        self.clock = DriveClock(near_hz, sample_rate_hz)
        self._left = np.empty((3, 0))
        self._first = 0
        self._begun_s: float | None = None
        self._base: list[Phasors] = []
        self._response: list[Phasors] = []

    def add(self, first_sample: int, drive: Samples, base: Samples, response: Samples) -> None:
        """Add a block that follows the last block without a gap; each channel has the shape (samples,)."""
        block = np.stack([drive, base, response])
        if self._left.size == 0:
            self._first = first_sample
        self._left = np.concatenate([self._left, block], axis=1)
        self.clock.follow(drive, first_sample)
        start_s = self._first / self._rate_hz if self._begun_s is None else self._begun_s
        end_s = (self._first + self._left.shape[1] - 1) / self._rate_hz
        starts_s = self.clock.starts_s(start_s - 0.25 / self.clock.frequency_hz, end_s)
        starts_s = starts_s[starts_s >= self._first / self._rate_hz][:: self._drives]
        if len(starts_s) < 2:
            return
        within = (starts_s - self._first / self._rate_hz) * self._rate_hz
        turns = self.clock.frequency_hz / self._rate_hz
        self._base.append(_orders(self._left[1], within, turns, 2)[:, 1])
        self._response.append(_orders(self._left[2], within, turns / self._drives, ORDERS))
        self._keep_from(starts_s[-1])

    def periods(self) -> Periods:
        """Return all periods that were added since the last discard."""
        if not self._base:
            return Periods(np.empty(0, np.complex128), np.empty((0, ORDERS), np.complex128))
        return Periods(np.concatenate(self._base), np.concatenate(self._response))

    def forget(self) -> None:
        """Discard all periods so far, after a change of the drive."""
        self._base.clear()
        self._response.clear()

    @staticmethod
    def noise_of(signal: Samples, frequency_hz: float, sample_rate_hz: float) -> float:
        """Return the rms noise of a channel in silence at the `ORDERS` of ``frequency_hz``."""
        turns = frequency_hz / sample_rate_hz
        count = int((len(signal) - 1) * turns)
        if count < 1:
            return 0.0
        coefficients = _orders(signal, np.arange(count + 1) / turns, turns, ORDERS)
        away = coefficients[:, 1:]
        mean = coefficients[:, 0] - coefficients[:, 0].mean()
        return float(np.sqrt(np.mean(np.sum(np.abs(away) ** 2, axis=1) + np.abs(mean) ** 2)))

    def _keep_from(self, start_s: float) -> None:
        self._begun_s = start_s
        # Keep one more sample, because the next block may move the estimated start of a period earlier.
        keep = max(0, int(start_s * self._rate_hz) - 1 - self._first)
        self._left = self._left[:, keep:]
        self._first += keep


def _orders(signal: Samples, starts: Samples, turns: float, orders: int) -> Phasors:
    """Return the Fourier coefficients over each period that begins at ``starts`` (in fractional samples).

    Between two samples, the integral is interpolated by a cubic from its values and slopes at both samples. A
    period therefore need not be a whole number of samples. ``turns`` are cycles per sample.
    """
    sample = np.arange(len(signal))
    low = np.minimum(starts.astype(np.int64), len(signal) - 2)
    part = starts - low
    found = np.empty((len(starts) - 1, orders), np.complex128)
    length = np.diff(starts)
    for order in range(orders):
        rotated: Phasors = np.asarray(signal * np.exp(-2j * pi * order * turns * sample), np.complex128)
        integral = np.concatenate([[0.0], np.cumsum(0.5 * (rotated[1:] + rotated[:-1]))])
        at_starts = _hermite(integral, rotated, low, part)
        scale = 1.0 if order == 0 else 2.0
        # With the factor 1j, a sine of amplitude A that begins with the period has the coefficient A.
        turned = np.exp(2j * pi * order * turns * starts[:-1]) * (1j if order else 1.0)
        found[:, order] = scale * np.diff(at_starts) / length * turned
    return found


def _hermite(value: Phasors, slope: Phasors, low: NDArray[np.int64], part: Samples) -> Phasors:
    left, right = value[low], value[low + 1]
    at_left, at_right = slope[low], slope[low + 1]
    return np.asarray(
        (1 + 2 * part) * (1 - part) ** 2 * left
        + part * (1 - part) ** 2 * at_left
        + part**2 * (3 - 2 * part) * right
        + part**2 * (part - 1) * at_right
    )


_THIRDS = 3
_FEWEST_TURNS = 2
"""Smallest number of repetitions of a period in each third of the window."""
_SURE = 2.0
"""Number of standard uncertainties by which a value must differ from its limit."""
_CERTAIN = 5.0
"""Number of standard errors above which a mean is not explained by noise."""
_BLOCKS = 12
"""Number of blocks compared by a test of stationarity."""
_SIGNIFICANCE = 0.01 / 8
"""Significance level of each of eight tests, so that a stationary motion fails in 1 % of cases."""
_NOISE_MARGIN = 1.5
"""Safety factor on the noise measured in silence."""
_SLOWEST = 0.9
"""Largest ratio of two successive changes in an extrapolation; the remaining change is then nine times the
last change.
"""


@dataclass(frozen=True)
class Judgement:
    """Verdict on whether the motion has settled, and its period; values are relative to the motion's rms."""

    steadiness: Steadiness
    period: int
    """Number of drive periods after which the motion repeats; 0 if it does not."""
    scatter: float
    """Rms distance of the Fourier points from their cluster means; from a single mean if ``period`` is 0."""
    scatter_u: float
    """Standard uncertainty due to scatter, relative to the motion's rms."""
    noise: float
    """Part of the scatter explained by noise of the channel; a smaller scatter cannot be measured."""
    remaining: float
    """Extrapolated remaining change of the cluster means; for an aperiodic motion, their last change."""


def judgement_of(points: Phasors, rule: Settling, noise: float = 0.0) -> Judgement:
    """Return the verdict on a motion's newest periods by the criteria of ``rule``.

    ``points`` are the Fourier coefficients of each drive period, shape (periods, orders); ``noise`` is the
    total rms of all orders without drive, in the unit of the points.
    """
    unknown = float("nan")
    unsettled = Judgement(Steadiness.UNSETTLED, 0, unknown, unknown, unknown, unknown)
    if not np.any(points):
        return unsettled  # a channel without a signal shows no motion
    for period in range(1, rule.longest_period + 1):
        shortest = _THIRDS * _FEWEST_TURNS * period
        window = -(-max(rule.periods, shortest) // (_THIRDS * period)) * _THIRDS * period
        if len(points) < window:
            break
        figures = _clusters(points[-window:], period, noise)
        if period > 1 and not _differ(points[-window:], period, _limit(figures, rule.tolerance)):
            continue
        if period == 1:
            unsettled = replace(figures, steadiness=Steadiness.UNSETTLED, period=0)
        allowed = _limit(figures, rule.tolerance)
        # Noise also shifts the means of the window's thirds, so the limit for ``remaining`` includes noise.
        if figures.scatter + _SURE * figures.scatter_u <= allowed and figures.remaining <= allowed:
            return figures
    if len(points) >= rule.aperiodic_periods and unsettled.scatter > _limit(unsettled, rule.tolerance):
        return _stationary(points[-rule.aperiodic_periods :], unsettled)
    return unsettled


def in_drives(found: Judgement, points: Phasors, drives: int, noise: float) -> Judgement:
    """Convert the period of a judgement to drive periods; each of ``points`` spans ``drives`` drive periods.

    The motion repeats after one drive period if the orders between the harmonics of the drive contain only
    noise. Hum that is also present in silence counts as noise.
    """
    between = points[:, np.arange(points.shape[1]) % drives != 0]
    mean = between.mean(axis=0)
    error = sqrt(float(np.sum(np.abs(between - mean) ** 2))) / len(points)
    by_chance = hypot(_CERTAIN * error, _NOISE_MARGIN * noise)
    repeats_at_once = found.period == 1 and np.linalg.norm(mean) <= by_chance
    return replace(found, period=1 if repeats_at_once else found.period * drives)


def _clusters(points: Phasors, period: int, noise: float) -> Judgement:
    turns = len(points) // period
    clusters = points.reshape(turns, period, -1)
    size = sqrt(float(np.mean(np.sum(np.abs(points) ** 2, axis=1))))
    away = clusters - clusters.mean(axis=0)
    freedom = period * (turns - 1)
    scatter = sqrt(float(np.sum(np.abs(away) ** 2)) / freedom) / size
    thirds = clusters.reshape(_THIRDS, turns // _THIRDS, period, -1).mean(axis=1)
    early, late = (
        sqrt(float(np.sum(np.abs(thirds[n + 1] - thirds[n]) ** 2)) / period) / size for n in range(2)
    )
    by_chance = scatter * sqrt(2 * _THIRDS / turns)
    return Judgement(
        Steadiness.PERIODIC,
        period,
        scatter,
        scatter / sqrt(2 * freedom),
        noise / size,
        _remaining(early, late, by_chance),
    )


def _differ(points: Phasors, period: int, allowed: float) -> bool:
    """Return whether the clusters of a longer period are further apart than the scatter of one cluster."""
    centres = points.reshape(-1, period, points.shape[1]).mean(axis=0)
    away = centres - centres.mean(axis=0)
    size = float(np.mean(np.sum(np.abs(points) ** 2, axis=1)))
    return sqrt(float(np.sum(np.abs(away) ** 2)) / period / size) > allowed


def _remaining(early: float, late: float, by_chance: float) -> float:
    """Extrapolate the change of a mean as a geometric series; return the last change if it may be random."""
    if late <= _SURE * by_chance:
        return late
    ratio = min(late / early, _SLOWEST) if early > 0 else _SLOWEST
    return late * max(1.0, ratio / (1 - ratio))


def _limit(figures: Judgement, tolerance: float) -> float:
    """Return the largest scatter with which a motion still counts as periodic."""
    return hypot(tolerance, _NOISE_MARGIN * figures.noise)


def _stationary(points: Phasors, found: Judgement) -> Judgement:
    """Return the judgement from block statistics: stationary if the blocks show neither trend nor step."""
    length = len(points) // _BLOCKS
    blocks = points[len(points) - length * _BLOCKS :].reshape(_BLOCKS, length, -1)
    # Use order 1; if only one order is judged, use this order.
    fundamental = blocks[:, :, min(1, blocks.shape[2] - 1)].mean(axis=1)
    power = np.log(np.mean(np.sum(np.abs(blocks) ** 2, axis=2), axis=1))
    away = blocks - blocks.mean(axis=1, keepdims=True)
    scatter = np.log(np.mean(np.sum(np.abs(away) ** 2, axis=2), axis=1))
    figures = (power, scatter, fundamental.real, fundamental.imag)
    keeps_still = all(_has_no_trend(figure) and _halves_agree(figure) for figure in figures)
    size = sqrt(float(np.mean(np.sum(np.abs(points) ** 2, axis=1))))
    went = abs(fundamental[_BLOCKS // 2 :].mean() - fundamental[: _BLOCKS // 2].mean()) / size
    steadiness = Steadiness.APERIODIC if keeps_still else Steadiness.UNSETTLED
    return Judgement(steadiness, 0, found.scatter, found.scatter_u, found.noise, float(went))


def _has_no_trend(figure: Samples) -> bool:
    """Return whether Kendall's tau finds no trend (reverse-arrangements test of Bendat and Piersol)."""
    if float(np.ptp(figure)) == 0.0:
        return True
    return float(scipy.stats.kendalltau(np.arange(len(figure)), figure).pvalue) > _SIGNIFICANCE


def _halves_agree(figure: Samples) -> bool:
    first, second = np.array_split(figure, 2)
    spread = sqrt((float(first.var(ddof=1)) + float(second.var(ddof=1))) / len(first))
    # The factor 4.4 is Student's t for a two-sided probability of 0.125 % and ten degrees of freedom.
    return abs(float(first.mean() - second.mean())) <= 4.4 * spread
