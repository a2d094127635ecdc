"""Whether a motion seen once a period has settled: it repeats after k periods, or keeps its statistics."""

from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
from scipy.stats import kendalltau

from ..excitation.feedback import Settling
from ..instruments import Samples
from ..recording import Steadiness
from .stroboscope import Phasors

_THIRDS = 3
_FEWEST_TURNS = 2
"""Repetitions of a long period in each third of the window, so that a third has a mean."""
_SURE = 2.0
"""Standard uncertainties that a figure must stay away from its limit."""
_CERTAIN = 5.0
"""Standard errors of a mean above which it is none of noise."""
_BLOCKS = 12
"""Stretches that a stationarity test compares."""
_SIGNIFICANCE = 0.01 / 8
"""Of one test; eight statistics are tested, so that a steady motion fails once in a hundred times."""
_NOISE_MARGIN = 1.5
"""The noise of a channel is taken that much larger than it was in silence."""
_SLOWEST = 0.9
"""Largest ratio of two changes that is extrapolated; slower ones count ninefold."""


@dataclass(frozen=True)
class Judgement:
    """What a series of periods says about the motion; shares of its rms size."""

    steadiness: Steadiness
    period: int
    """After how many drive periods it repeats; 0 when it does not."""
    scatter: float
    """Rms distance of the points from their means, at that period (or at period 1)."""
    scatter_u: float
    """Standard uncertainty of it."""
    noise: float
    """What the channel's own noise makes of the scatter; nothing smaller can be seen."""
    remaining: float
    """How far the means have still to go, extrapolated; for an aperiodic motion how far they went."""


def judged(points: Phasors, rule: Settling, noise: float = 0.0) -> Judgement:
    """Judge the newest periods of a motion.

    Parameters
    ----------
    points
        Fourier coefficients of each drive period, shape (periods, orders).
    noise
        Rms of them in silence, all orders together; unit of the points.

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
        figures = _clustered(points[-window:], period, noise)
        if period > 1 and not _differ(points[-window:], period, _allowed(figures, rule.tolerance)):
            continue
        if period == 1:
            unsettled = replace(figures, steadiness=Steadiness.UNSETTLED, period=0)
        if _repeats(figures, rule.tolerance):
            return figures
    if len(points) >= rule.aperiodic_periods and unsettled.scatter > _allowed(unsettled, rule.tolerance):
        return _stationary(points[-rule.aperiodic_periods :], unsettled)
    return unsettled


def in_drives(found: Judgement, points: Phasors, drives: int, noise: float) -> Judgement:
    """Count the period in drives, of which each of the ``points`` is so many long.

    A motion that repeats after one drive has nothing but noise at the orders in between, however weak a
    subharmonic may be beside the rest. A hum that silence shows as well is noise.
    """
    between = points[:, np.arange(points.shape[1]) % drives != 0]
    mean = between.mean(axis=0)
    error = sqrt(float(np.sum(np.abs(between - mean) ** 2))) / len(points)
    by_chance = hypot(_CERTAIN * error, _NOISE_MARGIN * noise)
    repeats_at_once = found.period == 1 and np.linalg.norm(mean) <= by_chance
    return replace(found, period=1 if repeats_at_once else found.period * drives)


def _clustered(points: Phasors, period: int, noise: float) -> Judgement:
    """Measure the clusters that points make which lie a whole number of ``period`` apart."""
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
    """Whether the clusters of a longer period lie further apart than one cluster may be wide."""
    centres = points.reshape(-1, period, points.shape[1]).mean(axis=0)
    away = centres - centres.mean(axis=0)
    size = float(np.mean(np.sum(np.abs(points) ** 2, axis=1)))
    return sqrt(float(np.sum(np.abs(away) ** 2)) / period / size) > allowed


def _remaining(early: float, late: float, by_chance: float) -> float:
    """Extrapolate two changes of a mean as a geometric series, unless chance explains the last one."""
    if late <= _SURE * by_chance:
        return late
    ratio = min(late / early, _SLOWEST) if early > 0 else _SLOWEST
    return late * max(1.0, ratio / (1 - ratio))


def _repeats(figures: Judgement, tolerance: float) -> bool:
    allowed = _allowed(figures, tolerance)
    # The means of thirds differ by chance as well; noise is allowed to them as far as it explains that.
    return figures.scatter + _SURE * figures.scatter_u <= allowed and figures.remaining <= allowed


def _allowed(figures: Judgement, tolerance: float) -> float:
    """Give the scatter up to which a motion repeats as far as can be seen."""
    return hypot(tolerance, _NOISE_MARGIN * figures.noise)


def _stationary(points: Phasors, found: Judgement) -> Judgement:
    """Test whether the statistics of blocks keep still: no trend, and no step between the halves."""
    length = len(points) // _BLOCKS
    blocks = points[len(points) - length * _BLOCKS :].reshape(_BLOCKS, length, -1)
    # Beside the mean, unless a single order is judged.
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
    """Kendall's rank correlation with time (the reverse-arrangements test of Bendat and Piersol)."""
    if float(np.ptp(figure)) == 0.0:
        return True
    return float(kendalltau(np.arange(len(figure)), figure).pvalue) > _SIGNIFICANCE


def _halves_agree(figure: Samples) -> bool:
    """Compare the means of both halves with the spread inside them."""
    first, second = np.array_split(figure, 2)
    spread = sqrt((float(first.var(ddof=1)) + float(second.var(ddof=1))) / len(first))
    # Student's t at 0.125 % (two-sided) with ten degrees of freedom.
    return abs(float(first.mean() - second.mean())) <= 4.4 * spread
