"""What is asked of exponents, and the answer at one drive."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import Accuracy, LyapunovSpectrum, Parameter, PowerLaw

from ..signals.arrays import Reals
from ..tables import Labelled
from ._specimen_choice import SpecimenChoice

MOST_POINTS = 20_000
LONGEST_S = 1e5
"""Longest duration of an average: its intervals are kept, some hundreds of megabytes of them."""
ROUNDING = 1e-9
"""A step that fits into the range except for rounding fits."""
ELASTIC = ("hertz", "linear", "linear_gap", "power")
"""Kinds of contact that take no energy: there the exponents add up to what the dampers take."""


class SpectrumRequest(SpecimenChoice):
    """All exponents at every frequency, or at every level."""

    along: Parameter = Parameter.FREQUENCY
    """What changes: the drive's frequency, or its amplitude."""
    amplitude_m: PositiveFloat = 5e-6
    """Amplitude of the base displacement, along frequency."""
    frequency_hz: PositiveFloat = 260.0
    """Frequency of the drive, along amplitude."""
    start: PositiveFloat = 240.0
    """Lower end of the range, in Hz or in m."""
    stop: PositiveFloat = 280.0
    """Upper end of the range, in Hz or in m."""
    step: PositiveFloat = 10.0
    """Between neighbouring points, in Hz or in m."""
    accuracy: Accuracy = Accuracy.REFERENCE
    """Accuracy of contacts; the sum of the exponents is as exact."""
    duration_s: Annotated[float, Field(gt=0.0, le=LONGEST_S)] = 25.0
    """Over which exponents are averaged."""
    settle_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = 5.0
    """Left out before, from rest."""
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Probability that an interval holds the exponent."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.start > self.stop:
            raise ValueError(
                f"the range {self.start:g} to {self.stop:g} does not ascend; give the lower first"
            )
        if self.points > MOST_POINTS:
            raise ValueError(f"{self.points} points are asked for; at most {MOST_POINTS}: take a larger step")
        return self

    @property
    def points(self) -> int:
        """Scenes that are computed."""
        return math.floor((self.stop - self.start) / self.step * (1.0 + ROUNDING) + ROUNDING) + 1

    @property
    def values(self) -> tuple[float, ...]:
        """What changes [Hz, or m]."""
        return tuple(self.start + k * self.step for k in range(self.points))

    def drive(self, value: float) -> tuple[float, float]:
        """Frequency and amplitude at a value."""
        if self.along is Parameter.FREQUENCY:
            return value, self.amplitude_m
        return self.frequency_hz, value

    @property
    def is_elastic(self) -> bool:
        """The contact takes no energy, whatever it does."""
        law = self.shaken.contact
        return isinstance(law, PowerLaw) or law.kind in ELASTIC

    @property
    def title(self) -> str:
        """Name figures by it."""
        is_level = self.along is Parameter.AMPLITUDE
        return f"{self.law}, " + (
            f"{self.frequency_hz:g} Hz" if is_level else f"{1e6 * self.amplitude_m:g} µm"
        )


@dataclass(frozen=True)
class SpectrumPoint:
    """All exponents of the motion in which a run from rest ended."""

    DOCUMENT: ClassVar = (
        "frequency_hz amplitude_m exponents_per_s low_per_s high_per_s sum_per_s dampers_per_s dimension "
        "dimension_low dimension_high verdict motion source blocks impact_rate_hz outcome elapsed_s "
        "sum_difference"
    )

    frequency_hz: float
    amplitude_m: float
    exponents_per_s: tuple[float, ...]
    """Descending; minus infinity where a stop that holds m1 took a direction away, NaN where the run was
    lost."""
    low_per_s: tuple[float, ...]
    high_per_s: tuple[float, ...]
    sum_per_s: float
    dampers_per_s: float
    """What the sum must be where the contact takes no energy: -tr(M^-1 C)."""
    dimension: float
    """Kaplan and Yorke's, of the stroboscopic section."""
    dimension_low: float
    dimension_high: float
    verdict: str
    motion: str
    source: str
    blocks: int
    """Independent stretches behind the least known exponent: with few, intervals are wide."""
    impact_rate_hz: float
    outcome: str
    elapsed_s: float

    @property
    def sum_difference(self) -> float:
        """Sum of the exponents over what the dampers take, less one."""
        return self.sum_per_s / self.dampers_per_s - 1.0 if self.dampers_per_s else math.nan


def point_of(
    found: LyapunovSpectrum, dampers_per_s: float, confidence: float, elapsed_s: float
) -> SpectrumPoint:
    """Take a spectrum as it was computed."""
    bounds = found.intervals_per_s(confidence)
    low, high = found.dimension_interval(confidence)
    is_known = bool(np.isfinite(found.exponents_per_s[0]))
    return SpectrumPoint(
        frequency_hz=found.drive.frequency_hz,
        amplitude_m=found.drive.amplitude_m,
        exponents_per_s=tuple(float(each) for each in found.exponents_per_s),
        low_per_s=tuple(float(each) for each in bounds[:, 0]),
        high_per_s=tuple(float(each) for each in bounds[:, 1]),
        sum_per_s=found.sum_per_s,
        dampers_per_s=dampers_per_s,
        dimension=found.dimension if is_known else math.nan,
        dimension_low=low if is_known else math.nan,
        dimension_high=high if is_known else math.nan,
        verdict=found.verdict.name.lower(),
        motion=found.motion.value,
        source=found.source.value,
        blocks=int(found.blocks.min()),
        impact_rate_hz=found.impact_rate_hz,
        outcome=found.outcome.text,
        elapsed_s=elapsed_s,
    )


@dataclass(frozen=True)
class ExponentSpectrum(Labelled):
    """Everything that was computed for one request."""

    DOCUMENT: ClassVar = "options=request points largest_sum_difference elapsed_s"

    request: SpectrumRequest
    points: tuple[SpectrumPoint, ...]
    elapsed_s: float

    def column(self, name: str) -> Reals:
        """Return one quantity of every point, shape (n,) or (n, 6)."""
        return np.array([getattr(each, name) for each in self.points], dtype=np.float64)

    @property
    def largest_sum_difference(self) -> float:
        """How far the sums are from the dampers' at most, relative; NaN where the contact takes energy."""
        if not self.request.is_elastic:
            return math.nan
        known = [abs(each.sum_difference) for each in self.points if math.isfinite(each.sum_difference)]
        return max(known, default=math.nan)

    @property
    def cost_sentence(self) -> str:
        """Return what was found, with its check and its cost."""
        chaotic = sum(each.verdict == "chaotic" for each in self.points)
        if not self.request.is_elastic:
            check = "the contact takes energy, so that the dampers alone do not give the sum"
        elif not math.isfinite(self.largest_sum_difference):
            check = "there is no damping to compare the sums with"
        else:
            check = f"sums differ from the dampers' {self.points[0].dampers_per_s:.6g} 1/s by "
            check += f"{self.largest_sum_difference:.1g} at most"
        return f"{len(self.points)} points in {self.elapsed_s:.1f} s, {chaotic} chaotic; {check}."
