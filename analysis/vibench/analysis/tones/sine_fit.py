"""Frequency, amplitude and phase of a steady sine in noise."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
import scipy
from scipy.special import log_ndtr, ndtr

from ..errors import InvalidRequest, UnusableData
from ..signals.arrays import Reals
from ..signals.confidence import standard_uncertainty
from ..signals.quantity import derivative_factor
from ..spectra.spectra import AmplitudeSpectrum, SpectralDensity, amplitude_spectrum
from .order_tracking import track_orders

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

    For a sine between two lines, d = (2a - 1) / (a + 1) is the sine's distance from the larger line [lines];
    a is the ratio of the smaller to the larger line (Grandke 1983, IEEE Trans. Instrum. Meas. 32, 350-355).
    The amplitude is the larger line times (pi d / sin(pi d)) (1 - d^2). The band must be at least two lines
    away from 0 and from half the sample rate.
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
        side = 1 if amplitude[line + 1] >= amplitude[line - 1] else -1
        ratio = amplitude[line + side] / amplitude[line]
        offset = (2 * ratio - 1) / (ratio + 1)
        below = amplitude[max(1, line - _NOISE_NEIGHBOURS) : max(1, line - 3)]
        around = np.concatenate((below, amplitude[line + 4 : line + 1 + _NOISE_NEIGHBOURS]))
        floor = float(np.median(around)) if around.size else 0.0
        height = float(amplitude[line] / np.sinc(offset) * (1 - offset**2))
        if height > _LEAST_RATIO * floor:
            return Peak(float((line + side * offset) * spectrum.spacing_hz), height, floor)
    return None


_ITERATIONS = 10
_CONVERGED = 1e-13
_SEARCH = 0.2
"""Relative search range around the expected frequency."""


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

    Raises UnusableData when no spectral line near ``near_hz`` stands above the noise.

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
    # Centred time decorrelates frequency and phase, so that the fit is well conditioned.
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
"""Number of parts of the window, whose scatter gives the uncertainty, including slow changes."""
_ORDERS = (1.0, 2.0, 3.0)


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
    """Relative standard deviation of both rms values, from independent averages and spectral lines."""


def drive_level(drive: Reals, base: Reals, sample_rate_hz: float, *, near_hz: float) -> DriveLevel:
    """Measure A0 of a dwell from drive voltage and base acceleration [m/s2], each of shape (samples,)."""
    sine = fit_sine(drive, sample_rate_hz, near_hz)
    phase = steady_phase(base.size, sine.frequency_hz / sample_rate_hz, sine.phase_rad)
    whole = track_orders(base, phase, interval_samples=base.size, orders=_ORDERS)
    parts = track_orders(base, phase, interval_samples=base.size // _SCATTER_BLOCKS, orders=_ORDERS)
    omega = 2 * np.pi * sine.frequency_hz
    scatter = standard_uncertainty(np.abs(parts.order(1.0)))
    displacement = whole.amplitude[:, 0] / (omega * np.asarray(_ORDERS)) ** 2
    return DriveLevel(
        frequency_hz=sine.frequency_hz,
        sd_frequency_hz=sine.sd_frequency_hz,
        phase_rad=sine.phase_rad,
        amplitude_m=float(displacement[0]),
        sd_amplitude_m=scatter / omega**2,
        distortion=float(np.hypot(displacement[1], displacement[2]) / displacement[0]),
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
    # Lines within a noise bandwidth depend on each other; the rms has half the relative spread of the power.
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
    """Return the expected and the root-mean-square rise of max|x| due to Gaussian noise.

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
    # ln(F(above) - F(below)) without losing the small tail.
    inside = log_ndtr(above) + np.log1p(-np.minimum(ndtr(below) / ndtr(above), 1 - 1e-16))
    left = 1 - np.exp(inside @ counts)
    rise = level - top
    bias = float(rise[0] + np.trapezoid(left, level))
    square = float(rise[0] ** 2 + np.trapezoid(2 * rise * left, level))
    # The integrals are accurate only to 1e-3 of the noise, so ensure that 0 <= bias <= rms.
    bias = max(bias, 0.0)
    return NoiseLift(bias, float(np.sqrt(max(square, bias**2))))


def _merge_close_values(values: Reals, noise_sd: float) -> tuple[Reals, Reals]:
    """Merge values much closer than the noise, so that long windows are as fast as short ones."""
    step = noise_sd / 20
    places, counts = np.unique(np.round(values / step), return_counts=True)
    return places * step, counts.astype(np.float64)
