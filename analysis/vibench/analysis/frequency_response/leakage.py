"""What the window of averaged segments does to lines: it smears a mode, and neighbouring errors correlate.

Segments of w(t) r(t), w(t) x(t) and w(t) y(t) with y = h * x, and G the density of r and x, average to the
quotient of the convolutions of |W|^2 with G H and with G. Its error is R* V / (R* X), with the residual
V = Y - H X of a segment: noise n of the sensors, windowed by w, and what a segment lacks of ringing,
dH/df times x windowed by w' / (2 pi i).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..signals.arrays import Complexes, Integers, Reals
from ..signals.window import Window, cosine_weights, hop_samples, taper
from .results import FrequencyResponse

_PROXY_SAMPLES = 1024
"""Length of the window that correlations are computed on; they do not depend on it."""
_FAR_LINES = 12
"""Lines apart at which errors of cosine windows, overlapping or not, have nothing in common."""
_NEAR = 0.05
"""Size of an exponent below which a series is more exact than the closed form."""
_LEAST_NOISE = 0.02
"""Of a line's variance that is taken as noise: the correlations of ringing alone may be singular."""


@dataclass(frozen=True)
class Leakage:
    """The effect of a window, its overlap and its length on a transmission."""

    segment_s: float
    window: Window
    noise: Reals
    """Correlation of the errors that the sensors' noise makes k lines apart, shape (far lines,)."""
    ringing: Reals
    """Covariance of those that cut-off ringing makes, per |dH/df|^2 and relative variance [Hz^2]."""

    def smeared_pole(self, frequency_hz: Reals, pole: complex, slope_per_hz: Reals | Complexes) -> Complexes:
        """Give what averages show of 1 / (i w - s), s = `pole` [rad/s].

        With the autocorrelation r of the window over its segment T, T I(z), z = (s - i w) T and
        I(z) = integral of r(t) exp(z t) over 0 to 1, where the base's density is level; its relative slope
        g [1/Hz] adds g i / (2 pi) (-1 - z I).
        """
        scaled = (pole - 2j * np.pi * frequency_hz) * self.segment_s
        # Lines are whole turns apart in a segment, and so are the orders of a window.
        rest = complex(np.expm1(pole * self.segment_s))
        integral = np.zeros_like(scaled)
        for order, falling, level in zip(*_autocorrelation(self.window), strict=True):
            once, twice = _exponentials(scaled + 2j * np.pi * order, rest)
            integral += falling * twice + level * once
        return np.asarray(
            self.segment_s * integral - slope_per_hz * 1j / (2 * np.pi) * (1 + scaled * integral)
        )

    def rung(self, line: Integers, value: Complexes, spread: Reals) -> Complexes:
        """Give the standard deviation of either part of a line's error from cut-off ringing, along dH/df.

        Parameters
        ----------
        line
            Numbers of the lines, rising.
        value, spread
            Of the transmission there; the standard deviation of either part of it bounds the result.

        """
        ringing = np.gradient(value) / np.gradient(line / self.segment_s) * np.sqrt(self.ringing[0])
        most, size = np.sqrt(1 - _LEAST_NOISE) * spread, np.abs(ringing)
        return np.asarray(ringing * np.divide(most, size, out=np.ones_like(size), where=size > most))

    def covariance(self, line: Integers, rung: Complexes, spread: Reals) -> Complexes:
        """Give the covariance of either part of the lines' errors, lower bands, shape (far lines, lines)."""
        noise = np.sqrt(spread**2 - np.abs(rung) ** 2)
        alike = self.ringing / (self.ringing[0] or 1.0)
        bands = np.zeros((_FAR_LINES, line.size), dtype=np.complex128)
        for off in range(min(_FAR_LINES, line.size)):
            here, there = slice(0, line.size - off), slice(off, None)
            apart = line[there] - line[here]
            near = apart < _FAR_LINES
            apart = np.where(near, apart, 0)
            noisy = self.noise[apart] * noise[here] * noise[there]
            bands[off, here] = near * (noisy + alike[apart] * rung[there] * np.conj(rung[here]))
        return bands


