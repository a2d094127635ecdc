"""Nonlinear distortion in periodic noise, from scatter of realisations and undriven spectral lines."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import digamma, polygamma

from ..signals.arrays import Flags, Reals
from ..tables import Tabular
from .periodic import DetectionLines, Drift, PeriodicFrequencyResponse


@dataclass(frozen=True)
class Distortion(Tabular):
    """Noise and nonlinear distortion relative to a transmission; medians over spectral lines."""

    DOCUMENT: ClassVar = (
        "realisations median_not_repeating_over_magnitude=noise_share "
        "median_distortion_over_magnitude=distortion_share gain_drift=drift.gain_share "
        "frequency_drift=drift.frequency_share odd_detection_lines_m_per_s=odd_m_per_s "
        "even_detection_lines_m_per_s=even_m_per_s noise_on_detection_lines_m_per_s=detection_noise_m_per_s"
    )

    realisations: int
    drift: Drift | None
    noise_share: float
    """Relative standard deviation of one realisation due to noise or chaos, from its scatter over periods."""
    distortion_share: float | None
    """Relative scatter of realisations beyond `noise_share`; None for a single realisation."""
    odd_m_per_s: float | None
    """Rms response on undriven odd spectral lines, without noise; None if there are no such lines."""
    even_m_per_s: float | None
    """Rms response on undriven even spectral lines, without noise; None if there are no such lines."""
    detection_noise_m_per_s: float | None
    """Rms noise on the undriven spectral lines."""


def distortion(periodic: PeriodicFrequencyResponse) -> Distortion:
    """Return noise and distortion of a transmission from periodic noise.

    Undriven lines also show the nonlinearity of amplifier and shaker, not only that of the specimen.
    """
    magnitude = periodic.frequency_response.magnitude
    varied = periodic.distortion_variance
    quiet = periodic.detection
    is_even = is_even_line(quiet)
    return Distortion(
        realisations=periodic.realisations,
        drift=periodic.drift,
        noise_share=float(np.median(np.sqrt(periodic.noise_variance) / magnitude)),
        distortion_share=None if varied is None else float(np.median(np.sqrt(varied) / magnitude)),
        odd_m_per_s=_rms_without_noise(quiet, ~is_even),
        even_m_per_s=_rms_without_noise(quiet, is_even),
        detection_noise_m_per_s=_rms(quiet.noise_amplitude),
    )


_SURELY = 5.0
"""Number of standard deviations by which scatter must exceed noise to count as distortion."""


def scatters_beyond_noise(periodic: PeriodicFrequencyResponse) -> bool | None:
    """Return whether realisations scatter more than their periods; None for one realisation or period.

    For a linear specimen, the mean logarithm of the variance ratio follows Fisher's F.
    """
    count, periods = periodic.realisations, min(each.periods for each in periodic.repetitions)
    if count < 2 or periods < 2:
        return None
    found = periodic.frequency_response
    total = 2.0 * count * (found.relative_sd_magnitude * found.magnitude) ** 2
    known = (periodic.noise_variance > 0) & np.isfinite(total) & (total > 0)
    ratio = np.log(total[known] / periodic.noise_variance[known])
    above, below = count - 1.0, count * (periods - 1.0)
    expected = digamma(above) - np.log(above) - digamma(below) + np.log(below)
    sd = np.sqrt((polygamma(1, above) + polygamma(1, below)) / max(ratio.size, 1))
    return bool(ratio.size and np.mean(ratio) - expected > _SURELY * sd)


def is_even_line(lines: DetectionLines) -> Flags:
    """Return flags of the even spectral lines, where only even distortion appears."""
    return np.asarray(lines.order % 2 == 0)


def _rms_without_noise(lines: DetectionLines, chosen: Flags) -> float | None:
    power = lines.response_amplitude[chosen] ** 2 - lines.noise_amplitude[chosen] ** 2
    return float(np.sqrt(max(float(np.mean(power)), 0.0))) if power.size else None


def _rms(values: Reals) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if values.size else None
