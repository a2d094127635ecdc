"""Lyapunov exponents over frequency or level: request, computation and results."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import (
    Accuracy,
    Harmonic,
    LyapunovSpectrum,
    Parameter,
    PowerLaw,
    count_text,
    lyapunov_spectrum,
)
from vibench.sim.study import frequency_range

from ..signals.arrays import Reals
from ..tables import Tabular
from ._specimen_choice import SpecimenChoice

MOST_POINTS = 20_000
LONGEST_S = 1e5
"""Longest averaging time [s]; longer times would need more than a few hundred megabytes."""
ELASTIC = ("hertz", "linear", "linear_gap", "power")
"""Elastic contact laws, for which the sum of the exponents follows from the dampers."""


class SpectrumRequest(SpecimenChoice):
    """Request for all Lyapunov exponents at every frequency or level."""

    along: Parameter = Parameter.FREQUENCY
    """Parameter that varies: frequency or amplitude of the drive."""
    amplitude_m: PositiveFloat = 5e-6
    """Amplitude of the base displacement when the frequency varies."""
    frequency_hz: PositiveFloat = 260.0
    """Frequency of the drive when the amplitude varies."""
    start: PositiveFloat = 240.0
    """Lower end of the range of frequencies [Hz] or amplitudes [m]."""
    stop: PositiveFloat = 280.0
    """Upper end of the range of frequencies [Hz] or amplitudes [m]."""
    step: PositiveFloat = 10.0
    """Step between points of the range, in Hz or in m."""
    accuracy: Accuracy = Accuracy.REFERENCE
    """Accuracy of contacts and of the sum of the exponents."""
    duration_s: Annotated[float, Field(gt=0.0, le=LONGEST_S)] = 25.0
    """Averaging time of the exponents."""
    settle_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = 5.0
    """Settling time from rest, before the averaging of the exponents."""
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Probability that an interval contains the exponent."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        points = len(self.values)
        if points > MOST_POINTS:
            raise ValueError(f"{points} points were requested; at most {MOST_POINTS}: take a larger step")
        Harmonic(*self.drive(self.stop))  # raises an error if the drive is impossible
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the varied parameter [Hz or m]."""
        return frequency_range(self.start, self.stop, self.step)

    def drive(self, value: float) -> tuple[float, float]:
        """Return frequency [Hz] and amplitude [m] for a value of the varied parameter."""
        if self.along is Parameter.FREQUENCY:
            return value, self.amplitude_m
        return self.frequency_hz, value

    @property
    def is_elastic(self) -> bool:
        """Whether the contact dissipates no energy."""
        law = self.chosen_specimen.contact
        return isinstance(law, PowerLaw) or law.kind in ELASTIC

    @property
    def title(self) -> str:
        """Title of the spectrum request for figures."""
        is_level = self.along is Parameter.AMPLITUDE
        fixed = f"{self.frequency_hz:g} Hz" if is_level else f"{1e6 * self.amplitude_m:g} µm"
        return f"{self.law}, {fixed}"


@dataclass(frozen=True)
class SpectrumPoint:
    """All Lyapunov exponents of the motion reached from rest."""

    DOCUMENT: ClassVar = (
        "frequency_hz amplitude_m exponents_per_s low_per_s high_per_s sum_per_s dampers_per_s dimension "
        "dimension_low dimension_high verdict observed_s motion source blocks impact_rate_hz outcome "
        "elapsed_s sum_difference"
    )

    frequency_hz: float
    amplitude_m: float
    exponents_per_s: tuple[float, ...]
    """Exponents in descending order; minus infinity if a stop holds m1, NaN if the run failed."""
    low_per_s: tuple[float, ...]
    high_per_s: tuple[float, ...]
    sum_per_s: float
    dampers_per_s: float
    """Sum of the exponents for an elastic contact: -tr(M^-1 C)."""
    dimension: float
    """Kaplan-Yorke dimension of the stroboscopic section."""
    dimension_low: float
    dimension_high: float
    verdict: str
    observed_s: float
    """Time over which the exponents are averaged; chaos may end after this time."""
    motion: str
    source: str
    blocks: int
    """Smallest number of independent blocks for a standard error; few blocks give wide intervals."""
    impact_rate_hz: float
    outcome: str
    elapsed_s: float

    @property
    def observation(self) -> str:
        """Verdict in words, with the time for which it was observed."""
        later = ", possibly a transient" if self.verdict == "chaotic" else ""
        return f"{self.verdict} over {self.observed_s:.3g} s{later}"

    @property
    def sum_difference(self) -> float:
        """Relative difference between the sum of the exponents and `dampers_per_s`."""
        return self.sum_per_s / self.dampers_per_s - 1.0 if self.dampers_per_s else math.nan


def point_of(
    found: LyapunovSpectrum, dampers_per_s: float, confidence: float, elapsed_s: float
) -> SpectrumPoint:
    """Convert a computed spectrum to a `SpectrumPoint`."""
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
        observed_s=found.end_time_s - found.since_s,
        motion=found.motion.value,
        source=found.source.value,
        blocks=int(found.blocks.min()),
        impact_rate_hz=found.impact_rate_hz,
        outcome=found.outcome.text,
        elapsed_s=elapsed_s,
    )


@dataclass(frozen=True)
class ExponentSpectrum(Tabular):
    """Lyapunov exponents at all points of one request."""

    DOCUMENT: ClassVar = "options=request points largest_sum_difference elapsed_s"

    request: SpectrumRequest
    points: tuple[SpectrumPoint, ...]
    elapsed_s: float

    def column(self, name: str) -> Reals:
        """Return one quantity of every point, shape (n,) or (n, 6)."""
        return np.array([getattr(each, name) for each in self.points], dtype=np.float64)

    @property
    def largest_sum_difference(self) -> float:
        """Largest relative difference of a sum of exponents from `dampers_per_s`; NaN for inelastic laws."""
        if not self.request.is_elastic:
            return math.nan
        known = [abs(each.sum_difference) for each in self.points if math.isfinite(each.sum_difference)]
        return max(known, default=math.nan)

    @property
    def cost_sentence(self) -> str:
        """Return a sentence on the points, the check of the sums of exponents, and the computing time."""
        chaotic = sum(each.verdict == "chaotic" for each in self.points)
        if not self.request.is_elastic:
            check = "the contact dissipates energy, so sums of exponents are not checked against the dampers"
        elif not math.isfinite(self.largest_sum_difference):
            check = "without damping, sums of exponents cannot be checked"
        else:
            check = f"sums of exponents differ from the damping rate {self.points[0].dampers_per_s:.6g} 1/s "
            check += f"by at most {self.largest_sum_difference:.1g} of this value"
        points = count_text(len(self.points), "point")
        return f"{points} in {self.elapsed_s:.1f} s, {chaotic} chaotic while observed; {check}."


def spectrum_points(request: SpectrumRequest) -> Iterator[SpectrumPoint]:
    """Compute and yield the exponents at each value of the varied parameter, in order."""
    specimen = request.chosen_specimen
    for value in request.values:
        began = time.perf_counter()
        drive = Harmonic(*request.drive(value))
        found = lyapunov_spectrum(specimen, drive, request.accuracy, request.duration_s, request.settle_s)
        elapsed_s = time.perf_counter() - began
        yield point_of(found, request.damping_sum_per_s, request.confidence, elapsed_s)


def exponent_spectrum(request: SpectrumRequest) -> ExponentSpectrum:
    """Compute all Lyapunov exponents of a request."""
    began = time.perf_counter()
    points = tuple(spectrum_points(request))
    return ExponentSpectrum(request, points, time.perf_counter() - began)