def leakage_of(found: FrequencyResponse) -> Leakage | None:
    """Give that of a transmission; None where whole periods leave none."""
    if found.resolution_hz == 0.0:
        return None
    how = found.settings
    window, segment_s = Window(how.window), how.segment_samples / how.sample_rate_hz
    noise, ringing = _line_correlations(window, how.overlap, found.segments_used)
    # Half of a complex variance in either part, averaged; w' counts per second, the slope per hertz.
    scale = 1 / (8 * np.pi**2 * found.n_eff * segment_s**2)
    return Leakage(segment_s, window, noise, scale * ringing)


@lru_cache(maxsize=16)
def _line_correlations(window: Window, overlap: float, segments: int) -> tuple[Reals, Reals]:
    """Sum what segments j hops apart share of errors k lines apart.

    Sum over j of (1 - |j| / K) conj(c_j(k)) d_j(k): c_j(k), of the reference, transforms w(n) w(n + j D);
    d_j(k) is the same for noise, and that of w' for ringing.
    """
    values = taper(window, _PROXY_SAMPLES)
    weights = cosine_weights(window)
    turns = 2 * np.pi * np.arange(_PROXY_SAMPLES) / _PROXY_SAMPLES
    slope = np.zeros(_PROXY_SAMPLES)
    for order, weight in enumerate(weights):
        slope -= 2 * np.pi * order * weight * np.sin(order * turns)
    hop = hop_samples(_PROXY_SAMPLES, overlap)
    noise, ringing = np.zeros(_FAR_LINES), np.zeros(_FAR_LINES)
    for lag in range(0, min(_PROXY_SAMPLES, segments * hop), hop):
        share = (1 if lag == 0 else 2) * (1 - lag / hop / segments)
        here, there = slice(0, _PROXY_SAMPLES - lag), slice(lag, None)
        reference = np.fft.fft(values[here] * values[there], _PROXY_SAMPLES)[:_FAR_LINES]
        rung = np.fft.fft(slope[here] * slope[there], _PROXY_SAMPLES)[:_FAR_LINES]
        noise += share * np.abs(reference) ** 2
        ringing += share * np.real(np.conj(reference) * rung)
    return noise / noise[0], ringing / noise[0]


@lru_cache(maxsize=8)
def _autocorrelation(window: Window) -> tuple[Reals, Reals, Complexes]:
    """Give r(t) = sum over b of exp(2 pi i b t) (f_b (1 - t) + g_b): b, f_b and g_b.

    Of w = sum of c_b exp(2 pi i b t), f_b = c_b^2 and g_b = c_b sum over a != b of c_a / (pi i (a - b)).
    """
    half = np.array(cosine_weights(window))
    half[1:] /= 2
    weights = np.concatenate((half[:0:-1], half))
    order = np.arange(weights.size) - float(half.size - 1)
    apart = order - order[:, None]
    np.fill_diagonal(apart, np.inf)
    level = weights * np.sum(weights / apart, axis=1) / (1j * np.pi)
    energy = float(weights @ weights)
    return np.asarray(order, dtype=np.float64), weights**2 / energy, np.asarray(level / energy)


def _exponentials(exponent: Complexes, rest: complex) -> tuple[Complexes, Complexes]:
    """Integrate exp(q t) and (1 - t) exp(q t) over 0 to 1, from q and `rest` = exp(q) - 1."""
    near = np.abs(exponent) < _NEAR
    q = np.where(near, 1.0, exponent)
    once, small = rest / q, np.where(near, exponent, 0.0)
    first = 1 + small / 2 * (1 + small / 3 * (1 + small / 4 * (1 + small / 5)))
    second = 0.5 * (1 + small / 3 * (1 + small / 4 * (1 + small / 5 * (1 + small / 6))))
    return np.where(near, first, once), np.where(near, second, (once - 1) / q)
