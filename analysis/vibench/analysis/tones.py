"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

The drive amplitude A0 of the paper, a base displacement [m], is computed from the recorded base acceleration.
The package also estimates the bias of a maximum due to noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import lcm
from typing import ClassVar, NamedTuple

import numpy as np
import scipy
from scipy.special import log_ndtr, ndtr

from .errors import InvalidRequest, UnusableData
from .signals import Complexes, Reals, derivative_factor, standard_uncertainty
from .spectra import AmplitudeSpectrum, SpectralDensity, amplitude_spectrum
from .tables import Tabular

ORDERS = (0.5, 1.0, 1.5, 2.0, 3.0)
"""Default orders; impacting systems respond at half orders too."""
ALL_ORDERS = (1 / 3, 0.5, 2 / 3, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
"""Orders with thirds and high harmonics, which need intervals of twelve drive cycles."""
_LARGEST_DENOMINATOR = 12
_BATCH_INTERVALS = 256
"""Number of intervals that are fitted at once, about 10 MB."""


def order_label(order: float) -> str:
    """Return the name of an order, such as ``"order 1/3"`` or ``"order 2"``."""
    return f"order {Fraction(order).limit_denominator(_LARGEST_DENOMINATOR)}"


def cycles_needed(orders: tuple[float, ...]) -> float:
    """Return the number of drive cycles per interval that is needed to separate these orders."""
    return 2 / float(min(np.diff((0.0, *sorted(orders)))))


@dataclass(frozen=True)
class TrackedOrders(Tabular):
    """Components of a signal at orders of the drive; signal = Re(sum value_k exp(i k phase)) + residual."""

    OWN_UNITS: ClassVar = {"value": "{unit}", "sd": "{unit}", "residual_rms": "{unit}", "amplitude": "{unit}"}

    orders: tuple[float, ...]
    value: Complexes
    """Complex amplitude (peak) at the middle of each interval, shape (orders, intervals)."""
    sd: Reals
    """Standard deviation of the magnitude for a white residual; shape (orders, intervals)."""
    residual_rms: Reals
    """RMS of the residual, shape (intervals,)."""

    @property
    def amplitude(self) -> Reals:
        """Amplitude of each order, |value|, shape (orders, intervals)."""
        return np.abs(self.value)

    def order(self, number: float) -> Complexes:
        """Return the complex amplitudes of one order, shape (intervals,)."""
        if number not in self.orders:
            raise InvalidRequest(f"order {number:g} was not tracked; tracked orders: {self.orders}")
        chosen: Complexes = self.value[self.orders.index(number)]
        return chosen

    @property
    def impacts(self) -> Reals:
        """Magnitude of orders 2 and 3 together, relative to order 1, shape (intervals,)."""
        return np.asarray(np.hypot(*np.abs([self.order(2.0), self.order(3.0)])) / np.abs(self.order(1.0)))


def track_orders(
    samples: Reals, phase_rad: Reals, *, interval_samples: int, orders: tuple[float, ...] = ORDERS
) -> TrackedOrders:
    """Track one signal; see `track_signals`."""
    (tracked,) = track_signals((samples,), phase_rad, interval_samples=interval_samples, orders=orders)
    return tracked


def track_signals(
    signals: Sequence[Reals],
    phase_rad: Reals,
    *,
    interval_samples: int,
    orders: tuple[float, ...] = ORDERS,
) -> tuple[TrackedOrders, ...]:
    """Fit all orders at once to each interval of signals, by least squares.

    With separate fits, orders would bias one another if an interval is not a whole number of *subharmonic*
    periods. A straight line and a linear change of order 1 are fitted too, so that sensor drift or a sweep
    through a resonance leaves no residual.

    Parameters
    ----------
    signals, phase_rad
        The signals and the drive phase at the same instants, each of shape (samples,); a remainder
        after the last whole interval is not used.
    interval_samples
        Samples per interval; at least two periods of the smallest distance between orders.
    """
    count = phase_rad.size // interval_samples
    if count == 0:
        raise InvalidRequest(
            f"the signal has {phase_rad.size} samples, less than one interval of {interval_samples}"
        )
    turns = abs(float(phase_rad[count * interval_samples - 1] - phase_rad[0])) / (2 * np.pi) / count
    needed = cycles_needed(orders)
    if turns < needed:
        raise InvalidRequest(
            f"an interval of {interval_samples} samples contains {turns:.1f} drive cycles; orders "
            f"{2 / needed:g} apart need at least {needed:g}: use longer intervals or fewer orders"
        )
    used = count * interval_samples
    cut = [each[:used].reshape(count, interval_samples) for each in signals]
    phase = phase_rad[:used].reshape(count, interval_samples)
    parts = []
    for first in range(0, count, _BATCH_INTERVALS):
        batch = slice(first, first + _BATCH_INTERVALS)
        parts.append(_fit(np.stack([each[batch] for each in cut], axis=2), phase[batch], orders))
    value, sd, residual = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    return tuple(TrackedOrders(orders, *each) for each in zip(value, sd, residual, strict=True))


def order_turns(phase_rad: Reals, orders: tuple[float, ...]) -> list[Complexes]:
    """Return exp(i order phase) for each order.

    Rational orders are computed as powers of one phasor, because products take a tenth of the time of sines.
    """
    fractions = [Fraction(order).limit_denominator(_LARGEST_DENOMINATOR) for order in orders]
    if min(orders) <= 0 or not np.allclose([float(each) for each in fractions], orders, rtol=1e-15, atol=0.0):
        return [np.exp(1j * order * phase_rad) for order in orders]
    together = lcm(*(each.denominator for each in fractions))
    powers = {1: np.exp(1j / together * phase_rad)}
    return [_power(int(each * together), powers) for each in fractions]


def _power(exponent: int, powers: dict[int, Complexes]) -> Complexes:
    """Return a power of ``powers[1]`` by repeated halving, with a cache."""
    if exponent not in powers:
        half = exponent // 2
        powers[exponent] = _power(half, powers) * _power(exponent - half, powers)
    return powers[exponent]


def _fit(signals: Reals, phase: Reals, orders: tuple[float, ...]) -> tuple[Complexes, Reals, Reals]:
    """Fit signals of shape (intervals, samples, signals); results have shape (signals, ..., intervals)."""
    samples, count = signals.shape[1], len(orders)
    *turned, first = order_turns(phase, (*orders, 1.0))
    rising = np.linspace(-1.0, 1.0, samples)
    changing = rising * first
    basis = np.empty((len(phase), 2 * count + 4, samples))
    for place, turn in enumerate(turned):
        basis[:, place], basis[:, count + place] = turn.real, turn.imag
    basis[:, -4], basis[:, -3], basis[:, -2], basis[:, -1] = changing.real, changing.imag, rising, 1.0
    normal = basis @ basis.transpose(0, 2, 1)
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError as singular:
        raise UnusableData(
            "the drive phase is constant in an interval, so orders cannot be separated there; "
            "leave out the parts without drive"
        ) from singular
    solution = inverse @ (basis @ signals)
    residual = signals - basis.transpose(0, 2, 1) @ solution
    squares = np.sum(residual**2, axis=1)
    value = solution[:, :count] - 1j * solution[:, count : 2 * count]
    diagonal = np.einsum("ikk->ik", inverse)
    mean = (diagonal[:, :count] + diagonal[:, count : 2 * count]) / 2
    variance = squares / max(1, samples - basis.shape[1])
    spread = np.sqrt(variance[:, np.newaxis] * mean[:, :, np.newaxis])
    return value.T, spread.T, np.sqrt(squares / samples).T


_NOISE_NEIGHBOURS = 50
"""Number of spectral lines on each side of a peak; the median of these lines is the noise floor."""
_LEAST_RATIO = 5.0
"""Smallest ratio of a peak to the noise floor."""


@dataclass(frozen=True)
class Peak:
    """A peak of a spectrum."""

    frequency_hz: float
    amplitude: float
    """Amplitude of the peak, corrected for its position between lines [unit of the spectrum]."""
    floor: float
    """Median amplitude of the spectral lines around the peak [unit of the spectrum]."""


def largest_peak(spectrum: AmplitudeSpectrum, low_hz: float, high_hz: float) -> Peak | None:
    """Return the largest peak of a Hann spectrum in a band; None if no peak stands above the noise.

    The band must be at least two lines away from 0 and from half the sample rate.
    """
    amplitude = spectrum.amplitude
    first = max(2, int(np.ceil(low_hz / spectrum.spacing_hz)))
    last = min(amplitude.size - 3, int(np.floor(high_hz / spectrum.spacing_hz)))
    if last < first:
        raise InvalidRequest(
            f"no line lies between {low_hz:g} and {high_hz:g} Hz; lines are {spectrum.spacing_hz:g} Hz apart"
        )
    found = scipy.signal.find_peaks(amplitude[first - 1 : last + 2])[0] + first - 1
    found = found[(found >= first) & (found <= last)]
    for line in found[np.argsort(-amplitude[found])].tolist():
        place, height = between_lines(amplitude, line)
        below = amplitude[max(1, line - _NOISE_NEIGHBOURS) : max(1, line - 3)]
        around = np.concatenate((below, amplitude[line + 4 : line + 1 + _NOISE_NEIGHBOURS]))
        floor = float(np.median(around)) if around.size else 0.0
        if height > _LEAST_RATIO * floor:
            return Peak(place * spectrum.spacing_hz, height, floor)
    return None


def between_lines(amplitude: Reals, line: int) -> tuple[float, float]:
    """Return position [lines] and amplitude of a sine between a line of a Hann spectrum and its neighbour.

    d = (2a - 1) / (a + 1) is the sine's distance from the larger line; a is the ratio of the smaller to the
    larger line (Grandke 1983, IEEE Trans. Instrum. Meas. 32, 350-355). The amplitude is the larger line times
    (pi d / sin(pi d)) (1 - d^2).
    """
    side = 1 if amplitude[line + 1] >= amplitude[line - 1] else -1
    ratio = amplitude[line + side] / amplitude[line]
    offset = (2 * ratio - 1) / (ratio + 1)
    return float(line + side * offset), float(amplitude[line] / np.sinc(offset) * (1 - offset**2))


_ITERATIONS = 10
_CONVERGED = 1e-13
_SEARCH = 0.2
"""Relative search range around the expected frequency."""
_MOST_BESIDE = 10.0
"""Largest amplitude of a sine outside the search range, such as mains hum, relative to the expected sine."""


@dataclass(frozen=True)
class FittedSine:
    """Fitted sine: amplitude * cos(2 pi frequency_hz t + phase_rad), with t = 0 at the first sample."""

    frequency_hz: float
    sd_frequency_hz: float
    amplitude: float
    phase_rad: float


def fit_sine(samples: Reals, sample_rate_hz: float, near_hz: float) -> FittedSine:
    """Fit a sine and a straight line by least squares, frequency included (IEEE Std 1057, four parameters).

    The straight line, which is not in the standard, absorbs the drift of a sensor.

    Raises UnusableData when no spectral line near ``near_hz`` stands above the noise, or when a sine at
    another frequency is ten times as large.

    Parameters
    ----------
    samples
        Signal of at least about ten cycles, shape (samples,).
    near_hz
        Expected frequency, within 20 %.
    """
    return _fit_cached(np.ascontiguousarray(samples, dtype=np.float64).tobytes(), sample_rate_hz, near_hz)


@lru_cache(maxsize=4)
def _fit_cached(recorded: bytes, sample_rate_hz: float, near_hz: float) -> FittedSine:
    """Fit a sine, with a cache, because all draws of a recording share its drive."""
    samples = np.frombuffer(recorded)
    spectrum = amplitude_spectrum(samples, sample_rate_hz)
    peak = largest_peak(spectrum, near_hz * (1 - _SEARCH), near_hz * (1 + _SEARCH))
    if peak is None:
        raise UnusableData(f"no sine was found near {near_hz:g} Hz; check the channel and the frequency")
    largest = largest_peak(spectrum, 0.0, sample_rate_hz)
    if largest is not None and largest.amplitude > _MOST_BESIDE * peak.amplitude:
        raise UnusableData(
            f"the largest sine is at {largest.frequency_hz:.6g} Hz, not near {near_hz:g} Hz; correct the "
            "planned frequency or the channel of the drive"
        )
    # If the time is zero in the middle, frequency and phase are uncorrelated: the fit is well conditioned.
    time = (np.arange(samples.size) - (samples.size - 1) / 2) / sample_rate_hz
    omega = 2 * np.pi * peak.frequency_hz
    for _ in range(_ITERATIONS):
        cosine, sine = np.cos(omega * time), np.sin(omega * time)
        basis = np.stack((cosine, sine, np.ones_like(time), time))
        a, b, *_line = np.linalg.solve(basis @ basis.T, basis @ samples)
        slope = time * (b * cosine - a * sine)
        full = np.concatenate((basis, slope[np.newaxis]))
        solution = np.linalg.solve(full @ full.T, full @ samples)
        omega += solution[-1]
        if abs(solution[-1]) < _CONVERGED * omega:
            break
    a, b = solution[0], solution[1]
    residual = samples - solution @ full
    variance = float(residual @ residual) / max(1, samples.size - 5)
    covariance = variance * np.linalg.inv(full @ full.T)
    return FittedSine(
        frequency_hz=float(omega / (2 * np.pi)),
        sd_frequency_hz=float(np.sqrt(covariance[-1, -1]) / (2 * np.pi)),
        amplitude=float(np.hypot(a, b)),
        phase_rad=float(np.angle((a - 1j * b) * np.exp(1j * omega * time[0]))),
    )


def steady_phase(samples: int, cycles_per_sample: float, phase_rad: float) -> Reals:
    """Return the phase of a steady sine at every sample [rad]."""
    return 2 * np.pi * cycles_per_sample * np.arange(samples, dtype=np.float64) + phase_rad


_SCATTER_BLOCKS = 10
"""Number of parts of the window; their scatter gives the uncertainty, including that of slow changes."""
_ORDERS = (1.0, 2.0, 3.0)
HIGHEST_ORDER = 0.45
"""Frequency of the highest order relative to the sample rate; aliases above it look like lower orders."""
_CLEAR = 5.0
"""Least ratio of the base's amplitude to its standard uncertainty; noise reaches it in one of 2,000 cases."""


@dataclass(frozen=True)
class DriveLevel:
    """Level of a sine drive."""

    frequency_hz: float
    sd_frequency_hz: float
    """Standard deviation of the frequency due to drive channel noise, relative to the converter clock."""
    phase_rad: float
    """Phase of the drive voltage, as a cosine, at the first sample."""
    amplitude_m: float
    """A0: displacement amplitude of the base at the drive frequency [m]."""
    sd_amplitude_m: float
    distortion: float
    """Displacement amplitude of orders 2 and 3 together, relative to order 1."""


@dataclass(frozen=True)
class NoiseDriveLevel:
    """Level of a noise drive within a band."""

    OWN_UNITS: ClassVar = {"rms_acceleration": "m s-2"}

    low_hz: float
    high_hz: float
    rms_acceleration: float
    """RMS acceleration of the base [m/s2]."""
    rms_displacement_m: float
    relative_sd: float
    """Relative standard deviation of both rms values, from the numbers of independent averages and lines."""


def drive_level(drive: Reals, base: Reals, sample_rate_hz: float, *, near_hz: float) -> DriveLevel:
    """Measure A0 of a dwell from drive voltage and base acceleration [m/s2], each of shape (samples,)."""
    sine = fit_sine(drive, sample_rate_hz, near_hz)
    phase = steady_phase(base.size, sine.frequency_hz / sample_rate_hz, sine.phase_rad)
    highest = max(1.0, HIGHEST_ORDER * sample_rate_hz / sine.frequency_hz)
    orders = tuple(order for order in _ORDERS if order <= highest)
    whole = track_orders(base, phase, interval_samples=base.size, orders=orders)
    parts = track_orders(base, phase, interval_samples=base.size // _SCATTER_BLOCKS, orders=orders)
    omega = 2 * np.pi * sine.frequency_hz
    lines = parts.order(1.0)
    if whole.amplitude[0, 0] < _CLEAR * standard_uncertainty(lines):
        raise UnusableData(
            f"the base acceleration has no sine at {sine.frequency_hz:.6g} Hz that is clear of its noise, so "
            "A0 and the responses are not determined; check the accelerometer, or raise the level"
        )
    scatter = standard_uncertainty(np.abs(lines))
    displacement = whole.amplitude[:, 0] / (omega * np.asarray(orders)) ** 2
    return DriveLevel(
        frequency_hz=sine.frequency_hz,
        sd_frequency_hz=sine.sd_frequency_hz,
        phase_rad=sine.phase_rad,
        amplitude_m=float(displacement[0]),
        sd_amplitude_m=scatter / omega**2,
        distortion=float(np.linalg.norm(displacement[1:]) / displacement[0]),
    )


def noise_drive_level(density: SpectralDensity, *, low_hz: float, high_hz: float) -> NoiseDriveLevel:
    """Return the rms base acceleration and displacement in a band.

    Parameters
    ----------
    density
        Density of the base acceleration [(m/s2)^2 / Hz].
    low_hz, high_hz
        Ends of the band.
    """
    kept = (density.frequency_hz >= low_hz) & (density.frequency_hz <= high_hz) & (density.frequency_hz > 0)
    factor = np.abs(derivative_factor(density.frequency_hz[kept], -2))
    spacing_hz = density.sample_rate_hz / density.segment_samples
    power = density.density[kept] * spacing_hz
    # Lines within a noise bandwidth are correlated; the rms has half the relative spread of the power.
    lines = np.count_nonzero(kept) / (density.noise_bandwidth_hz / spacing_hz)
    return NoiseDriveLevel(
        low_hz=low_hz,
        high_hz=high_hz,
        rms_acceleration=float(np.sqrt(np.sum(power))),
        rms_displacement_m=float(np.sqrt(np.sum(power * factor**2))),
        relative_sd=float(0.5 / np.sqrt(density.n_eff * max(1.0, lines))),
    )


_REACH_SD = 7.0
"""Noise beyond this many standard deviations is neglected (1e-12 per sample)."""
_GRID = 141
"""Number of integration points, ten per standard deviation; the error is 1e-3 standard deviations."""


class NoiseLift(NamedTuple):
    """Bias of a maximum due to noise; never negative, NaN if the noise is unknown."""

    bias: float
    """E[max |x_j + n_j|] - max |x_j|."""
    error: float
    """Root mean square of max |x_j + n_j| - max |x_j|: bias and scatter together."""


def noise_lift(samples: Reals, noise_sd: float, independent: float) -> NoiseLift:
    """Return the expected rise and the root-mean-square rise of max|x| due to Gaussian noise.

    Both follow from the distribution of the maximum, P(max < z) = prod_j P(|x_j + n_j| < z). Here x_j is the
    largest of the samples that share the noise value n_j. Noise alone over 51 200 samples gives 4.4 standard
    deviations. The samples are treated as the true motion, although they may contain noise.

    Parameters
    ----------
    samples
        The motion x, shape (samples,).
    noise_sd
        Standard deviation of its noise [same unit]; NaN if unknown.
    independent
        Number of independent noise values in the window; for coloured noise
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
    near, counts = _merge_close_values(near, noise_sd)
    above = (level[:, np.newaxis] - near) / noise_sd
    below = (-level[:, np.newaxis] - near) / noise_sd
    # ln(F(above) - F(below)), in a form that does not lose the small tail.
    inside = log_ndtr(above) + np.log1p(-np.minimum(ndtr(below) / ndtr(above), 1 - 1e-16))
    left = 1 - np.exp(inside @ counts)
    rise = level - top
    bias = float(rise[0] + np.trapezoid(left, level))
    square = float(rise[0] ** 2 + np.trapezoid(2 * rise * left, level))
    # The integrals are accurate only to 1e-3 of the noise, so ensure that 0 <= bias <= rms.
    bias = max(bias, 0.0)
    return NoiseLift(bias, float(np.sqrt(max(square, bias**2))))


def _merge_close_values(values: Reals, noise_sd: float) -> tuple[Reals, Reals]:
    """Merge values that lie much closer than the noise; long windows then take no longer than short ones."""
    step = noise_sd / 20
    places, counts = np.unique(np.round(values / step), return_counts=True)
    return places * step, counts.astype(np.float64)
