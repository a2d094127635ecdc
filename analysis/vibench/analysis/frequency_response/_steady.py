"""The scatter of a line from few averages, steadied by its neighbours."""

from math import ceil

import numpy as np

from ..signals import Complexes, Flags, Reals

_ENOUGH_FREEDOM = 24.0
"""Degrees of freedom of a line's variance with which it is known to a third."""
_FREEDOM = 96.0
"""Of the two noises that are found over neighbouring lines; the smaller one shows in a part of these only."""
_ROUNDS = 8


def steady_relative_sd(relative_sd: Reals, value: Complexes, power: Reals, freedom: float) -> Reals:
    """Give the standard deviation of ln(magnitude) with which lines are weighted in a fit.

    One of two realisations is now and then a hundredth of the true one: as a weight it takes a few lines for
    the whole truth. What is level over neighbouring lines is the noise of the two sensors, not the relative
    scatter: y - H x has a + b |H|^2, and the base moves little where the specimen pulls at it. Both are found
    over lines enough, by maximum likelihood of variances that are chi-square distributed.

    Parameters
    ----------
    relative_sd
        As each line tells it for itself, shape (lines,).
    value
        Response over drive H, in the units in which the sensors' noise is level; shape (lines,).
    power
        Mean square of the drive that the estimates rest on, to any scale, shape (lines,).
    freedom
        Degrees of freedom of each line's own variance.

    """
    if freedom >= _ENOUGH_FREEDOM:
        return relative_sd
    gain = np.abs(value) ** 2
    lines = min(ceil(_FREEDOM / freedom), gain.size)
    with np.errstate(invalid="ignore"):
        variance = relative_sd**2 * gain * power
    known = np.isfinite(variance) & (variance > 0)
    around = np.clip(np.arange(gain.size) - lines // 2, 0, gain.size - lines)[:, None] + np.arange(lines)
    own, other = _two_noises(np.where(known, variance, 0.0)[around], gain[around], known[around])
    # A square over a variance of n degrees of freedom is n / (n - 2) on average, Student's.
    wider = lines * freedom / (lines * freedom - 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(known, np.sqrt(wider * (own + other * gain) / (gain * power)), np.nan)


def _two_noises(variance: Reals, gain: Reals, known: Flags) -> tuple[Reals, Reals]:
    """Give a and b of variance = a + b gain, none below zero, for each row of neighbours."""
    level, about = (np.maximum(each.mean(axis=1, keepdims=True), 1e-300) for each in (variance, gain))
    variance, gain = variance / level, gain / about
    own = other = np.full((len(gain), 1), 0.5)
    for _ in range(_ROUNDS):
        weight = np.where(known, 1 / np.maximum(own + other * gain, 1e-9) ** 2, 0.0)
        ones, slope, square, mean, along = (
            np.sum(weight * each, axis=1, keepdims=True)
            for each in (np.ones_like(gain), gain, gain**2, variance, gain * variance)
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            determinant = ones * square - slope**2
            own = (square * mean - slope * along) / determinant
            other = (ones * along - slope * mean) / determinant
            only_own, only_other = ~(other > 0), ~(own > 0)
            own, other = (
                np.where(only_own, mean / ones, np.where(only_other, 0.0, own)),
                np.where(only_own, 0.0, np.where(only_other, along / square, other)),
            )
    return (own * level)[:, 0], (other * level / about)[:, 0]
