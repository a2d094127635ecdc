"""A scene: request for one simulation of a specimen under a drive, with observables. SI units."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from ..engine.run import Accuracy
from ..specimen.drive import WHOLE, Harmonic
from ..specimen.specimen import Specimen
from ..specimen.stops import Strict, member, require_positive
from .prediction import State

PAPER_DURATION_S, PAPER_WINDOW_S = 30.0, 5.0
"""Length of the paper's runs from rest, and of the window at their end [s] (Gong et al. 2025, section 2)."""
BUDGET_S = 1.0
"""Default budget of computing time for runs from other starts and for continued chaos [s]."""
CLEAR, FEWEST, MOST = 8, 16, 64
"""Numbers of starts, including the requested one. `CLEAR` if all starts reach one motion, or chaos certainly
lasts. `MOST` if starts reach several motions and the budget suffices. `FEWEST` in all other cases."""


class Observable(StrEnum):
    """Quantity that the simulation of a scene can compute."""

    RESPONSE = "response"
    """Responses I and II of x and of p."""
    LYAPUNOV = "lyapunov"
    """Largest Lyapunov exponent, which requires a tangent vector."""
    SPECTRUM = "spectrum"
    """Amplitude spectrum of x, which requires stored samples."""
    POINCARE = "poincare"
    """Poincaré section: states once per drive period."""
    SCATTER = "scatter"
    """Scatter of Response I between nearly equal starts; requires several more runs."""


MOST_PERIODS = 1e12
"""Largest number of drive periods of a run; times are then resolved to a ten-thousandth of a period."""


@dataclass(frozen=True)
class FixedDuration(Strict):
    """Duration setting: simulate a given time, and observe a window at its end."""

    duration_s: float = PAPER_DURATION_S
    window_s: float = PAPER_WINDOW_S
    kind: Literal["fixed"] = "fixed"

    @property
    def longest_s(self) -> float:
        """Simulated time of the run [s]."""
        return self.duration_s

    def __post_init__(self) -> None:
        require_positive("Duration", self.duration_s, "s")
        if not 0.0 < self.window_s <= self.duration_s:
            msg = (
                f"Window {self.window_s} s is not allowed: it must be positive and within the run of "
                f"{self.duration_s} s; give a shorter window or a longer run."
            )
            raise ValueError(msg)


@dataclass(frozen=True)
class AutomaticDuration(Strict):
    """Duration setting: simulate until the motion settles, then observe a period, or a window."""

    window_s: float = PAPER_WINDOW_S
    longest_s: float = 300.0
    """Longest simulated time [s]; a motion that is still unclear then counts as undecided."""
    kind: Literal["automatic"] = "automatic"

    def __post_init__(self) -> None:
        require_positive("Window", self.window_s, "s")
        require_positive("Longest duration", self.longest_s, "s")


@dataclass(frozen=True)
class Target(Strict):
    """Target error, computing time, or both."""

    error: float | None = None
    """Largest relative error of each response; None for the smallest error that the time allows."""
    time_s: float | None = None
    """Limit of the computing time [s]; None means 60 s."""

    def __post_init__(self) -> None:
        if self.error is None and self.time_s is None:
            msg = "A target without an error or a time is not allowed: give one of them, or both."
            raise ValueError(msg)
        if self.error is not None and not 0.0 < self.error < 1.0:
            msg = f"Error {self.error} is not allowed: it must be above 0 and below 1, which is 100 %."
            raise ValueError(msg)
        if self.time_s is not None:
            require_positive("Time", self.time_s, "s")


@dataclass(frozen=True)
class Rest(Strict):
    """Initial state of a run: rest."""

    kind: Literal["rest"] = "rest"

    @property
    def state(self) -> State:
        """State x, y, z, vx, vy, vz at rest: zeros."""
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def name(self) -> str:
        """Name of this initial state in results."""
        return "rest"


@dataclass(frozen=True)
class Given(Strict):
    """Initial state of a run, given by its values."""

    state: State
    """x, y, z, vx, vy, vz in the inertial frame [m, m/s]."""
    name: str = "given"
    """Name of this initial state in results."""
    kind: Literal["given"] = "given"

    def __post_init__(self) -> None:
        if len(self.state) != 6 or not all(math.isfinite(value) for value in self.state):
            msg = f"Start {self.state} is not allowed: give six finite numbers x, y, z, vx, vy, vz."
            raise ValueError(msg)


@dataclass(frozen=True)
class Scene(Strict):
    """Request for one simulation of a specimen under a drive."""

    specimen: Specimen
    drive: Harmonic
    observe: tuple[Observable, ...] = (Observable.RESPONSE,)
    accuracy: Accuracy = Accuracy.STANDARD
    duration: FixedDuration | AutomaticDuration = FixedDuration()
    start: Rest | Given = Rest()
    budget_s: float = BUDGET_S
    """Processor time [s] for finding whether chaos lasts and, with sensitive dependence on the start, which
    motions other starts reach; zero to find neither. The budget is a nominal time, on the machine of
    docs/accuracy.md, so that results are the same on every machine."""
    target: Target | None = None
    """Target error and computing time; with these, accuracy, duration and budget must not be given."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.budget_s < math.inf:
            msg = f"Budget {self.budget_s} s is not allowed: it must be zero or positive, and finite."
            raise ValueError(msg)
        object.__setattr__(self, "accuracy", member(Accuracy, self.accuracy))
        object.__setattr__(self, "observe", tuple(member(Observable, each) for each in self.observe))
        if self.target is not None:
            self._follow_target()
        if not self.observe:
            msg = f"A scene in which nothing is observed is not allowed: give one of {', '.join(Observable)}."
            raise ValueError(msg)
        if self.drive.amplitude_m == 0.0:
            msg = "A response over a drive amplitude of 0 m is not defined: give a positive amplitude."
            raise ValueError(msg)
        for length_s in (self.duration.longest_s, self.duration.window_s):
            if length_s * self.drive.frequency_hz > MOST_PERIODS:
                msg = (
                    f"Duration {length_s:g} s is not allowed at {self.drive.frequency_hz} Hz: it must be at "
                    f"most {MOST_PERIODS:g} drive periods, {MOST_PERIODS / self.drive.frequency_hz:g} s."
                )
                raise ValueError(msg)
        if self.duration.window_s * self.drive.frequency_hz < 1.0 - WHOLE:
            msg = (
                f"Window {self.duration.window_s} s is not allowed at {self.drive.frequency_hz} Hz: "
                f"it must contain one drive period, {1.0 / self.drive.frequency_hz} s."
            )
            raise ValueError(msg)

    def _follow_target(self) -> None:
        """Set an automatic duration; raise ValueError for settings that contradict the target."""
        if self.duration == FixedDuration():
            window_s = max(PAPER_WINDOW_S, 1.0 / self.drive.frequency_hz)
            object.__setattr__(self, "duration", AutomaticDuration(window_s))
        given = {
            "accuracy": self.accuracy is not Accuracy.STANDARD,
            "duration": not isinstance(self.duration, AutomaticDuration),
            "budget": self.budget_s != BUDGET_S,
        }
        for name, is_given in given.items():
            if is_given:
                msg = f"A target sets the {name} itself; both were given: leave out one of them."
                raise ValueError(msg)
        observed = [each for each in self.observe if each in (Observable.LYAPUNOV, Observable.SPECTRUM)]
        if observed:
            msg = f"A target is not allowed with {observed[0]}: request {observed[0]} without a target."
            raise ValueError(msg)
