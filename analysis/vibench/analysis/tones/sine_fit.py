"""Frequency, amplitude and phase of a steady sine, as well as its noise allows."""

from dataclasses import dataclass

import numpy as np

from ..errors import UnusableData
from ..signals.arrays import Reals
from ..spectra.spectra import amplitude_spectrum
from .peaks import peaks

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
