"""Windows (tapers) of segments, and the number of independent averages with overlap."""

from enum import StrEnum

import numpy as np

from ..errors import InvalidRequest
from .arrays import Flags, Reals


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
    return _COSINES[window_by_name(window)]


def window_by_name(window: Window | str) -> Window:
    """Return the window with this name; raises InvalidRequest for unknown names."""
    try:
        return Window(window)
    except ValueError as unknown:
        allowed = ", ".join(Window)
        raise InvalidRequest(f"window {window!r} is not known; use one of {allowed}") from unknown


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
    """Return the number of correlated neighbouring lines of a windowed spectrum: for values, and for squares.

    Errors of lines k apart have the correlation |W(k) / W(0)|, with W the transform of the squared window.
    """
    squared = taper(window, 256) ** 2
    correlation = np.abs(np.fft.fft(squared)) / np.sum(squared)
    return float(np.sum(correlation)), float(np.sum(correlation**2))
