"""Frequency responses, the common result of all estimators, and the options to analyse noise."""

from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np

from ..errors import InvalidRequest, NotEnoughData
from ..signals import (
    DEFAULT_CONFIDENCE,
    Complexes,
    Flags,
    Quantity,
    Reals,
    Window,
    derivative_factor,
    hop_samples,
    magnitude_bounds,
    phase_half_width,
    taper,
)
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
    """Number of samples in one segment, or in one period."""
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
    """Coherence that two independent noises exceed with probability 1 - ``settings.confidence``."""
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
        """Divide by the ratio of response sensor gain to drive sensor gain, shape (lines,)."""
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


class MagnitudeScale(StrEnum):
    """Scale of magnitudes."""

    LOG = "log"
    """The ratio itself on a logarithmic axis."""
    DECIBEL = "db"
    """20 log10 of the ratio on a linear axis."""


_ABOVE_AND_BELOW = 2
_SYMBOLS = {Quantity.DISPLACEMENT: "x", Quantity.VELOCITY: "v", Quantity.ACCELERATION: "a"}
_BASE_SYMBOLS = {Quantity.DISPLACEMENT: "U", Quantity.VELOCITY: "U'", Quantity.ACCELERATION: "U''"}
_UNITS = {-2: "s²", -1: "s", 0: "", 1: "1/s", 2: "1/s²"}


@dataclass(frozen=True)
class FrequencyResponseView:
    """Quantities and scale of a transmission."""

    response: Quantity = Quantity.DISPLACEMENT
    base: Quantity = Quantity.DISPLACEMENT
    scale: MagnitudeScale = MagnitudeScale.LOG
    is_force: bool = False
    """Whether to show the apparent mass (force over base acceleration) instead of the quantities."""

    @property
    def power(self) -> int:
        """Power of i omega that converts displacement over displacement to this view; 0 for a force."""
        return 0 if self.is_force else self.response.derivatives - self.base.derivatives

    @property
    def unit(self) -> str:
        """Unit of the magnitude; empty for a plain ratio."""
        return "kg" if self.is_force else _UNITS[self.power]

    @property
    def name(self) -> str:
        """Name of the quantities in the form that `parse_view` reads: ``"velocity/acceleration"``."""
        return "force/acceleration" if self.is_force else f"{self.response.value}/{self.base.value}"

    @property
    def symbol(self) -> str:
        """Symbol for captions and axes, such as ``"|x / U|"``."""
        return "|F / U''|" if self.is_force else f"|{_SYMBOLS[self.response]} / {_BASE_SYMBOLS[self.base]}|"

    @property
    def title(self) -> str:
        """Name of the ratio for titles and tables."""
        return "Apparent mass" if self.is_force else "Transmission"

    def label(self, mass: str = "m0") -> str:
        """Return the label of the magnitude axis."""
        unit = self.unit
        match self.scale:
            case MagnitudeScale.LOG:
                above = "force" if self.is_force else mass
                return f"{self.symbol}{f' [{unit}]' if unit else ''}  ({above} over base)"
            case MagnitudeScale.DECIBEL:
                return f"{self.symbol} [dB re 1{f' {unit}' if unit else ''}]"

    def factor(self, frequency_hz: Reals) -> Reals:
        """Return the factor from displacement over displacement to the view's quantities."""
        return np.abs(derivative_factor(frequency_hz, self.power))

    def apply(self, frequency_response: FrequencyResponse) -> FrequencyResponse:
        """Convert displacement over displacement to the view's quantities, including bounds."""
        factor = derivative_factor(frequency_response.frequency_hz, self.power)
        return replace(frequency_response, value=frequency_response.value * factor)

    def place(self, magnitude: Reals) -> Reals:
        """Convert magnitudes to the drawn scale."""
        match self.scale:
            case MagnitudeScale.LOG:
                return magnitude
            case MagnitudeScale.DECIBEL:
                with np.errstate(divide="ignore"):
                    return np.asarray(20 * np.log10(magnitude))


def parse_view(text: str, scale: MagnitudeScale = MagnitudeScale.LOG) -> FrequencyResponseView:
    """Return the view for a text like ``"velocity/acceleration"``; one word stands for both quantities.

    Raises InvalidRequest for anything else.

    Parameters
    ----------
    text
        Quantities of m0 and the base, separated by a slash.
    scale
        Scale of magnitudes in figures.
    """
    words = text.split("/")
    known = {each.value: each for each in Quantity}
    if len(words) > _ABOVE_AND_BELOW or any(word not in known for word in words):
        raise InvalidRequest(
            f"the quantity {text!r} is not known; give quantities of m0 and base, such as "
            f"velocity/acceleration; known are {', '.join(known)}"
        )
    found = FrequencyResponseView(response=known[words[0]], base=known[words[-1]])
    return replace(found, scale=scale)


