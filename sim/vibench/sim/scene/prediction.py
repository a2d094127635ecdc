"""Result of a scene: a flat, frozen value for tables, files and JSON. SI units."""

from dataclasses import dataclass, fields
from enum import StrEnum

import numpy as np

from ..specimen.outcome import Outcome
from ..specimen.state import Floats
from .shares import EscapeRate, Share

State = tuple[float, float, float, float, float, float]
"""x, y, z, vx, vy, vz, absolute [m, m/s]."""


def state_of(values: Floats) -> State:
    """Return a state of six numbers as a tuple."""
    x, y, z, vx, vy, vz = (float(value) for value in values)
    return (x, y, z, vx, vy, vz)


class MotionKind(StrEnum):
    """Kind of a motion, from its states once per drive period."""

    PERIODIC = "periodic"
    """It repeats after `ScenePrediction.period` drive periods."""
    QUASI_PERIODIC = "quasi-periodic"
    """It neither repeats nor depends sensitively on its start."""
    CHAOTIC = "chaotic"
    """It does not repeat, and depends sensitively on its start."""
    UNDECIDED = "undecided"
    """Undecided: it was not followed for long enough."""
    CHAOTIC_SO_FAR = "chaotic so far"
    """Chaotic as long as it was followed; it may not last: chaos from other starts died out, or all were
    followed too briefly. `Ensemble.escape` contains its lifetime."""


class StartMemory(StrEnum):
    """Whether the start determines which motion is reached."""

    KEPT = "kept"
    """A start a millionth of a gap away follows the same motion."""
    LOST = "lost"
    """A small change of the start grew to the size of the motion: a repeated run, on another machine or at
    another accuracy, may reach another motion."""
    UNKNOWN = "unknown"
    """Not determined, because there was no budget."""


@dataclass(frozen=True)
class FoundMotion:
    """One of the motions reached from indistinguishable starts.

    Motions are the same if their kind and period are equal and all responses agree to a thousandth, or within
    the scatter of chaos. Symmetric partners, whose responses are equal, are one motion.
    """

    motion: MotionKind
    period: int | None
    """Period of a periodic motion, in drive periods."""
    response_i: float | None
    """Largest abs(x) over the drive amplitude, from the first repeating start, else the mean over starts;
    likewise the next three."""
    response_ii: float | None
    relative_i: float | None
    relative_ii: float | None
    error_estimate: float | None
    """Relative error of Response I of one more run that reaches this motion."""
    starts: int
    """Number of starts that reached this motion."""
    share: Share
    """Share of all starts. The intervals of all motions hold together in 19 cases of 20, also for longer
    runs: starts that were chaotic, undecided, or on one of several chaotic motions may reach any other."""


@dataclass(frozen=True)
class Ensemble:
    """Motions from several starts a millionth of a gap apart, for sensitive dependence on the start."""

    starts: int
    """Number of starts, including the requested one."""
    motions: tuple[FoundMotion, ...]
    """Motions found, the largest share first."""
    requested_motion: int
    """Index of the motion from the requested start; ``asked`` in JSON."""
    unseen_share: float
    """Upper 97.5 % confidence limit of the share of a motion that was not found; also for longer runs, in
    which chaotic or undecided starts may reach it."""
    escape: EscapeRate | None
    """Rate at which chaos died out; None without chaos."""
    scatter: float | None
    """Standard deviation of Response I over all starts, over its mean."""
    followed_s: float
    """Total simulated time of all starts."""


@dataclass(frozen=True)
class TargetReport:
    """Requested and reached error and time."""

    wanted_error: float | None
    """Requested relative error; None if not requested. The same for the next."""
    wanted_time_s: float | None
    error: float | None
    """Largest of the four stated errors."""
    time_s: float
    """Time since the request."""
    starts: int
    """Number of starts in the average; 1 without sensitive dependence on the start."""
    windows: int
    """Number of consecutive windows of each start in the average."""
    is_met: bool
    """Whether the error is at most the requested one."""
    needed_s: tuple[float, float, float] | None
    """Time for the requested error: estimate and both ends of its interval. None if unknown, or if more time
    does not reduce the error."""

    @property
    def text(self) -> str:
        """Return the report as a sentence."""
        if self.error is None:
            return f"no error is known after {_seconds(self.time_s)}"
        reached = _percent(self.error)
        if self.is_met:
            return f"{reached} reached in {_seconds(self.time_s)}"
        sentence = f"{reached} after {_seconds(self.time_s)}"
        wanted = _percent(self.wanted_error or 0.0)
        if self.needed_s is None:
            return f"{sentence}; the time for {wanted} is not known"
        about, low, high = (_short(each) for each in self.needed_s)
        return f"{sentence}; {wanted} needs about {about} s ({low} to {high})"


