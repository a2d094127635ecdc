"""Frequency responses, the common result of all estimators of response over drive."""

from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np

from ..errors import InvalidRequest
from ..signals.arrays import Complexes, Flags, Reals
from ..signals.confidence import magnitude_bounds, phase_half_width
from ..signals.quantity import Quantity, derivative_factor
from ..tables import Tabular

LEAST_COHERENCE = 0.1
"""Minimum coherence of a significant spectral line."""


class Estimator(StrEnum):
    """Estimator of response over drive from averaged spectra."""

    H1 = "h1"
    """S_xy / S_xx: unbiased when only the response is noisy."""
    H2 = "h2"
    """S_yy / S_yx: unbiased when only the drive is noisy."""
    HV = "hv"
    """Total least squares with a stated ratio of the noise densities (response over drive)."""
    DRIVE = "drive"
    """S_ry / S_rx: unbiased by noise on both channels, given a clean reference such as the drive voltage."""


def require_estimator(estimator: Estimator, noise_ratio: float | None, confidence: float) -> None:
    """Raise InvalidRequest for a missing, unneeded or invalid noise ratio, and for an invalid confidence."""
    if estimator is Estimator.HV and noise_ratio is None:
        raise InvalidRequest(
            "hv was requested without a noise ratio; give the ratio of the noise densities of "
            "response and base, or use the estimator 'drive'"
        )
    if estimator is not Estimator.HV and noise_ratio is not None:
        raise InvalidRequest(f"a noise ratio has no meaning for {estimator.value}; only hv uses it")
    if noise_ratio is not None and not (np.isfinite(noise_ratio) and noise_ratio >= 0):
        raise InvalidRequest(f"the noise ratio is {noise_ratio:g}; it must be a finite number, zero or more")
    if not 0 < confidence < 1:
        raise InvalidRequest(f"a confidence of {confidence:g} was requested; it must be between 0 and 1")


@dataclass(frozen=True)
class FrequencyResponseSettings:
    """Settings with which a frequency response was estimated."""

    estimator: Estimator
    sample_rate_hz: float
    segment_samples: int
    """Number of samples of one segment, or of one period."""
    window: str
    overlap: float
    confidence: float
    """Probability that the bounds of a line contain the true value."""
    noise_ratio: float | None = None
    """For hv: ratio of the noise densities of response and drive."""
    delay_s: float = 0.0
    """Delay of the response channel behind the drive channel [s], removed from the phase."""
    decay_per_s: float | None = None
    """Decay of the exponential window for hits [1/s], 0 without a window; None for noise. The damping that
    the window adds is removed from resonances, but not from spectral lines."""

    @property
    def segment_s(self) -> float:
        """Length of a segment, or of a period [s]."""
        return self.segment_samples / self.sample_rate_hz


