"""Whether a series could be linear noise: surrogates with its spectrum and its values, and nothing else."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from ..signals.arrays import Reals
from .divergence import embedded, neighbours_apart

SURROGATES = 39
"""The smallest statistic of 40 then has a chance of 1/40 = 0.025 if the series is linear noise."""
_DELAYS, _NEIGHBOURS = 4, 10
"""Values that make a past, and similar pasts that foretell the next value."""
_ITERATIONS = 200
_SETTLED = 1e-8
_LAGS = (1, 2, 3, 4)
_SPECTRUM_KEPT = 0.05
"""Relative error of a surrogate's spectrum up to which it stands for the series."""


@dataclass(frozen=True)
class SurrogateTest:
    """A series against linear noise with the same spectrum and the same values."""

    statistic: float
    surrogates: tuple[float, ...]
    spectrum_error: float
    """Largest relative error of a surrogate's spectrum."""
    least_margin: float = 0.0
    """Margin below which the statistic is due to chance."""

    @property
    def margin(self) -> float:
        """How far the statistic lies below the surrogates' mean, in their standard deviations."""
        away = float(np.mean(self.surrogates)) - self.statistic
        return away / max(float(np.std(self.surrogates, ddof=1)), np.finfo(np.float64).tiny)

    @property
    def p(self) -> float:
        """Chance of a statistic as small as this if the series were linear noise (one-sided rank)."""
        smaller = sum(each <= self.statistic for each in self.surrogates)
        return (smaller + 1) / (len(self.surrogates) + 1)

    @property
    def is_valid(self) -> bool:
        """Whether the surrogates took over the spectrum; if not, their test says nothing."""
        return self.spectrum_error <= _SPECTRUM_KEPT

    @property
    def rejects_linear_noise(self) -> bool:
        """Whether the series is more than linear noise."""
        is_lowest = self.p <= 1 / (len(self.surrogates) + 1)
        return self.is_valid and is_lowest and self.margin >= self.least_margin


def surrogate(series: Reals, rng: np.random.Generator) -> tuple[Reals, float]:
    """Make one surrogate: the series' values in an order that has its spectrum, else at random.

    Schreiber and Schmitz, Phys. Rev. Lett. 77 (1996) 635 (iterated amplitude-adjusted Fourier transform).

    Returns
    -------
    The surrogate, shape of ``series``, and the relative error of its spectrum (root mean square).

    """
    values = np.sort(series)
    wanted = np.abs(np.fft.rfft(series - series.mean()))
    scale = float(np.sqrt(np.mean(wanted**2)))
    shuffled = rng.permutation(series)
    error = np.inf
    for _ in range(_ITERATIONS):
        spectrum = np.fft.rfft(shuffled - shuffled.mean())
        before = error
        error = float(np.sqrt(np.mean((np.abs(spectrum) - wanted) ** 2))) / scale
        if before - error < _SETTLED:
            break
        turned = np.fft.irfft(wanted * np.exp(1j * np.angle(spectrum)), series.size)
        shuffled = values[np.argsort(np.argsort(turned))]
    return shuffled, error


def prediction_error(series: Reals) -> float:
    """Say how badly each value is foretold by what followed the most similar pasts, over the scatter.

    Zeroth-order nonlinear prediction (Kantz and Schreiber, Nonlinear Time Series Analysis (2004), section
    4.2), the mean over neighbours: far below 1 where the past decides the future, near 1 where it does not.
    One neighbour, and fewer delays, left more of the chaos among impacts undecided.
    """
    pasts, next_values = embedded(series, _DELAYS)[:-1], series[_DELAYS:]
    # Pasts that share values with the one in question are no neighbours of it.
    index, nearest = neighbours_apart(pasts, _DELAYS, _NEIGHBOURS)
    has = nearest.any(axis=1)
    foretold = np.sum(next_values[index[has]] * nearest[has], axis=1) / np.sum(nearest[has], axis=1)
    miss = next_values[has] - foretold
    return float(np.sqrt(np.mean(miss**2)) / np.std(series))


def time_symmetry(series: Reals) -> float:
    """Return the skewness of a series' increments, root mean square over lags of 1 to 4, with a minus sign.

    Linear noise is symmetric in time, also behind any static nonlinearity; dissipative chaos seldom is
    (Schreiber and Schmitz, Physica D 142 (2000) 346, section 5).
    """
    rises = [series[lag:] - series[:-lag] for lag in _LAGS]
    skewness = [np.mean(each**3) / np.mean(each**2) ** 1.5 for each in rises]
    return -float(np.sqrt(np.mean(np.square(skewness))))


def surrogate_test(
    series: Reals, statistic: Callable[[Reals], float] = prediction_error, *, seed: int = 0
) -> SurrogateTest:
    """Compare a statistic, which is small for determinism, with that of surrogates.

    Parameters
    ----------
    series
        Shape (n,), taken once per drive period.
    statistic
        `prediction_error` or `time_symmetry`.
    seed
        Of the surrogates.

    """
    matched = _with_matching_ends(series)
    rng = np.random.default_rng(seed)
    made = [surrogate(matched, rng) for _ in range(SURROGATES)]
    return SurrogateTest(
        statistic=statistic(matched),
        surrogates=tuple(statistic(each) for each, _ in made),
        spectrum_error=max(error for _, error in made),
    )


def gaussianised(series: Reals) -> Reals:
    """Replace values by normal ones of the same rank: this undoes a static, monotone nonlinearity of noise.

    Surrogates with the distorted values themselves match the spectrum only after iterations.
    """
    rank = np.argsort(np.argsort(series))
    return np.asarray(ndtri((rank + 0.5) / series.size))


def _with_matching_ends(series: Reals) -> Reals:
    """Cut a few values off so that the end joins the beginning: a jump there would pass for noise."""
    most = max(1, series.size // 10)
    heads = series[:most]
    tails = series[series.size - most :]
    slopes_head = series[1 : most + 1] - heads
    slopes_tail = np.diff(series[series.size - most - 1 :])
    gap = np.abs(heads[:, np.newaxis] - tails) + np.abs(slopes_head[:, np.newaxis] - slopes_tail)
    head, tail = np.unravel_index(int(np.argmin(gap)), gap.shape)
    return series[int(head) : series.size - most + int(tail) + 1]
