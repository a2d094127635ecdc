"""Sampled signals: windows, envelopes, integration, interpolation, confidence bounds.

Arrays are float64 of shape (samples,). Signals are integrated and differentiated within a band in the
frequency domain; the number of disturbed samples at the ends is returned too. Bounds of averaged estimates
follow Bendat & Piersol, Random Data. Band-limited signals are interpolated to nine digits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, lru_cache
from math import ceil
from typing import ClassVar, TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import fft
from scipy.special import i0

from vibench.sim.engine.run import native_engine

from .errors import InvalidRequest
from .tables import Tabular

Reals = NDArray[np.float64]
Samples = NDArray[np.floating]
"""Real numbers in double or single precision."""
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
PER_NEPER_DB = 20 / np.log(10)


def runs_of(flags: Flags) -> Integers:
    """Return the first index and one past the last index of each run of set flags, shape (runs, 2)."""
    changes = np.diff(flags.astype(np.int8), prepend=0, append=0)
    return np.flatnonzero(changes).reshape(-1, 2)


DEFAULT_BINS = 1500
"""Default number of bins, more than the horizontal pixels of a figure."""


@dataclass(frozen=True)
class Envelope(Tabular):
    """Extremes of a signal in equal intervals of time (bins); arrays of shape (bins,)."""

    OWN_UNITS: ClassVar = {"lower": "{unit}", "upper": "{unit}"}

    time_s: Reals
    """Time at the centre of each bin."""
    lower: Reals
    upper: Reals


def envelope(
    samples: Samples, sample_rate_hz: float, *, bins: int = DEFAULT_BINS, start_s: float = 0.0
) -> Envelope:
    """Reduce a signal, shape (samples,), to its extremes in at most ``bins`` equal intervals, without NaN."""
    length = max(1, -(-samples.size // bins))
    starts = np.arange(0, samples.size, length)
    middle = np.minimum(starts + 0.5 * length, samples.size) / sample_rate_hz
    return Envelope(start_s + middle, np.fmin.reduceat(samples, starts), np.fmax.reduceat(samples, starts))


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


REACH = 32
"""Number of samples on each side used for one interpolated value."""
TRUSTED_BAND = 0.4
"""Fraction of the sample rate up to which the interpolation is accurate to about 1e-9."""

_KAISER_BETA = 19.9
"""Parameter of the Kaiser window for 64 taps and a transition from 0.4 to 0.6 of the sample rate: 189 dB."""
_PHASES = 512
"""Number of tabulated fractions of a sample interval; cubic interpolation in this table errs by 1e-10."""


@cache
def _weights_of_phases() -> Reals:
    """Return the windowed sinc at every tap, for fractions from one step below 0 to one step above 1."""
    fraction = np.arange(-1, _PHASES + 2, dtype=np.float64) / _PHASES
    distance = fraction[:, np.newaxis] - np.arange(1 - REACH, REACH + 1)
    shape = np.sqrt(np.maximum(1 - (distance / REACH) ** 2, 0.0))
    window = np.where(np.abs(distance) <= REACH, i0(_KAISER_BETA * shape) / i0(_KAISER_BETA), 0.0)
    # The computed sine of a multiple of pi is not exactly zero, so set the values at samples exactly.
    sinc = np.where(distance == np.rint(distance), distance == 0.0, np.sinc(distance))
    return np.asarray(sinc * window)


def interpolate(samples: Reals, positions: Reals) -> Reals:
    """Evaluate a signal at fractional sample positions by a Kaiser-windowed sinc.

    Returns an array of shape (m,) or (channels, m), exact to about 1e-9 of the signal up to `TRUSTED_BAND`
    of the sample rate.

    Parameters
    ----------
    samples
        Shape (n,) or (channels, n). The signal is assumed zero outside, so values within `REACH` of an end
        are wrong unless the signal is zero there.
    positions
        Positions to evaluate, in samples from the first one, shape (m,).
    """
    channels = np.ascontiguousarray(np.atleast_2d(samples), dtype=np.float64)
    values = np.empty((len(channels), positions.size))
    engine = native_engine()
    work = engine.new(
        "Interpolation",
        samples=channels,
        channels=len(channels),
        table=_weights_of_phases(),
        positions=np.ascontiguousarray(positions, dtype=np.float64),
        values=values,
    )
    engine.call("interpolate", work)
    return values.reshape(*samples.shape[:-1], positions.size)


_CLOSE = 0.125
"""Spacing of the interpolated values around a maximum, in samples; the parabola's error is at most 1e-6."""


