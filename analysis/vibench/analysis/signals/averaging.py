"""Windows of segments, and standard deviations and bounds of averaged estimates."""

from enum import StrEnum
from typing import TypeVar

import numpy as np
import scipy

from ..errors import InvalidRequest
from .arrays import Complexes, Flags, Reals


class Window(StrEnum):
    """Window applied to a segment before its Fourier transform."""

    HANN = "hann"
    """The default for noise: side lobes fall fast, 1.5 bins of noise bandwidth."""
    BOXCAR = "boxcar"
    """No taper; correct only for an integer number of periods."""
    FLAT_TOP = "flattop"
    """Accurate amplitude of a sine between bins, within 0.01 dB."""
    BLACKMAN_HARRIS = "blackmanharris"
    """Side lobes below -92 dB, for a small line next to a large one."""


_COSINES = {
    Window.HANN: (0.5, -0.5),
    Window.BOXCAR: (1.0,),
    Window.FLAT_TOP: (0.21557895, -0.41663158, 0.277263158, -0.083578947, 0.006947368),
    Window.BLACKMAN_HARRIS: (0.35875, -0.48829, 0.14128, -0.01168),
}
"""Weights of 1, cos(a), cos(2 a), ... with a over one turn (F. J. Harris, Proc. IEEE 66, 1978, 51-83; the
flat top as in D'Antona and Ferrero, Digital Signal Processing for Measurement Systems, 2006)."""


def taper(window: Window | str, samples: int) -> Reals:
    """Return a window in its periodic form, as used for spectra (``fftbins=True`` in scipy)."""
    if samples == 1:
        return np.ones(1)
    turns = np.arange(samples) / samples
    weights = enumerate(cosine_weights(window))
    return np.asarray(sum(w * np.cos(2 * np.pi * order * turns) for order, w in weights), dtype=np.float64)


def cosine_weights(window: Window | str) -> tuple[float, ...]:
    """Return the weights of 1, cos(a), cos(2 a), ... in a window."""
    return _COSINES[by_name(Window, window)]


E = TypeVar("E", bound=StrEnum)


def by_name(kind: type[E], name: E | str) -> E:
    """Return the member of ``kind`` with this name; raises InvalidRequest for unknown names."""
    try:
        return kind(name)
    except ValueError as unknown:
        what, allowed = kind.__name__.lower(), ", ".join(kind)
        raise InvalidRequest(f"{what} {name!r} is not known; use one of {allowed}") from unknown


def hop_samples(segment_samples: int, overlap: float) -> int:
    """Return the distance between the starts of segments; ``overlap`` is a fraction in [0, 1)."""
    if not 0 <= overlap < 1:
        raise InvalidRequest(f"overlap is {overlap:g}; it must be a fraction, from 0 to below 1")
    return segment_samples - int(overlap * segment_samples)


def effective_averages(values: Reals, hop: int, used: Flags) -> float:
    """Return the number of independent averages of overlapping, partly missing segments.

    n_eff = K / (1 + 2 sum_j (N_j / K) rho_j^2),  rho_j = sum_n w(n) w(n + jD) / sum_n w(n)^2

    (Welch 1967, IEEE Trans. Audio Electroacoust. 15, 70-73, with K - j replaced by N_j, the number of
    pairs of *used* segments that lie j hops apart, to account for gaps).

    Parameters
    ----------
    values
        The window w, shape (segment samples,).
    hop
        Distance D between the starts of neighbouring segments [samples].
    used
        Flags of the averaged segments, in the order of time.
    """
    count = int(np.count_nonzero(used))
    if count == 0:
        return 0.0
    energy = float(values @ values)
    excess = 0.0
    for lag in range(1, (values.size - 1) // hop + 1):
        pairs = int(np.count_nonzero(used[lag:] & used[:-lag]))
        correlation = float(values[: -lag * hop] @ values[lag * hop :]) / energy
        excess += pairs / count * correlation**2
    return count / (1 + 2 * excess)


def line_correlation(window: Window | str) -> tuple[float, float]:
    """Return how many neighbouring lines of a windowed spectrum are correlated: for values, and for squares.

    Errors of lines k apart have the correlation |W(k) / W(0)|, with W the transform of the squared window.
    """
    squared = taper(window, 256) ** 2
    correlation = np.abs(np.fft.fft(squared)) / np.sum(squared)
    return float(np.sum(correlation)), float(np.sum(correlation**2))


DEFAULT_CONFIDENCE = 0.95
_SMALLEST_DEGREES_OF_FREEDOM = 1e-3
"""Minimum degrees of freedom, which keeps the quantile finite for few averages."""


def relative_sd(coherence: Reals, n_eff: float) -> Reals:
    """Return the standard deviation of ln(magnitude), which equals that of the phase [rad].

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
    """Return the coherence that two independent noises exceed with probability a = 1 - ``confidence``.

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