def _percent(error: float) -> str:
    return f"{_short(100.0 * error)} %"


def _seconds(time_s: float) -> str:
    return f"{_short(time_s)} s"


def _short(value: float) -> str:
    """Return a number with two significant digits."""
    return f"{float(f'{value:.2g}'):g}"


class Method(StrEnum):
    """Method of solving a scene."""

    CLOSED_FORM = "closed form"
    """A bound proves that no stop is ever touched: exact solution of the linear specimen."""
    EVENT_DRIVEN = "event driven"
    """Exact flight from contact to contact; contacts resolved to the tolerance."""
    POLYNOMIAL = "polynomial"
    """For a force at every p: steps of eight Gauss points throughout."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ScenePrediction:
    """Responses of one scene, with errors and details. None if not requested or not found.

    Responses are divided by the drive amplitude; relative ones are of p = y - z.
    """

    frequency_hz: float
    amplitude_m: float
    response_i: float | None
    """Largest abs(x) over the window."""
    response_ii: float | None
    """Amplitude of x at the drive frequency."""
    relative_i: float | None
    """Largest abs(p) over the window."""
    relative_ii: float | None
    """Amplitude of p at the drive frequency."""
    impacts: int
    """Contacts that began within the window."""
    impact_rate_hz: float
    """Impacts per second within the window."""
    motion: MotionKind
    period: int | None = None
    """Period of a periodic motion, in drive periods."""
    duration_s: float
    """Time for which the specimen was followed."""
    window_s: float
    """Last part of that time, over which largest values were taken."""
    settled_s: float | None = None
    """Time when the motion was found to be settled; None if the duration was given."""
    ended: str
    """Reason for the end of the run."""
    integration_error: float | None = None
    """Part of the error that a stricter accuracy would reduce."""
    scatter: float | None = None
    """Relative standard deviation of Response I between windows, if the motion never repeats."""
    lyapunov_per_s: float | None = None
    """Largest Lyapunov exponent [1/s]."""
    lyapunov_error_per_s: float | None = None
    """Standard error of the exponent [1/s]."""
    start: str
    """Name of the initial state: "rest", or the scene's name."""
    final_state: State
    outcome: Outcome
    method: Method
    accuracy: str
    response_i_error: float | None = None
    """Relative error; see `vibench.sim.scene.solve.solve_scene`, also for the next three."""
    response_ii_error: float | None = None
    relative_i_error: float | None = None
    relative_ii_error: float | None = None
    error_estimate: float | None = None
    """The largest of the four."""
    section: Floats | None = None
    """States once per drive period within the window, if a Poincaré section was requested, shape (n, 6)."""
    spectrum_hz: Floats | None = None
    """Frequencies of the lines, if a spectrum was requested, shape (lines,)."""
    spectrum: Floats | None = None
    """Amplitude of x at each frequency over the drive amplitude, shape (lines,)."""
    memory: StartMemory = StartMemory.UNKNOWN
    """Whether the start determined which motion was reached."""
    ensemble: Ensemble | None = None
    """Motions from other starts; None if the start determined the motion, or without a budget."""
    target: TargetReport | None = None
    """Requested and reached error and time; None if neither was requested."""

    @property
    def is_one_of_several(self) -> bool:
        """Return whether other starts reached other motions."""
        return self.ensemble is not None and len(self.ensemble.motions) > 1

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON, None for NaN."""
        return _fields_of(self)


def _fields_of(
    value: ScenePrediction | Ensemble | FoundMotion | Share | EscapeRate | TargetReport,
) -> dict[str, object]:
    key = {"requested_motion": "asked"}
    return {key.get(each.name, each.name): _plain(getattr(value, each.name)) for each in fields(value)}


def _plain(value: object) -> object:  # noqa: PLR0911 - a row for each kind of value
    match value:
        case Outcome():
            return value.text
        case StrEnum():
            return str(value)
        case np.ndarray():
            return value.tolist()
        case float() if not np.isfinite(value):
            return None
        case tuple():
            return [_plain(each) for each in value]
        case Ensemble() | FoundMotion() | Share() | EscapeRate() | TargetReport():
            return _fields_of(value)
        case _:
            return value