def sizes_with_maxima(samples: Reals) -> Reals:
    """Return |value| of every sample, or of an interpolated maximum next to the sample, shape (n,).

    At 16 samples per period, the largest sample may be 2 % below the maximum.

    Parameters
    ----------
    samples
        Band-limited signal, shape (n,); maxima within `REACH` of its ends are not interpolated.
    """
    size = np.abs(samples)
    middle = size[REACH:-REACH]
    top = REACH + np.flatnonzero(
        (middle >= size[REACH - 1 : -REACH - 1]) & (middle >= size[REACH + 1 : size.size - REACH + 1])
    )
    # With less than four samples per period, neighbours of a maximum may have the opposite sign.
    at, _ = _vertices(*(np.sign(samples[top]) * samples[top + each] for each in (-1, 0, 1)))
    near = np.concatenate([top + at + each for each in (-_CLOSE, 0.0, _CLOSE)])
    _, largest = _vertices(*np.abs(interpolate(samples, near)).reshape(3, -1))
    size[top] = np.maximum(size[top], largest)
    return size


def _vertices(before: Reals, middle: Reals, after: Reals) -> tuple[Reals, Reals]:
    """Return the maxima of parabolas through three points: positions (0 is the middle point) and values."""
    slope, bend = (after - before) / 2, before + after - 2 * middle
    at = np.clip(-slope / np.minimum(bend, -np.finfo(np.float64).tiny), -1.0, 1.0)
    return at, middle + at * slope / 2


_TOGETHER = 8
_STOP_DB = 100.0
"""Attenuation of aliases [dB], below the noise of a 24-bit converter."""
TRUSTED_FRACTION = 0.4
"""Fraction of the decimated rate up to which the gain is 1 within 1e-5."""


