"""Standard deviations, bounds and significance levels of averaged estimates."""

import numpy as np
import scipy

from .arrays import Complexes, Reals

DEFAULT_CONFIDENCE = 0.95
_SMALLEST_DEGREES_OF_FREEDOM = 1e-3
"""Minimum degrees of freedom, which keeps the quantile finite for few averages."""


def relative_sd(coherence: Reals, n_eff: float) -> Reals:
    """Return the standard deviation of ln(magnitude), and equally of the phase [rad].

    sqrt((1 - g2) / (2 g2 n_eff)) for h1 and h2 (Bendat & Piersol, Random Data, 4th ed., section 9.2) and also
    for hv: Fuller's variance of a regression with errors in both variables is the same expression. Infinite
    where the coherence is zero.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1 - coherence) / (2 * coherence * n_eff)))


def student_half_width(relative: Reals, n_eff: float, confidence: float) -> Reals:
    """Return the half width of the two-sided bounds of a relative error with estimated scatter.

    Given the drive, h1 is a regression with 2 (n - 1) real residual degrees of freedom, so each component is
    Student-distributed. The unbiased variance divides by n - 1.
    """
    freedom = max(2 * (n_eff - 1), _SMALLEST_DEGREES_OF_FREEDOM)
    quantile = float(scipy.stats.t.ppf((1 + confidence) / 2, freedom))
    return np.asarray(quantile * relative * np.sqrt(n_eff / max(n_eff - 1, _SMALLEST_DEGREES_OF_FREEDOM)))


def standard_uncertainty(values: Reals | Complexes) -> float:
    """Return the standard uncertainty of the mean of a few values; twice this value covers 95 % of cases.

    The uncertainty is the standard error times the ratio of Student's t to the normal deviate (JCGM 100:2008,
    G.3.2). For complex values, this applies to the real and to the imaginary part separately.
    """
    count, parts = values.size, 2 if np.iscomplexobj(values) else 1
    error = float(np.std(values, ddof=1)) / np.sqrt(parts * count)
    beyond = (1 - DEFAULT_CONFIDENCE) / 2
    return float(error * scipy.stats.t.isf(beyond, parts * (count - 1)) / scipy.stats.norm.isf(beyond))


def magnitude_bounds(magnitude: Reals, half_width: Reals) -> tuple[Reals, Reals]:
    """Return the bounds of a magnitude, symmetric on a logarithmic scale.

    ln(magnitude) is unbiased to second order in the error (the radial and the tangential part cancel); the
    magnitude itself is biased.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        lower = magnitude * np.exp(-half_width)
        upper = magnitude * np.exp(half_width)
    return np.asarray(lower), np.asarray(np.where(np.isfinite(upper), upper, np.inf))


def phase_half_width(half_width: Reals) -> Reals:
    """Return the half width of a phase's bounds [rad]: arcsin of the relative half width, pi above 1.

    The part of the estimate perpendicular to the true direction is Student-distributed for any magnitude
    (Fieller), so the arcsine is exact, not a linearisation.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(half_width < 1, np.arcsin(np.minimum(half_width, 1)), np.pi))


def coherence_significance(n_eff: float, confidence: float) -> float:
    """Return the coherence that independent noises exceed with probability a = 1 - ``confidence``.

    It is 1 - a^(1/(n - 1)) (Carter, Knapp & Nuttall 1973, IEEE Trans. Audio Electroacoust. 21, 337-344).
    """
    if n_eff <= 1:
        return 1.0
    return float(-np.expm1(np.log1p(-confidence) / (n_eff - 1)))


def chi_square_bounds(density: Reals, n_eff: float, confidence: float) -> tuple[Reals, Reals]:
    """Return bounds of an averaged spectral density: chi-square with 2 n_eff degrees of freedom."""
    freedom = 2 * n_eff
    high = float(scipy.stats.chi2.ppf((1 + confidence) / 2, freedom))
    low = float(scipy.stats.chi2.ppf((1 - confidence) / 2, freedom))
    return np.asarray(density * freedom / high), np.asarray(density * freedom / low)


_ONE_IN = 1e-3
"""Fraction of correct models that exceed the limit of chi square."""


def chi_square_of(squared: Reals, n_eff: float) -> Reals:
    """Return chi square (2 degrees of freedom) of a line from ``squared``, the sum of two squared residuals.

    Each residual (real and imaginary part, say) is divided by its standard deviation from n averages, so half
    the sum follows F(2, nu), nu = 2 (n - 1). The chi square with the same probability is
    nu ln(1 + squared / nu): twice the negative logarithm of Student's likelihood, times nu / (nu + 2).
    """
    freedom = max(2 * (n_eff - 1), 1.0)
    return np.asarray(freedom * np.log1p(squared / freedom))


def chi_square_limit(freedom: int, lines_like_one: float = 1.0) -> float:
    """Return chi square per degree of freedom that one correct model in a thousand exceeds."""
    independent = max(freedom / lines_like_one, 1.0)
    return float(scipy.stats.chi2.isf(_ONE_IN, independent) / independent)
