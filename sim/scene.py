"""A scene: what is shaken, how, and what is to be seen of it. Planned before it is run; SI units.

Model only what a scene requires: the plan says which method answers it, what is carried along and why.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, Literal

from pydantic import ConfigDict

from .accuracy import Accuracy
from .contact_law import NoContact, PowerLaw
from .drive import Harmonic
from .lyapunov import LyapunovEstimate, largest_exponent
from .outcome import Outcome
from .prediction import Method, MotionKind, Prediction, State
from .response import Response, steady_response
from .specimen import Specimen

__all__ = [
    "AutomaticDuration",
    "FixedDuration",
    "Given",
    "Observable",
    "Prediction",
    "Rest",
    "Scene",
    "ScenePlan",
    "plan_scene",
    "solve_scene",
]

_STRICT = ConfigDict(extra="forbid")
PAPER_DURATION_S, PAPER_WINDOW_S = 30.0, 5.0
"""Gong et al. 2025, section 2: 30 s from rest, the last 5 s observed."""


class Observable(StrEnum):
    """What is looked at."""

    RESPONSE = "response"
    """Responses I and II of m0 and of p."""
    LYAPUNOV = "lyapunov"
    """The largest exponent; a tangent vector is carried."""
    SPECTRUM = "spectrum"
    """Amplitudes of m0 over frequency; samples are stored."""
    POINCARE = "poincare"
    """States once a drive period."""


@dataclass(frozen=True)
class FixedDuration:
    """Follow the motion for this long, and observe the end of it."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    duration_s: float = PAPER_DURATION_S
    window_s: float = PAPER_WINDOW_S
    kind: Literal["fixed"] = "fixed"

    def __post_init__(self) -> None:
        if not 0.0 < self.duration_s < math.inf:
            msg = f"Duration {self.duration_s} s is not allowed: it must be positive and finite."
            raise ValueError(msg)
        if not 0.0 < self.window_s <= self.duration_s:
            msg = (
                f"Window {self.window_s} s is not allowed: "
                f"it must be positive and within the run of {self.duration_s} s."
            )
            raise ValueError(msg)


@dataclass(frozen=True)
class AutomaticDuration:
    """Follow the motion until it has settled, then observe a period of it, or a window if it has none."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    window_s: float = PAPER_WINDOW_S
    longest_s: float = 120.0
    """The motion is observed after this long at the latest, and called undecided."""
    kind: Literal["automatic"] = "automatic"

    def __post_init__(self) -> None:
        for name, value in (("Window", self.window_s), ("Longest duration", self.longest_s)):
            if not 0.0 < value < math.inf:
                msg = f"{name} {value} s is not allowed: it must be positive and finite."
                raise ValueError(msg)


@dataclass(frozen=True)
class Rest:
    """Begin with nothing moving."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    kind: Literal["rest"] = "rest"

    @property
    def state(self) -> State:
        """Zeros."""
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def name(self) -> str:
        """How results call it."""
        return "rest"


@dataclass(frozen=True)
class Given:
    """Begin in a state of one's own."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    state: State
    """x, y, z, vx, vy, vz, absolute [m, m/s]."""
    name: str = "given"
    """How results call it."""
    kind: Literal["given"] = "given"

    def __post_init__(self) -> None:
        if len(self.state) != 6 or not all(math.isfinite(value) for value in self.state):
            msg = f"Start {self.state} is not allowed: give six finite numbers x, y, z, vx, vy, vz."
            raise ValueError(msg)


@dataclass(frozen=True)
class Scene:
    """What one simulation is asked."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    specimen: Specimen
    drive: Harmonic
    observe: tuple[Observable, ...] = (Observable.RESPONSE,)
    accuracy: Accuracy = Accuracy.STANDARD
    duration: FixedDuration | AutomaticDuration = FixedDuration()
    start: Rest | Given = Rest()

    def __post_init__(self) -> None:
        if not self.observe:
            msg = f"A scene in which nothing is observed is not allowed: give one of {', '.join(Observable)}."
            raise ValueError(msg)
        if self.drive.amplitude_m == 0.0:
            msg = "A drive of amplitude 0 m has no response over the drive: give a positive amplitude."
            raise ValueError(msg)
        if self.duration.window_s * self.drive.frequency_hz < 1.0 - WHOLE:
            msg = (
                f"Window {self.duration.window_s} s is not allowed at {self.drive.frequency_hz} Hz: "
                f"it must hold one drive period, {1.0 / self.drive.frequency_hz} s."
            )
            raise ValueError(msg)


