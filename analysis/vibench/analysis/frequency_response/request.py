"""Options to analyse noise: estimator, resolution or averages, quantities and scale."""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import ClassVar

import numpy as np

from ..errors import InvalidRequest, NotEnoughData
from ..signals.arrays import Reals
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..signals.quantity import Quantity, derivative_factor
from ..signals.window import Window, hop_samples, taper
from .results import Estimator, FrequencyResponse, converted_frequency_response, require_estimator


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
        if self.is_force:
            return frequency_response
        return converted_frequency_response(
            frequency_response,
            drive=(Quantity.DISPLACEMENT, self.base),
            response=(Quantity.DISPLACEMENT, self.response),
        )

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
            f"the quantity {text!r} is not known; give one for m0 and base, such as velocity/acceleration; "
            f"known are {', '.join(known)}"
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
        # Compare before rounding: infinity cannot be rounded to an integer.
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
