"""A sine of known frequency in noise: amplitude, phase, their uncertainty, and the true frequency."""

from dataclasses import dataclass
from math import hypot, pi, sqrt

import numpy as np

from ..instruments import Samples

_PPM = 1e6
_WINDOWS = 20


@dataclass(frozen=True)
class SineFit:
    """A least-squares sine."""

    amplitude: float
    uncertainty: float
    """Standard uncertainty of the amplitude, from what the sine leaves."""
    phase_rad: float
    """Of a cosine, at the first sample."""
    residual_rms: float


@dataclass(frozen=True)
class ClockRatio:
    """How fast one clock runs against another."""

    ppm: float
    uncertainty_ppm: float


def fit_sine(volts: Samples, frequency_hz: float, sample_rate_hz: float) -> SineFit:
    """Fit cosine, sine and a constant.

    The uncertainty is that of white noise, ``residual_rms * sqrt(2 / n)`` (Kay, Fundamentals of
    Statistical Signal Processing, vol. 1, example 3.14).

    Parameters
    ----------
    volts
        Shape (samples,), more than one period.

    """
    angle = 2 * pi * frequency_hz * np.arange(volts.size) / sample_rate_hz
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=1)
    solution = np.linalg.lstsq(basis, volts)[0]
    residual = float(np.sqrt(np.mean((volts - basis @ solution) ** 2)))
    in_phase, quadrature = float(solution[0]), float(solution[1])
    return SineFit(
        amplitude=hypot(in_phase, quadrature),
        uncertainty=residual * sqrt(2 / volts.size),
        phase_rad=float(np.arctan2(-quadrature, in_phase)),
        residual_rms=residual,
    )


def clock_ratio(volts: Samples, frequency_hz: float, sample_rate_hz: float) -> ClockRatio:
    """Frequency of a sine that should be at ``frequency_hz``, as parts in a million of it.

    A straight line through the phases of twenty stretches; its slope is the offset in frequency.
    """
    length = volts.size // _WINDOWS
    starts = np.arange(_WINDOWS) * length
    turned = 2 * pi * frequency_hz * starts / sample_rate_hz
    phases = np.unwrap(
        [
            fit_sine(volts[start : start + length], frequency_hz, sample_rate_hz).phase_rad - turn
            for start, turn in zip(starts, turned, strict=True)
        ]
    )
    line, covariance = np.polyfit(starts / sample_rate_hz, phases, 1, cov=True)
    scale = _PPM / (2 * pi * frequency_hz)
    return ClockRatio(float(line[0]) * scale, sqrt(float(covariance[0, 0])) * scale)
