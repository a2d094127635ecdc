"""What a person asks of the simulation: one specimen, one drive over frequency, up to two models.

What comes back of a simulation, piece by piece, small enough to cross from the process that computes.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Self

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from vibench.sim import (
    BUDGET_S,
    Accuracy,
    Ensemble,
    Observable,
    StartMemory,
)
from vibench.sim.study import Study, frequency_range

from ..dynamics import BranchLine, ChainRun, ContactWord, SpecimenChoice, SpectrumPoint
from ..signals.arrays import Reals
from .map_request import MapPicture, SettledMotion


@dataclass(frozen=True)
class SimulatedPoint:
    """One model at one frequency; None where it was not asked for, or not found."""

    model: str
    frequency_hz: float
    response_i: float | None
    response_ii: float | None
    impacts: int
    motion: str
    lyapunov_per_s: float | None
    error_estimate: float | None
    memory: StartMemory = StartMemory.UNKNOWN
    ensemble: Ensemble | None = None
    """What other starts came to, where the start is forgotten."""


@dataclass(frozen=True, eq=False)
class SimulatedSignal:
    """The end of a run, sampled; arrays of shape (samples,)."""

    model: str
    frequency_hz: float
    time_s: Reals
    displacement_m: Reals
    """x, of m0."""
    relative_m: Reals
    """p = y - z, between the stops."""
    gaps_m: tuple[float, float]
    """Of the stops at negative and at positive p."""


@dataclass(frozen=True)
class Trouble:
    """A scene that could not be computed, in one sentence."""

    sentence: str


PartialResult = (
    SimulatedPoint
    | SimulatedSignal
    | BranchLine
    | SpectrumPoint
    | ChainRun
    | MapPicture
    | SettledMotion
    | Trouble
)
MOST_POINTS = 20_000
"""Of both models together: a picture shows no more, and an afternoon computes no more."""


class Exponent(StrEnum):
    """Whether the largest Lyapunov exponent is computed."""

    LEFT_OUT = "left out"
    COMPUTED = "computed"


class SimulationRequest(SpecimenChoice):
    """A scene at every frequency of a range."""

    compared_with: ContactWord = "linear"
    """A second model, for similarity with the first; empty for none."""
    amplitude_m: PositiveFloat = 5e-6
    """Of the base displacement."""
    start_hz: PositiveFloat = 50.0
    """Lowest drive frequency."""
    stop_hz: PositiveFloat = 600.0
    """Highest drive frequency."""
    step_hz: PositiveFloat = 5.0
    """Between neighbouring frequencies."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Of contacts; flight is exact at every level. Below stands what each level costs and errs."""
    duration_s: PositiveFloat = 8.0
    """Length of each run, from rest."""
    window_s: PositiveFloat = 5.0
    """Length of its end that is observed."""
    budget_s: NonNegativeFloat = BUDGET_S
    """Most processor time a point for other starts, where the start is forgotten; 0 looks for none."""
    exponent: Exponent = Exponent.LEFT_OUT
    """Largest Lyapunov exponent; it about doubles the work."""
    signal_hz: PositiveFloat | None = 260.0
    """Frequency whose time signal is shown; empty for none."""

    @model_validator(mode="after")
    def _is_a_study(self) -> Self:
        """Refuse here what a study would refuse, in its own words, and what would take for ever."""
        points = len(self.models) * len(frequency_range(self.start_hz, self.stop_hz, self.step_hz))
        if points > MOST_POINTS:
            raise ValueError(
                f"{points} points are asked for; at most {MOST_POINTS} are simulated here: "
                "take a larger step, or a study file"
            )
        self.study  # noqa: B018 - making it is the check
        return self

    @property
    def models(self) -> tuple[str, ...]:
        """The first is the reference of the similarity."""
        second = self.compared_with.strip()
        return (self.law,) if second in ("", self.law) else (self.law, second)

    @property
    def study(self) -> Study:
        """The same as every program of the house computes it."""
        exponents = (Observable.LYAPUNOV,) if self.exponent is Exponent.COMPUTED else ()
        varied = {"damping_times_s": self.damping_time_s, "gaps_m": self.gap_m}
        return Study(
            specimen=self.described,
            models=self.models,
            **{name: (value,) for name, value in varied.items() if value is not None},
            amplitudes_m=(self.amplitude_m,),
            frequencies_hz=frequency_range(self.start_hz, self.stop_hz, self.step_hz),
            observe=(Observable.RESPONSE, *exponents),
            accuracy=self.accuracy,
            duration_s=self.duration_s,
            window_s=self.window_s,
            budget_s=self.budget_s,
        )

    @property
    def points(self) -> int:
        """Scenes that are computed."""
        return self.study.grid.size

    @property
    def simulated_s(self) -> float:
        """Time that all scenes together last."""
        return self.points * self.duration_s
