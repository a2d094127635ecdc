"""Requests for branches and chains: a specimen, a range of frequency or level, and a method."""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from itertools import cycle, islice, pairwise
from pathlib import Path
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from vibench.sim import (
    Accuracy,
    AmplitudePath,
    BalanceOptions,
    DrivePath,
    FrequencyPath,
    Harmonic,
    HarmonicSet,
    Parameter,
    PhaseReference,
    PowerLaw,
    RigidStops,
    SpecimenTable,
    count_text,
    lyapunov_spectrum,
)
from vibench.sim.branches import MotionSearch
from vibench.sim.chain import MOST_CELLS, Chain
from vibench.sim.study import TargetError, TargetTime, frequency_range

from ..signals import Reals
from ..tables import Tabular, columns
from ._specimen_choice import SpecimenChoice

EXACT_ENOUGH = 1e-4
"""Largest relative change of the fundamental of p due to the neglected harmonics."""


class BranchMethod(StrEnum):
    """Method to find and follow motions."""

    SHOOTING = "shooting"
    """Shooting: exact motions of any period with every contact, for any contact law."""
    BALANCE = "balance"
    """Harmonic balance with enough harmonics; only for motions of the drive's period, without rigid stops."""
    FIRST_ORDER = "first-order"
    """Harmonic balance with one harmonic, the paper's eq. 5; for power laws only."""


