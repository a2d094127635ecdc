"""By how much noise lifts the largest value of a window: a maximum is never unbiased."""

from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, ndtr

from ..signals.arrays import Reals

_REACH_SD = 7.0
"""Noise beyond this many standard deviations does not decide a maximum (1e-12 a sample)."""
_GRID = 141
"""Ten points per standard deviation: the integral is then good to 1e-3 of one."""


class NoiseLift(NamedTuple):
    """What noise does to a maximum; never negative, and NaN where the noise is not known."""

    bias: float
    """E[max |x_j + n_j|] - max |x_j|."""
    error: float
    """Root mean square of max |x_j + n_j| - max |x_j|: the bias, and the scatter about it."""


def noise_lift(samples: Reals, noise_sd: float, independent: float) -> NoiseLift:
    """Return the rise of max|x| by Gaussian noise, as it is expected, and as root mean square.

    From the distribution of the largest, P(max < z) = prod_j P(|x_j + n_j| < z), where x_j is the largest
    of each run of samples that share one noise value; of noise alone over 51 200 samples it comes to 4.4
    standard deviations. The samples stand for the true motion although they may hold the noise already.

    Parameters
    ----------
    samples
        The motion x, shape (samples,).
    noise_sd
        Standard deviation of the noise on it [same unit]; NaN where it is not known.
    independent
        Independent noise values in the window, at most the number of samples; for coloured noise
        twice its rms frequency times the duration.

    """
    if np.isnan(noise_sd):
        return NoiseLift(np.nan, np.nan)
    if noise_sd <= 0 or samples.size == 0:
        return NoiseLift(0.0, 0.0)
    run = max(1, round(samples.size / max(independent, 1.0)))
    size = np.maximum.reduceat(np.abs(samples), np.arange(0, samples.size, run))
    top = float(np.max(size))
    near = size[size > top - 2 * _REACH_SD * noise_sd]
    low = max(0.0, top - _REACH_SD * noise_sd)
    level = np.linspace(low, top + _REACH_SD * noise_sd, _GRID)
    near, counts = _binned(near, noise_sd)
    above = (level[:, np.newaxis] - near) / noise_sd
    below = (-level[:, np.newaxis] - near) / noise_sd
    # ln(F(above) - F(below)) without losing the small tail.
    inside = log_ndtr(above) + np.log1p(-np.minimum(ndtr(below) / ndtr(above), 1 - 1e-16))
    left = 1 - np.exp(inside @ counts)
    rise = level - top
    bias = float(rise[0] + np.trapezoid(left, level))
    square = float(rise[0] ** 2 + np.trapezoid(2 * rise * left, level))
    # The integrals are good to 1e-3 of the noise; no maximum is lowered by it, or is surer than its bias.
    bias = max(bias, 0.0)
    return NoiseLift(bias, float(np.sqrt(max(square, bias**2))))


def _binned(values: Reals, noise_sd: float) -> tuple[Reals, Reals]:
    """Merge values much closer together than the noise, so that long windows cost no more than short ones."""
    step = noise_sd / 20
    places, counts = np.unique(np.round(values / step), return_counts=True)
    return places * step, counts.astype(np.float64)
