"""What comes back of a simulation, piece by piece, small enough to cross from the process that computes."""

from dataclasses import dataclass

from ..signals import Reals


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
    gap_m: float


@dataclass(frozen=True)
class Trouble:
    """A scene that could not be computed, in one sentence."""

    sentence: str


Piece = SimulatedPoint | SimulatedSignal | Trouble