class BranchRequest(SpecimenChoice):
    """Request for all periodic motions over a range."""

    method: BranchMethod = BranchMethod.SHOOTING
    """Shooting (exact), harmonic balance, or first order (one harmonic: eq. 5 of the paper)."""
    along: Parameter = Parameter.FREQUENCY
    """Parameter that varies: frequency or amplitude of the drive."""
    amplitude_m: PositiveFloat = 5e-6
    """Amplitude of the base displacement when the frequency varies."""
    frequency_hz: PositiveFloat = 260.0
    """Frequency of the drive when the amplitude varies."""
    start: PositiveFloat = 50.0
    """Lower end of the range of frequencies [Hz] or amplitudes [m]."""
    stop: PositiveFloat = 600.0
    """Upper end of the range of frequencies [Hz] or amplitudes [m]."""
    error: TargetError | None = None
    """Error of each motion relative to the fundamental of p, such as 0.01 or "1 %"; 1e-4 by default. Harmonic
    balance uses as many harmonics as needed; the error of shooting is fixed, usually below 1e-6."""
    time_s: TargetTime | None = None
    """Time limit of the search, such as 20 or "20 s"; the result contains the branches found by then. Without
    a time limit, even if an error is given, the search takes as long as it needs."""
    harmonics: Annotated[int, Field(ge=3, le=1023)] = 511
    """Highest harmonic of the harmonic balance."""
    places: Annotated[int, Field(ge=2, le=1000)] = 8
    """Number of values in the range at which motions are searched for."""
    starts: Annotated[int, Field(ge=0, le=10_000)] = 12
    """Number of random initial states at each value; a larger number may find further isolated branches."""
    most_periods: Annotated[int, Field(ge=1, le=16)] = 4
    """Longest period to search for, in drive periods."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the random initial states."""
    resonance_band_hz: tuple[PositiveFloat, PositiveFloat] | None = None
    """Two frequencies [Hz] around a mode whose phase resonance is followed while the amplitude varies."""
    phase_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0 that lags the base by a quarter of a period at the phase resonance."""
    loop_time_s: PositiveFloat | None = None
    """Latency of the bench's feedback loop [s], which limits the unstable motions that the bench can hold."""
    recorded_level: tuple[tuple[PositiveFloat, PositiveFloat], ...] = ()
    """Recorded base amplitude over frequency, as pairs [Hz, m], instead of one constant amplitude."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if not self.start < self.stop:
            raise ValueError(
                f"the range {self.start:g} to {self.stop:g} does not ascend; give the lower value first"
            )
        law = self.chosen_specimen.contact
        if self.method is BranchMethod.FIRST_ORDER and not isinstance(law, PowerLaw):
            raise ValueError(
                f"one harmonic cannot describe {self.law}: choose a power law such as power:5, or the "
                "method 'balance' or 'shooting'"
            )
        if self.method is BranchMethod.BALANCE and isinstance(law, RigidStops):
            raise ValueError(
                "harmonic balance needs a finite contact force, and rigid stops have none; choose "
                "the method 'shooting'"
            )
        if self.error is not None and self.method is BranchMethod.FIRST_ORDER:
            raise ValueError(
                f"an error of {self.error:g} was given, but the error of one harmonic is fixed; use "
                "the method 'balance' or 'shooting', or leave out the error"
            )
        self._refuse_other_resonances()
        pairs = self.recorded_level
        if pairs and self.along is Parameter.AMPLITUDE:
            raise ValueError(
                "a recorded level needs branches along frequency; along amplitude, give one frequency"
            )
        if pairs and (len(pairs) < 2 or not all(a[0] < b[0] for a, b in pairwise(pairs))):
            raise ValueError("a recorded level needs two or more ascending frequencies")
        Harmonic(*self.path.drive(self.stop))  # raises an error if the drive is impossible
        return self

    def _refuse_other_resonances(self) -> None:
        if self.resonance_band_hz is None:
            return
        low_hz, high_hz = self.resonance_band_hz
        if not low_hz < high_hz:
            raise ValueError(f"the band {low_hz:g} to {high_hz:g} Hz does not ascend; swap the two ends")
        lower, upper = self.chosen_specimen.gaps_m
        followed = self.along, self.method, self.time_s
        if followed != (Parameter.AMPLITUDE, BranchMethod.SHOOTING, None) or lower != upper:
            raise ValueError(
                "a phase resonance is followed along amplitude, by shooting, with two equal stops and no "
                "time limit; give a range of amplitudes and a specimen with one gap, and leave out the time"
            )

    @property
    def path(self) -> DrivePath:
        """Path in frequency and amplitude along which branches are followed."""
        if self.along is Parameter.AMPLITUDE:
            return AmplitudePath(self.frequency_hz)
        if self.recorded_level:
            frequencies_hz, amplitudes_m = zip(*self.recorded_level, strict=True)
            return FrequencyPath(amplitudes_m, frequencies_hz)
        return FrequencyPath((self.amplitude_m,))

    @property
    def search(self) -> MotionSearch:
        """Settings of the search for motions."""
        return MotionSearch(
            places=self.places,
            starts=self.starts,
            most_periods=self.most_periods,
            seed=self.seed,
            time_s=math.inf if self.time_s is None else self.time_s,
        )

    @property
    def balance_options(self) -> BalanceOptions:
        """Options of harmonic balance."""
        lower, upper = self.chosen_specimen.gaps_m
        kept = HarmonicSet.ODD if lower == upper else HarmonicSet.ALL
        most = 1 if self.method is BranchMethod.FIRST_ORDER else self.harmonics
        return BalanceOptions(kept, fewest=min(15, most), most=most, tolerance=self.error or EXACT_ENOUGH)

    @property
    def title(self) -> str:
        """Title of the request for curves and figures."""
        where = f"{1e6 * self.amplitude_m:g} µm"
        if self.resonance_band_hz is not None:
            low_hz, high_hz = self.resonance_band_hz
            return f"{self.law}, {self.phase_of.value} phase resonance between {low_hz:g} and {high_hz:g} Hz"
        if self.along is Parameter.AMPLITUDE:
            where = f"{self.frequency_hz:g} Hz"
        elif self.recorded_level:
            where = "recorded level"
        return f"{self.law}, {where}, {self.method.value}"

    @property
    def sentence(self) -> str:
        """Return the caption of a figure, with all options."""
        text = f"{self.title}; {self.specimen_text}"
        if self.resonance_band_hz is not None:
            return f"{text}."
        return (
            f"{text}; at each of {self.places} values, motions of up to {self.most_periods} drive periods "
            f"were searched for from {self.starts} random states, seed {self.seed}."
        )


MOST_RUNS = 20_000


class ChainDrive(StrEnum):
    """Motion of the base of a chain."""

    NONE = "none"
    """No motion: only bands, gaps and transmissibility without contact."""
    STEADY = "steady"
    """A steady sine at each frequency, starting from rest."""
    SWEPT = "swept"
    """A linear sine sweep, up or down."""
    RECORDED = "recorded"
    """The base motion of a recording."""


class ChainRequest(SpecimenChoice):
    """A chain under one kind of drive; the repeating unit consists of the specimen and any `others`."""

    others: tuple[SpecimenTable, ...] = ()
    """Further specimens in the unit of the chain, after the first."""
    lengths: Annotated[tuple[Annotated[int, Field(ge=1, le=MOST_CELLS)], ...], Field(min_length=1)] = (8,)
    """Number of cells; give several numbers to study chains of different lengths."""
    drive: ChainDrive = ChainDrive.STEADY
    """Drive of the base: none, a steady sine, a sweep, or a recorded motion."""
    amplitude_m: PositiveFloat = 20e-6
    """Amplitude of the base displacement of steady sines or a sweep."""
    start_hz: PositiveFloat = 220.0
    """First frequency of steady sines or a sweep."""
    stop_hz: PositiveFloat = 220.0
    """Last frequency of steady sines or a sweep; below the first for a downward sweep."""
    step_hz: PositiveFloat = 10.0
    """Step between the frequencies of steady sines."""
    recording: str = ""
    """Path of the recording whose base motion drives the chain."""
    duration_s: PositiveFloat = 2.0
    """Observation time under a steady sine, length of a sweep, or maximum length of a recording."""
    settle_s: NonNegativeFloat = 2.0
    """Settling time from rest under a steady sine, before the observation."""
    exponent_s: NonNegativeFloat = 0.0
    """Averaging time of the largest Lyapunov exponent under a steady sine; 0 to omit the exponent."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Accuracy of contacts; flight is exact at every accuracy."""
    error: TargetError | None = None
    """Target relative error of transmissions under a steady sine, such as 0.01 or "1 %"; determines the
    accuracy and the times."""
    time_s: TargetTime | None = None
    """Computing time of each run under a steady sine, such as 2 or "2 s"; one minute by default."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        self.chain(max(self.lengths))
        Harmonic(self.start_hz, self.amplitude_m)  # raises an error if the drive is impossible
        self._refuse_beside_target()
        if self.drive is ChainDrive.STEADY and self.start_hz > self.stop_hz:
            raise ValueError(
                f"the range {self.start_hz:g} to {self.stop_hz:g} Hz does not ascend; give the lower "
                "frequency first, or choose a swept drive"
            )
        if self.drive is ChainDrive.STEADY and len(self.frequencies_hz) * len(self.lengths) > MOST_RUNS:
            raise ValueError(f"more than {MOST_RUNS} runs were requested; take a larger step")
        if self.drive is ChainDrive.SWEPT and self.start_hz == self.stop_hz:
            raise ValueError(
                f"a sweep from {self.start_hz:g} to {self.stop_hz:g} Hz has no range; give two different "
                "frequencies, or choose a steady drive"
            )
        if self.drive is ChainDrive.RECORDED and not self.recording:
            raise ValueError("no recording was given to drive the chain; give its path")
        return self

    @property
    def has_target(self) -> bool:
        """Return whether an error or a computing time was requested."""
        return self.error is not None or self.time_s is not None

    def _refuse_beside_target(self) -> None:
        """With a target error or time, refuse unsteady drives and options that follow from the target."""
        if not self.has_target:
            return
        if self.drive is not ChainDrive.STEADY:
            raise ValueError(f"an error or time needs a steady drive, not {self.drive}; leave it out")
        for name in ("accuracy", "duration_s", "settle_s"):
            if getattr(self, name) != type(self).model_fields[name].default:
                raise ValueError(f"{name} was given, but the error or time determines it; leave {name} out")

    @cached_property
    def unit(self) -> Chain:
        """Smallest repeating part of the chain: the specimen and any `others`."""
        changed = self.model.strip() or None, self.damping_time_s, self.gap_m
        return Chain((self.chosen_specimen, *(each.specimen(*changed) for each in self.others)))

    def chain(self, cells: int) -> Chain:
        """Build a chain with this number of cells by repeating the unit."""
        return Chain(tuple(islice(cycle(self.unit.cells), cells)))

    @property
    def frequencies_hz(self) -> Sequence[float]:
        """Frequencies of a steady sine, ascending."""
        is_one = self.start_hz == self.stop_hz
        return (self.start_hz,) if is_one else frequency_range(self.start_hz, self.stop_hz, self.step_hz)

    @property
    def title(self) -> str:
        """Title of the chain request for figures."""
        cells = ", ".join([*map(str, self.lengths[:-1]), count_text(self.lengths[-1], "cell")])
        match self.drive:
            case ChainDrive.NONE:
                return f"{cells} without contact"
            case ChainDrive.RECORDED:
                return f"{cells}, base of {Path(self.recording).name}"
            case _:
                many = self.start_hz != self.stop_hz
                where = f"{self.start_hz:g} to {self.stop_hz:g} Hz" if many else f"{self.start_hz:g} Hz"
                return f"{cells}, {where}, {1e6 * self.amplitude_m:g} µm, {self.drive.value}"

    @property
    def sentence(self) -> str:
        """Return the caption of a figure, with all options."""
        names = ", ".join([self.specimen_text, *(each.name for each in self.others)])
        times = {
            ChainDrive.NONE: "",
            ChainDrive.STEADY: f", {self.duration_s:g} s after {self.settle_s:g} s of settling"
            if not self.has_target
            else "",
            ChainDrive.SWEPT: f", {self.duration_s:g} s long",
            ChainDrive.RECORDED: f", {self.duration_s:g} s at most",
        }[self.drive]
        return f"{self.title}; {names}, {self.accuracy.value} accuracy{times}."


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
    """Smallest number of independent blocks behind a standard error; few blocks give wide intervals."""
    impact_rate_hz: float
    outcome: str
    elapsed_s: float

    @property
    def observation(self) -> str:
        """Verdict in words, with the time for which the motion was observed."""
        later = ", possibly a transient" if self.verdict == "chaotic" else ""
        return f"{self.verdict} over {self.observed_s:.3g} s{later}"

    @property
    def sum_difference(self) -> float:
        """Relative difference between the sum of the exponents and `dampers_per_s`."""
        return self.sum_per_s / self.dampers_per_s - 1.0 if self.dampers_per_s else math.nan


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
        low_per_s, high_per_s = found.intervals_per_s(request.confidence).T.tolist()
        dimension, low, high = found.dimension, *found.dimension_interval(request.confidence)
        if not np.isfinite(found.exponents_per_s[0]):
            dimension = low = high = math.nan
        yield SpectrumPoint(
            **columns(
                found,
                "frequency_hz=drive.frequency_hz amplitude_m=drive.amplitude_m sum_per_s motion=motion.value "
                "source=source.value impact_rate_hz outcome=outcome.text",
            ),
            dimension=dimension,
            dimension_low=low,
            dimension_high=high,
            exponents_per_s=tuple(map(float, found.exponents_per_s)),
            low_per_s=tuple(low_per_s),
            high_per_s=tuple(high_per_s),
            dampers_per_s=request.damping_sum_per_s,
            verdict=found.verdict.name.lower(),
            observed_s=found.end_time_s - found.since_s,
            blocks=int(found.blocks.min()),
            elapsed_s=elapsed_s,
        )


def exponent_spectrum(request: SpectrumRequest) -> ExponentSpectrum:
    """Compute the Lyapunov exponents at all points of a request."""
    began = time.perf_counter()
    points = tuple(spectrum_points(request))
    return ExponentSpectrum(request, points, time.perf_counter() - began)