SETTLING_SHARE = 1.0 / 6.0
"""Part of a run that finds the attractor before growth is counted: 5 s of the paper's 30."""
WHOLE = 1e-9
"""A window this close to a whole number of periods is taken for it."""


@dataclass(frozen=True)
class ScenePlan:
    """How a scene will be answered, and what it will cost."""

    method: Method
    sentences: tuple[str, ...]
    """What is carried, what is not, and why."""
    cost_s: float
    """Estimated time on one core [s]."""

    def explain(self) -> str:
        """Say the plan to a reader."""
        return "\n".join((*self.sentences, f"Estimated time on one core: {self.cost_s:.2g} s."))


def plan_scene(scene: Scene) -> ScenePlan:
    """Decide how a scene is to be answered, without running it."""
    match scene.specimen.contact:
        case PowerLaw():
            return ScenePlan(Method.POLYNOMIAL, ("The force acts at every p.",), 0.1)
        case NoContact():
            return ScenePlan(Method.EVENT_DRIVEN, ("There are no stops.",), 0.01)
        case _:
            return ScenePlan(Method.EVENT_DRIVEN, ("Stops may be touched.",), 0.04)


def solve_scene(scene: Scene) -> Prediction:
    """Run a scene as planned, and say what was seen.

    Raises
    ------
    ValueError
        When the specimen cannot be followed in time.

    """
    duration_s = (
        scene.duration.duration_s
        if scene.duration.kind == "fixed"
        else max(PAPER_DURATION_S, scene.duration.window_s)
    )
    response = steady_response(
        scene.specimen, scene.drive, scene.accuracy, duration_s, scene.duration.window_s, scene.start.state
    )
    exponent = _exponent(scene, duration_s) if Observable.LYAPUNOV in scene.observe else None
    return _prediction(scene, plan_scene(scene), response, exponent)


def _exponent(scene: Scene, duration_s: float) -> LyapunovEstimate:
    """Carry a tangent vector along; it forgets its direction in the part of the run before the window."""
    settle_s = SETTLING_SHARE * duration_s
    return largest_exponent(
        scene.specimen, scene.drive, scene.accuracy, duration_s - settle_s, settle_s, scene.start.state
    )


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _prediction(
    scene: Scene, plan: ScenePlan, response: Response, exponent: LyapunovEstimate | None
) -> Prediction:
    is_whole = response.outcome is Outcome.REACHED_END
    x, y, z, vx, vy, vz = (float(value) for value in response.final_state)
    return Prediction(
        frequency_hz=scene.drive.frequency_hz,
        amplitude_m=scene.drive.amplitude_m,
        response_i=response.response_i if is_whole else None,
        response_ii=response.response_ii if is_whole else None,
        relative_i=response.relative_i if is_whole else None,
        relative_ii=response.relative_ii if is_whole else None,
        impacts=response.impacts,
        impact_rate_hz=response.impacts / response.window_s,
        motion=MotionKind.UNDECIDED,
        period=None,
        duration_s=response.duration_s,
        window_s=response.window_s,
        settled_s=None,
        ended=response.outcome.text,
        error_estimate=None,
        integration_error=None,
        scatter=None,
        lyapunov_per_s=None if exponent is None else _known(exponent.exponent_per_s),
        lyapunov_error_per_s=None if exponent is None else _known(exponent.standard_error_per_s),
        start=scene.start.name,
        final_state=(x, y, z, vx, vy, vz),
        outcome=response.outcome,
        method=plan.method,
        accuracy=scene.accuracy.value,
    )
