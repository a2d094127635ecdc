"""The scatter of a line from few averages, steadied by its neighbours."""

from math import ceil

import numpy as np

from ..signals.arrays import Complexes, Reals

_ENOUGH_FREEDOM = 24.0
"""Degrees of freedom of a line's variance with which it is known to a third."""
_FREEDOM = 96.0
"""Of the noises that are found over neighbouring lines: a small one shows in a part of these only."""
_FEWEST_FREEDOM = 4.0
"""Of all lines together, below which neighbours tell no more than the line."""
_ROUNDS = 40
_NOTHING = 1e-300
_FAINT = 1e-12
"""Of a variance, or of a shape, over what its neighbours have on average."""


def steady_relative_sd(relative_sd: Reals, value: Complexes, power: Reals, freedom: float) -> Reals:
    """Give the standard deviation of ln(magnitude) with which lines are weighted in a fit.

    One of two realisations is now and then a hundredth of the true one: as a weight it takes a few lines for
    the whole truth. What is level over neighbouring lines is not the relative scatter, but the noise of both
    sensors, and that of the base itself: y - H x has a + b |H|^2 + c |dH|^2, with dH from line to line, since
    what does not repeat leaks by as much as a resonance rings on. They are found over lines enough, by
    maximum likelihood of variances that are chi-square distributed.

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
    # Averages that overlap nearly wholly are worth hardly more than one.
    freedom = max(freedom, 1.0)
    lines = min(ceil(_FREEDOM / freedom), value.size)
    if freedom >= _ENOUGH_FREEDOM or lines * freedom <= _FEWEST_FREEDOM:
        return relative_sd
    gain = np.abs(value) ** 2
    with np.errstate(invalid="ignore"):
        variance = relative_sd**2 * gain * power
        steps = np.nan_to_num(np.abs(np.gradient(value)) ** 2)
    known = np.isfinite(variance)
    shapes = np.where(known, [np.ones_like(gain), gain, steps], 0.0)
    # Stretches overlap by half; between their middles sizes are interpolated.
    last = value.size - lines
    firsts = np.append(np.arange(0, last, max(lines // 2, 1)), last)
    around = firsts[:, None] + np.arange(lines)
    sizes = _sizes(np.where(known, variance, 0.0)[around], shapes[:, around])
    places, middles = np.arange(value.size), firsts + (lines - 1) / 2
    smooth = sum(np.interp(places, middles, size) * shape for size, shape in zip(sizes, shapes, strict=True))
    # A square over a variance of n degrees of freedom is n / (n - 2) on average, Student's.
    wider = lines * freedom / (lines * freedom - 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(known, np.sqrt(wider * smooth / (gain * power)), np.nan)


def _sizes(variance: Reals, shapes: Reals) -> Reals:
    """Give how much of each shape a row of variances holds, shape (shapes, rows); none is below zero.

    Fevotte, Bertin and Durrieu 2009 (Neural Comput. 21, 793-830): their updates raise the likelihood of
    chi-square distributed values in every round.
    """
    level = np.maximum(variance.mean(axis=1), _NOTHING)[:, None]
    heights = np.maximum(shapes.mean(axis=2, keepdims=True), _NOTHING)
    variance, shapes = variance / level, shapes / heights
    sizes = np.full((*shapes.shape[:2], 1), 1 / len(shapes))
    for _ in range(_ROUNDS):
        inverse = 1 / np.maximum(np.sum(sizes * shapes, axis=0), _FAINT)
        seen = np.sum(shapes * variance * inverse**2, axis=2, keepdims=True)
        sizes = sizes * np.sqrt(seen / np.maximum(np.sum(shapes * inverse, axis=2, keepdims=True), _FAINT))
    return np.asarray(sizes * level / heights)[..., 0]