class Decimator:
    """Low-pass filter that keeps every n-th sample; output sample k is at the time of input sample k n."""

    def __init__(self, channels: int, factor: int) -> None:
        if factor < 1:
            raise InvalidRequest(f"a decimation factor of {factor} was requested; give 1 or more")
        self._factor = factor
        taps = _taps(factor)
        self._half = (taps.size - 1) // 2
        # The engine sums eight products at a time; padding gets zero weight.
        self._taps = np.concatenate([np.zeros(-taps.size % _TOGETHER), taps])
        # Half of the filter's taps need later samples. Before the first sample, assume zeros.
        self._pending = np.zeros((channels, self._taps.size - 1 - self._half if factor > 1 else 0))
        self._received = 0
        self._given = 0

    def add(self, block: Reals) -> Reals:
        """Add samples (channels, n); return the output samples that are now complete, shape (channels, m)."""
        self._received += block.shape[1]
        if self._factor == 1:
            return block
        return self._filter(np.concatenate((self._pending, block), axis=1))

    def finish(self) -> Reals:
        """Return the last output samples; after the end, the input is assumed to be zero."""
        if self._factor == 1:
            return self._pending
        zeros = np.zeros((self._pending.shape[0], self._half))
        data = self._filter(np.concatenate((self._pending, zeros), axis=1))
        left = -(-self._received // self._factor) - (self._given - data.shape[1])
        return data[:, : max(left, 0)]

    def _filter(self, data: Reals) -> Reals:
        count = (data.shape[1] - self._taps.size) // self._factor + 1
        if count <= 0:
            self._pending = data
            return data[:, :0]
        engine, result = native_engine(), np.empty((data.shape[0], count))
        # The first output sample has the time of the first input sample.
        first = {"ratio": self._factor, "origin": -self._factor}
        for means, samples in zip(data, result, strict=True):
            fields = {"table": self._taps, "reach": self._taps.size, "means": means, "samples": samples}
            engine.call("decimate", engine.new("Decimation", **first, **fields))
        self._pending = data[:, count * self._factor :].copy()
        self._given += count
        return result


def _taps(factor: int) -> Reals:
    """Return a Kaiser low-pass (edge at 0.4 to 0.6 of the new rate); factor divides half its length."""
    if factor == 1:
        return np.ones(1)
    width = 2 * (1 - 2 * TRUSTED_FRACTION) / factor
    count, beta = scipy.signal.kaiserord(_STOP_DB, width)
    half = ceil(count / 2 / factor) * factor
    return np.asarray(scipy.signal.firwin(2 * half + 1, 1 / factor, window=("kaiser", beta)))


class Quantity(StrEnum):
    """Displacement, velocity or acceleration."""

    DISPLACEMENT = "displacement"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"

    @property
    def derivatives(self) -> int:
        """Order of the time derivative of displacement: 0, 1 or 2."""
        return list(Quantity).index(self)


@dataclass(frozen=True)
class ConvertedSignal:
    """A converted signal, with the number of disturbed samples at its ends."""

    OWN_UNITS: ClassVar = {"samples": "{unit}", "settled": "{unit}"}

    samples: Reals
    """Converted samples, shape (samples,) [m, m/s or m/s2]."""
    sample_rate_hz: float
    quantity: Quantity
    low_hz: float
    high_hz: float
    """Lower and upper end of the frequency band of the converted signal [Hz]."""
    edge_samples: int
    """Number of samples at each end that the conversion disturbs."""

    @property
    def settled(self) -> Reals:
        """Converted samples without the disturbed ends."""
        return self.samples[self.edge_samples : self.samples.size - self.edge_samples]


_TRANSITION = 0.5
"""Width of a band edge, as a fraction of the edge frequency; narrower edges ring longer."""
_EDGE_PERIODS = 6
"""Periods of the lower band edge after which its ringing is below 1e-3 of the disturbance."""
_ROW_SAMPLES = 1024
"""Number of samples of a steady line per computed exponential; a product takes a tenth of its time."""
hann = lru_cache(maxsize=4)(np.hanning)
"""Hann window of a given length, shared by all lines and all draws; do not change its values."""


def derivative_factor(frequency_hz: Reals, power: int) -> Complexes:
    """Return (i w)^power, which differentiates a spectrum; a negative power integrates, with NaN at 0 Hz."""
    omega = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    if power >= 0:
        return np.asarray(omega**power)
    at_rest = omega == 0
    return np.asarray(np.where(at_rest, complex(np.nan, np.nan), np.where(at_rest, 1, omega) ** power))


def converted_signal(
    samples: Reals,
    sample_rate_hz: float,
    *,
    given: Quantity,
    wanted: Quantity,
    low_hz: float,
    high_hz: float,
    lines_hz: Sequence[float] = (),
) -> ConvertedSignal:
    """Integrate or differentiate a signal within a band, without drift or the trapezoidal gain error.

    The spectrum of the whole signal is multiplied by (i w)^n and by a band with cosine edges. Each edge is
    half as wide as its frequency and lies outside the band; the band itself is unchanged. A straight line is
    subtracted first, so that offset and slow drift do not ring at the ends.

    Parameters
    ----------
    samples
        Shape (samples,), real.
    low_hz, high_hz
        The band to keep, 0 < low < high <= half the sample rate; choose ``low_hz`` well below the
        lowest line of interest and above the drift.
    lines_hz
        Frequencies of steady lines, if known. Lines in the band are converted in closed form, because a line
        cut off at an end would ring by 3e-4 at the band edge.
    """
    if not 0 < low_hz < high_hz <= sample_rate_hz / 2:
        raise InvalidRequest(
            f"the band is {low_hz:g} to {high_hz:g} Hz; it must start above 0 and end at or below "
            f"{sample_rate_hz / 2:g} Hz, half the sample rate"
        )
    edge = min(disturbed_samples(sample_rate_hz, low_hz), samples.size // 2)
    padded = fft.next_fast_len(samples.size + edge, real=True)
    frequency_hz = fft.rfftfreq(padded, 1 / sample_rate_hz)
    rest, steady = samples, np.zeros(samples.size)
    power = wanted.derivatives - given.derivatives
    for line_hz in (each for each in lines_hz if low_hz <= each <= high_hz):
        line = steady_line(rest, line_hz / sample_rate_hz)
        rest = rest - line.samples()
        steady += line.samples(complex(derivative_factor(np.array(line_hz), power)))
    centred = np.arange(rest.size) - 0.5 * (rest.size - 1)
    slope = float(centred @ rest) / max(float(centred @ centred), 1.0)
    spectrum = fft.rfft(rest - np.mean(rest) - slope * centred, padded)
    spectrum[0] = 0.0
    spectrum[1:] *= derivative_factor(frequency_hz[1:], power)
    spectrum[1:] *= _band(frequency_hz[1:], low_hz, high_hz)
    result = np.asarray(fft.irfft(spectrum, padded, overwrite_x=True)[: samples.size])
    return ConvertedSignal(result + steady, sample_rate_hz, wanted, low_hz, high_hz, edge)


@dataclass(frozen=True, eq=False)
class SteadyLine:
    """Steady sine of known frequency: real part of a phasor that is the product of row and column factors."""

    rows: Complexes
    """Phasor at the first sample of every row, shape (rows,)."""
    columns: Complexes
    """Rotation of the phasor within a row, shape (samples of a row,)."""
    count: int

    def samples(self, factor: complex = 1.0) -> Reals:
        """Return the samples of the sine, with its phasor multiplied by ``factor``; shape (count,)."""
        rows = factor * self.rows
        # A product of real matrices takes a quarter of the time that a product of complex matrices takes.
        whole = np.stack([rows.real, -rows.imag], axis=1) @ np.stack([self.columns.real, self.columns.imag])
        return np.asarray(whole.ravel()[: self.count])


def steady_line(samples: Reals, cycles_per_sample: float, beyond: int = 0) -> SteadyLine:
    """Return the steady sine of known frequency in a signal, continued by ``beyond`` samples at both ends."""
    turn = 2j * np.pi * cycles_per_sample
    columns = np.exp(turn * np.arange(_ROW_SAMPLES))
    rows = np.exp(turn * np.arange(0, samples.size, _ROW_SAMPLES))
    taper = hann(samples.size)
    tapered = np.zeros((rows.size, _ROW_SAMPLES))
    tapered.ravel()[: samples.size] = taper * samples
    in_rows = tapered @ np.stack([columns.real, columns.imag], axis=1)
    size = 2 * np.vdot(rows, in_rows[:, 0] - 1j * in_rows[:, 1]) / max(np.sum(taper), 1.0)
    from_start = np.arange(-beyond, samples.size + beyond, _ROW_SAMPLES)
    return SteadyLine(size * np.exp(turn * from_start), columns, samples.size + 2 * beyond)


def disturbed_samples(sample_rate_hz: float, low_hz: float) -> int:
    """Return the number of samples at each end that `converted_signal` disturbs."""
    return int(np.ceil(_EDGE_PERIODS * sample_rate_hz / low_hz))


def _band(frequency_hz: Reals, low_hz: float, high_hz: float) -> Reals:
    rise = (frequency_hz / low_hz - (1 - _TRANSITION)) / _TRANSITION
    fall = (1 + _TRANSITION - frequency_hz / high_hz) / _TRANSITION
    inside = np.clip(np.minimum(rise, fall), 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * inside))
