"""Frequency, amplitude and phase of a steady sine, as well as its noise allows."""

from dataclasses import dataclass

import numpy as np
import scipy

from ..errors import InvalidRequest, UnusableData
from ..signals.arrays import Reals
from ..signals.window import Window
from ..spectra.spectra import AmplitudeSpectrum, amplitude_spectrum

_NOISE_NEIGHBOURS = 50
"""Lines on either side whose median is taken as the floor around a peak."""
_LEAST_RATIO = 5.0
"""A peak stands at least so many times above that floor."""
_MEDIAN_OF_RAYLEIGH = float(np.sqrt(2 * np.log(2)))
"""Median of the magnitude of complex noise, in standard deviations of one component."""


@dataclass(frozen=True)
class Peak:
    """A line of a spectrum that stands above its neighbourhood."""

    frequency_hz: float
    sd_frequency_hz: float
    """From the noise around it; zero neighbourhood gives zero."""
    amplitude: float
    """Peak amplitude, corrected for lying between lines [unit of the spectrum]."""
    floor: float
    """Median amplitude of the lines around it [unit of the spectrum]."""


def peaks(spectrum: AmplitudeSpectrum, *, low_hz: float, high_hz: float, count: int) -> tuple[Peak, ...]:
    """Find the largest peaks of a Hann spectrum in a band, the largest first.

    For a sine between two lines the ratio of the two largest Hann values gives the place exactly
    (Grandke 1983, IEEE Trans. Instrum. Meas. 32, 350-355): d = (2a - 1) / (a + 1), and the amplitude is
    the reading times (pi d / sin(pi d)) (1 - d^2).

    Parameters
    ----------
    low_hz, high_hz
        Where to look; both at least two lines away from 0 and from half the sample rate.
    count
        At most so many.

    """
    if spectrum.window is not Window.HANN:
        raise InvalidRequest(f"peaks are placed in Hann spectra only; this one is {spectrum.window.value}")
    amplitude = spectrum.amplitude
    first = max(2, int(np.ceil(low_hz / spectrum.spacing_hz)))
    last = min(amplitude.size - 3, int(np.floor(high_hz / spectrum.spacing_hz)))
    if last < first:
        raise InvalidRequest(
            f"no line lies between {low_hz:g} and {high_hz:g} Hz; they are {spectrum.spacing_hz:g} Hz apart"
        )
    found = scipy.signal.find_peaks(amplitude[first - 1 : last + 2])[0] + first - 1
    found = found[(found >= first) & (found <= last)]
    placed = [_placed(spectrum, amplitude, int(line)) for line in found[np.argsort(-amplitude[found])]]
    return tuple(peak for peak in placed if peak.amplitude > _LEAST_RATIO * peak.floor)[:count]


def _placed(spectrum: AmplitudeSpectrum, amplitude: Reals, line: int) -> Peak:
    side = 1 if amplitude[line + 1] >= amplitude[line - 1] else -1
    ratio = amplitude[line + side] / amplitude[line]
    offset = (2 * ratio - 1) / (ratio + 1)
    around = np.concatenate(
        (
            amplitude[max(1, line - _NOISE_NEIGHBOURS) : max(1, line - 3)],
            amplitude[line + 4 : line + 1 + _NOISE_NEIGHBOURS],
        )
    )
    floor = float(np.median(around)) if around.size else 0.0
    # dd/da = 3 / (a + 1)^2; the noises of neighbouring Hann lines are correlated by 2/3.
    sd_ratio = floor / _MEDIAN_OF_RAYLEIGH / amplitude[line] * np.sqrt(1 + ratio**2 - 4 / 3 * ratio)
    return Peak(
        frequency_hz=float((line + side * offset) * spectrum.spacing_hz),
        sd_frequency_hz=float(3 / (ratio + 1) ** 2 * sd_ratio * spectrum.spacing_hz),
        amplitude=float(amplitude[line] / np.sinc(offset) * (1 - offset**2)),
        floor=floor,
    )


_ITERATIONS = 10
_CONVERGED = 1e-13
_SEARCH = 0.2
"""The sine is looked for within this fraction of where it should be."""


@dataclass(frozen=True)
class FittedSine:
    """amplitude cos(2 pi frequency_hz t + phase_rad), t counted from the first sample."""

    frequency_hz: float
    sd_frequency_hz: float
    amplitude: float
    sd_amplitude: float
    phase_rad: float
    sd_phase_rad: float
    residual_rms: float


def fitted_sine(samples: Reals, sample_rate_hz: float, near_hz: float) -> FittedSine:
    """Fit a sine and an offset by least squares, frequency included (IEEE Std 1057, four parameters).

    Raises UnusableData when no line stands above the noise there.

    Parameters
    ----------
    samples
        Shape (samples,), some ten cycles or more.
    near_hz
        Where the sine should be, within 20 %.

    """
    spectrum = amplitude_spectrum(samples, sample_rate_hz)
    found = peaks(spectrum, low_hz=near_hz * (1 - _SEARCH), high_hz=near_hz * (1 + _SEARCH), count=1)
    if not found:
        raise UnusableData(f"no sine was found near {near_hz:g} Hz; check the channel and the frequency")
    # Centred time makes frequency and phase independent of each other, and the fit well conditioned.
    time = (np.arange(samples.size) - (samples.size - 1) / 2) / sample_rate_hz
    omega = 2 * np.pi * found[0].frequency_hz
    for _ in range(_ITERATIONS):
        cosine, sine = np.cos(omega * time), np.sin(omega * time)
        basis = np.stack((cosine, sine, np.ones_like(time)))
        a, b, _offset = np.linalg.solve(basis @ basis.T, basis @ samples)
        slope = time * (b * cosine - a * sine)
        full = np.concatenate((basis, slope[np.newaxis]))
        solution = np.linalg.solve(full @ full.T, full @ samples)
        omega += solution[3]
        if abs(solution[3]) < _CONVERGED * omega:
            break
    a, b = solution[0], solution[1]
    residual = samples - solution @ full
    variance = float(residual @ residual) / max(1, samples.size - 4)
    covariance = variance * np.linalg.inv(full @ full.T)
    amplitude = float(np.hypot(a, b))
    sd_omega = float(np.sqrt(covariance[3, 3]))
    sd_middle = float(np.sqrt((covariance[0, 0] + covariance[1, 1]) / 2))
    to_start = float(time[0])
    return FittedSine(
        frequency_hz=float(omega / (2 * np.pi)),
        sd_frequency_hz=sd_omega / (2 * np.pi),
        amplitude=amplitude,
        sd_amplitude=sd_middle,
        phase_rad=float(np.angle((a - 1j * b) * np.exp(1j * omega * to_start))),
        sd_phase_rad=float(np.hypot(sd_middle / amplitude, sd_omega * to_start)),
        residual_rms=float(np.sqrt(np.mean(residual**2))),
    )


def steady_phase(samples: int, cycles_per_sample: float, phase_rad: float) -> Reals:
    """Phase of a steady sine at every sample [rad]."""
    return 2 * np.pi * cycles_per_sample * np.arange(samples, dtype=np.float64) + phase_rad