_SEGMENT_S = 4.0
"""Default segment length of streamed noise [s]: lines 0.25 Hz apart resolve a bandwidth of 1 Hz."""
_LEAST_SEGMENTS = 8
"""Minimum number of segments of the default length; a short record gets shorter segments."""
_PROXY_SAMPLES = 4096
"""Window length for computing overlap correlations; the length does not change the result."""


@dataclass(frozen=True)
class FrequencyResponseRequest:
    """Settings of a frequency response; the defaults suit the paper's specimen.

    At most one of resolution, segment length and averages can be chosen: the other two follow.
    """

    OWN_UNITS: ClassVar = {"noise_ratio": "s2"}

    estimator: Estimator = Estimator.DRIVE
    noise_ratio: float | None = None
    """For hv: ratio of the noise densities of m0's velocity and of the base's acceleration [s2]."""
    resolution_hz: float | None = None
    """Noise bandwidth of a spectral line, which sets the segment length."""
    segment_s: float | None = None
    averages: float | None = None
    """Number of independent averages, which sets the segment length."""
    window: Window = Window.HANN
    overlap: float = 0.5
    confidence: float = DEFAULT_CONFIDENCE
    view: FrequencyResponseView = field(default_factory=FrequencyResponseView)

    def __post_init__(self) -> None:
        lengths = {
            "a resolution": self.resolution_hz,
            "a segment length": self.segment_s,
            "a number of averages": self.averages,
        }
        given = {name: value for name, value in lengths.items() if value is not None}
        if len(given) > 1:
            raise InvalidRequest(f"{' and '.join(given)} were given; give one, which sets the others")
        for name, value in given.items():
            if not (np.isfinite(value) and value > 0):
                raise InvalidRequest(f"{name} of {value:g} was requested; it must be finite and more than 0")
        if self.averages is not None and self.averages <= 1:
            raise InvalidRequest(f"{self.averages:g} averages were requested; a coherence needs more than 1")
        require_estimator(self.estimator, self.noise_ratio, self.confidence)
        hop_samples(_PROXY_SAMPLES, self.overlap)

    @property
    def cuts_segments(self) -> bool:
        """Whether the request sets options that apply only to averages over segments."""
        chosen = (self.resolution_hz, self.segment_s, self.averages)
        return any(each is not None for each in chosen) or (self.window, self.overlap) != (
            FrequencyResponseRequest.window,
            FrequencyResponseRequest.overlap,
        )

    def segment_samples(self, samples: int, sample_rate_hz: float) -> int:
        """Choose the length of a segment for a record of this many samples.

        Raises NotEnoughData when the record is shorter than two segments of the requested length.
        """
        wished = self._requested_samples(samples, sample_rate_hz)
        # Compare before rounding, because infinity cannot be rounded to an integer.
        if samples < wished or samples < wished + hop_samples(int(wished), self.overlap):
            raise NotEnoughData(
                f"{samples / sample_rate_hz:.3g} s of noise were recorded, less than two segments of the "
                f"{wished / sample_rate_hz:.3g} s requested: request a coarser resolution, or measure longer"
            )
        return int(wished)

    def _requested_samples(self, samples: int, sample_rate_hz: float) -> float:
        if self.resolution_hz is not None:
            values = taper(self.window, _PROXY_SAMPLES)
            lines = float(values.size * (values @ values) / np.sum(values) ** 2)
            return max(2.0, float(np.ceil(lines * sample_rate_hz / self.resolution_hz)))
        if self.segment_s is not None:
            return max(2.0, float(np.rint(self.segment_s * sample_rate_hz)))
        if self.averages is not None:
            return longest_segment(samples, self.averages, self.window, self.overlap)
        return min(round(_SEGMENT_S * sample_rate_hz), 2 * samples // (_LEAST_SEGMENTS + 1))


def longest_segment(samples: int, averages: float, window: Window, overlap: float) -> int:
    """Return the longest segment for which a whole record gives this many independent averages.

    K segments count as at least K / (1 + 2 sum_j rho_j^2) (see `effective_averages`), and N samples contain K
    segments of N / (1 + (K - 1) (1 - overlap)).
    """
    values = taper(window, _PROXY_SAMPLES)
    hop = hop_samples(_PROXY_SAMPLES, overlap)
    energy = float(values @ values)
    lags = range(hop, _PROXY_SAMPLES, hop)
    shared = sum((float(values[:-lag] @ values[lag:]) / energy) ** 2 for lag in lags)
    segments = int(np.ceil(averages * (1 + 2 * shared)))
    return max(2, int(samples / (1 + (segments - 1) * (1 - overlap))))
