"""How nonlinear the specimen was under noise that repeats: what its scatter and its quiet lines say."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import digamma, polygamma

from ..signals.arrays import Flags, Reals
from ..tables import Labelled
from .periodic import DetectionLines, Drift, PeriodicFrequencyResponse


@dataclass(frozen=True)
class Distortion(Labelled):
    """Noise and nonlinear distortion of a transmission, each in parts of it; medians over the lines."""

    DOCUMENT: ClassVar = (
        "realisations median_not_repeating_over_magnitude=noise_share "
        "median_distortion_over_magnitude=distortion_share gain_drift=drift.gain_share "
        "frequency_drift=drift.frequency_share odd_detection_lines_m_per_s=odd_m_per_s "
        "even_detection_lines_m_per_s=even_m_per_s noise_on_detection_lines_m_per_s=detection_noise_m_per_s"
    )

    realisations: int
    drift: Drift | None
    noise_share: float
    """Standard deviation that what does not repeat from period to period (noise of the channels, or chaos of
    the specimen) gives one realisation, over the transmission's magnitude."""
    distortion_share: float | None
    """What realisations scatter beyond it; None when there was one only."""
    odd_m_per_s: float | None
    """Rms response on the odd lines that were not driven, noise taken off; None when there are none."""
    even_m_per_s: float | None
    """The same on even lines."""
    detection_noise_m_per_s: float | None
    """Rms of what noise leaves on the quiet lines."""


def distortion(periodic: PeriodicFrequencyResponse) -> Distortion:
    """Sum up what a periodic transmission says of noise and of distortion.

    The quiet lines hold whatever is not linear between the drive voltage and the response: amplifier and
    shaker as well as the specimen.
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
"""Standard deviations by which scatter must exceed noise before it is called distortion."""


def scatters_beyond_noise(periodic: PeriodicFrequencyResponse) -> bool | None:
    """Return whether realisations scatter more than their periods do; None when there was one of either only.

    The logarithm of a ratio of two variances has the mean and variance of that of Fisher's F; of a linear
    specimen, over many lines, its average stays within some standard deviations.
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
    """Lines on which only even distortion can lie."""
    return np.asarray(lines.order % 2 == 0)


def _rms_without_noise(lines: DetectionLines, chosen: Flags) -> float | None:
    power = lines.response_amplitude[chosen] ** 2 - lines.noise_amplitude[chosen] ** 2
    return float(np.sqrt(max(float(np.mean(power)), 0.0))) if power.size else None


def _rms(values: Reals) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if values.size else None