@dataclass(frozen=True)
class FrequencyResponse(Tabular):
    """Response over drive against frequency, with bounds; all arrays have the shape (lines,)."""

    OWN_UNITS: ClassVar = dict.fromkeys(
        ("value", "magnitude", "magnitude_lower", "magnitude_upper"), "{unit}"
    )

    frequency_hz: Reals
    value: Complexes
    """Response over drive [unit of the response per unit of the drive]."""
    coherence: Reals
    """Squared coherence between drive and response, 0 to 1."""
    n_eff: float
    """Number of independent averages of every line."""
    relative_sd_magnitude: Reals
    """Standard deviation of ln(magnitude)."""
    sd_phase_rad: Reals
    """Standard deviation of the phase [rad]."""
    half_width: Reals
    """Relative half width of the bounds of the magnitude."""
    coherence_significance: float
    """Coherence that independent noises exceed with probability 1 - ``settings.confidence``."""
    resolution_hz: float
    """Noise bandwidth of a line, which smears finer features; zero for an exactly periodic drive."""
    segments_used: int
    segments_excluded: int
    settings: FrequencyResponseSettings
    steady_relative_sd: Reals | None = None
    """`relative_sd_magnitude` smoothed over neighbouring lines, for weights of a fit; None if not needed."""
    drive_slope_per_hz: Complexes | None = None
    """Relative slope [1/Hz] of the density that weights the transmission within a line; None if flat."""
    reference_coherence: Reals | None = None
    """For the drive-referenced estimator: the lower of the reference's coherences with the two channels."""

    @property
    def magnitude(self) -> Reals:
        """Magnitude, |response / drive|."""
        return np.abs(self.value)

    @property
    def phase_rad(self) -> Reals:
        """Phase lead of the response over the drive [rad], -pi to pi."""
        return np.angle(self.value)

    @property
    def decibel(self) -> Reals:
        """Magnitude in dB re 1."""
        with np.errstate(divide="ignore"):
            return np.asarray(20 * np.log10(self.magnitude))

    @property
    def magnitude_lower(self) -> Reals:
        """Lower bound of the magnitude."""
        return magnitude_bounds(self.magnitude, self.half_width)[0]

    @property
    def magnitude_upper(self) -> Reals:
        """Upper bound of the magnitude."""
        return magnitude_bounds(self.magnitude, self.half_width)[1]

    @property
    def phase_lower_rad(self) -> Reals:
        """Lower bound of the phase [rad]; may be below -pi."""
        return np.asarray(self.phase_rad - phase_half_width(self.half_width))

    @property
    def phase_upper_rad(self) -> Reals:
        """Upper bound of the phase [rad]; may be above pi."""
        return np.asarray(self.phase_rad + phase_half_width(self.half_width))

    @property
    def is_significant(self) -> Flags:
        """Flags of lines with significant coherence and valid bounds.

        If the drive explains less than a tenth of the response, linear bounds contain the true value in only
        3 to 75 % of cases, even with significant coherence.
        """
        decisive = self.coherence if self.reference_coherence is None else self.reference_coherence
        return np.asarray(decisive > max(self.coherence_significance, LEAST_COHERENCE))

    def without_delay(self, delay_s: float) -> "FrequencyResponse":
        """Correct the phase for a delay of the response channel behind the drive channel [s]."""
        turned = self.value * np.exp(2j * np.pi * self.frequency_hz * delay_s)
        settings = replace(self.settings, delay_s=self.settings.delay_s + delay_s)
        return replace(self, value=turned, settings=settings)

    def without_gain(self, gain: Complexes) -> "FrequencyResponse":
        """Divide by the ratio of the response sensor's gain to the drive sensor's, shape (lines,)."""
        return replace(self, value=self.value / gain)

    def between(self, low_hz: float, high_hz: float) -> "FrequencyResponse":
        """Return the response at the spectral lines from ``low_hz`` to ``high_hz``, inclusive."""
        kept = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        if not np.any(kept):
            span = f"{self.frequency_hz[0]:g} to {self.frequency_hz[-1]:g} Hz"
            raise InvalidRequest(
                f"no line lies between {low_hz:g} and {high_hz:g} Hz; the lines are at {span}"
            )
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        arrays: dict[str, Any] = {
            name: each[kept] for name, each in values.items() if isinstance(each, np.ndarray)
        }
        return replace(self, **arrays)


def converted_frequency_response(
    transmission: FrequencyResponse,
    *,
    drive: tuple[Quantity, Quantity],
    response: tuple[Quantity, Quantity],
) -> FrequencyResponse:
    """Convert a transmission to other quantities; each pair is (recorded, requested).

    Base acceleration to m0 velocity becomes displacement over displacement by
    ``drive=(ACCELERATION, DISPLACEMENT), response=(VELOCITY, DISPLACEMENT)``. Relative bounds and coherence
    are unchanged; the line at 0 Hz is NaN for integrals.
    """
    power = (response[1].derivatives - response[0].derivatives) - (
        drive[1].derivatives - drive[0].derivatives
    )
    factor = derivative_factor(transmission.frequency_hz, power)
    return replace(transmission, value=transmission.value * factor)
