"""Result of a scene: a flat, immutable record for tables, files and JSON. SI units."""

from dataclasses import dataclass, fields
from enum import StrEnum

import numpy as np

from ..engine.run import Outcome
from ..specimen.specimen import Floats
from .shares import UNSURE, EscapeRate, Share

State = tuple[float, float, float, float, float, float]
"""x, y, z, vx, vy, vz in the inertial frame [m, m/s]."""


def state_of(values: Floats) -> State:
    """Return a state, shape (6,), as a tuple."""
    x, y, z, vx, vy, vz = (float(value) for value in values)
    return (x, y, z, vx, vy, vz)


class MotionKind(StrEnum):
    """Kind of a motion, decided from its states once per drive period."""

    PERIODIC = "periodic"
    """The motion repeats after `ScenePrediction.period` drive periods."""
    QUASI_PERIODIC = "quasi-periodic"
    """The motion does not repeat, but a small change of the initial state does not grow (quasi-periodic)."""
    CHAOTIC = "chaotic"
    """The motion does not repeat, and a small change of the initial state grows."""
    UNDECIDED = "undecided"
    """The simulated time is too short to classify the motion."""
    CHAOTIC_SO_FAR = "chaotic so far"
    """Chaotic during the simulated time, but perhaps not for ever: chaos ended in runs from other starts, or
    all runs were too short to tell. `Ensemble.escape` contains the lifetime of chaos."""


class StartMemory(StrEnum):
    """Whether the start (initial state) determines the final motion."""

    KEPT = "kept"
    """A start that differs by a millionth of the gap leads to the same motion at the same time."""
    LOST = "lost"
    """A small perturbation of the start grew to the size of the motion. A repeated run, on another machine or
    at another accuracy, may therefore reach another motion."""
    UNKNOWN = "unknown"
    """Not determined, because no computing time was allowed for this test, or the run failed."""


@dataclass(frozen=True)
class FoundMotion:
    """One of the motions reached from nearly equal starts.

    Two motions count as the same if kind and period are equal and responses agree to 0.1 % or, in chaos,
    within the scatter. A motion and its mirror image have the same responses and count as one motion.
    """

    motion: MotionKind
    period: int | None
    """Period of a periodic motion, in drive periods."""
    response_i: float | None
    """Largest abs(x) divided by the drive amplitude: from one start if the motion repeats, otherwise the mean
    over all starts that reached the motion. The next three responses are computed in the same way."""
    response_ii: float | None
    relative_i: float | None
    relative_ii: float | None
    error_estimate: float | None
    """Expected relative change of Response I in another run that reaches this motion."""
    starts: int
    """Number of starts (initial states) that led to this motion."""
    share: Share
    """Share of all starts; the 95 % intervals of all motions hold jointly, and allow for longer runs, where
    starts that are undecided, chaotic so far, or on one of several chaotic motions may end elsewhere."""


@dataclass(frozen=True)
class Ensemble:
    """Motions reached from several starts that differ by a millionth of the gap."""

    starts: int
    """Number of starts (initial states), including the requested one."""
    motions: tuple[FoundMotion, ...]
    """Motions found, the most frequent first."""
    requested_motion: int
    """Index of the motion reached from the requested start; key ``asked`` in JSON."""
    unseen_share: float
    """Upper 97.5 % confidence limit of the share of a motion that was not found. The limit allows for longer
    runs, in which chaotic or undecided starts may reach such a motion."""
    escape: EscapeRate | None
    """Rate at which chaos ends; None without chaos."""
    scatter: float | None
    """Relative standard deviation of Response I over all starts."""
    followed_s: float
    """Sum of the simulated times of the runs from all starts [s]."""


@dataclass(frozen=True)
class TargetReport:
    """Requested and reached error and computing time."""

    wanted_error: float | None
    """Target relative error; None if not requested. The same holds for ``wanted_time_s``."""
    wanted_time_s: float | None
    error: float | None
    """Largest of the stated errors of the four responses; None if unknown."""
    time_s: float
    """Computing time used since the request [s]."""
    starts: int
    """Number of starts over which responses are averaged; 1 without sensitive dependence on the start."""
    windows: int
    """Number of consecutive windows per start that are averaged."""
    is_met: bool
    """Whether the reached error is at most the requested error."""
    needed_s: tuple[float, float, float] | None
    """Computing time for the target error [s]: estimate, lower and upper limit. None if unknown, or if
    more time does not reduce the error."""
    is_reachable: bool = True
    """Whether the target error can be reached with more time; False if this would take over ten days."""

    @property
    def unseen_share(self) -> float:
        """Upper 95 % confidence limit of the share of starts that lead to a motion not yet found.

        The stated error does not include such motions if all starts are chaotic.
        """
        return 1.0 - UNSURE ** (1.0 / self.starts) if self.starts > 0 else 1.0

    @property
    def text(self) -> str:
        """Return requested and reached error and time as a phrase, and the share that the starts may miss."""
        missed = f"{self.starts} starts may miss motions with shares up to {_percent(self.unseen_share)}"
        return f"{self._reached}; {missed}" if self.starts > 1 else self._reached

    @property
    def _reached(self) -> str:
        reached = "no error is known" if self.error is None else _percent(self.error)
        if self.is_met:
            return f"{reached} reached in {_seconds(self.time_s)}"
        sentence = f"{reached} after {_seconds(self.time_s)}"
        if self.wanted_error is None:
            return sentence
        wanted = _percent(self.wanted_error)
        if not self.is_reachable:
            return f"{sentence}; {wanted} is not reachable"
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
    """Method by which a scene is solved."""

    CLOSED_FORM = "closed form"
    """Exact linear solution; only if a bound proves that no stop is ever touched."""
    EVENT_DRIVEN = "event driven"
    """Exact linear solution between contacts; time integration during contacts."""
    POLYNOMIAL = "polynomial"
    """Time integration with eight Gauss points per step, for a force that acts at every p."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ScenePrediction:
    """Responses of one scene, with errors and details; a field is None if not requested or not known.

    Responses are divided by the drive amplitude. ``relative_i`` and ``relative_ii`` are the responses of p.
    """

    frequency_hz: float
    amplitude_m: float
    response_i: float | None
    """Response I: largest abs(x) in the window, divided by the drive amplitude."""
    response_ii: float | None
    """Response II: amplitude of x at the drive frequency, divided by the drive amplitude."""
    relative_i: float | None
    """Response I of p: largest abs(p) in the window, divided by the drive amplitude."""
    relative_ii: float | None
    """Response II of p: amplitude of p at the drive frequency, divided by the drive amplitude."""
    impacts: int
    """Number of contacts that began within the window."""
    impact_rate_hz: float
    """Mean number of impacts per second within the window."""
    motion: MotionKind
    period: int | None = None
    """Period of a periodic motion, in drive periods."""
    duration_s: float
    """Simulated time of the run [s]."""
    window_s: float
    """Length of the window at the end of the simulated time [s]."""
    settled_s: float | None = None
    """Time at which the motion was found to have settled [s]; None if not found, or a duration was given."""
    ended: str
    """Reason for the end of the run."""
    integration_error: float | None = None
    """Error of the responses due to integration, which a stricter accuracy would reduce."""
    scatter: float | None = None
    """Relative standard deviation of Response I between windows of a motion that never repeats."""
    lyapunov_per_s: float | None = None
    """Largest Lyapunov exponent of the motion [1/s]."""
    lyapunov_error_per_s: float | None = None
    """Standard error of the Lyapunov exponent [1/s]."""
    start: str
    """Name of the initial state: "rest", or the name given in the scene."""
    final_state: State
    outcome: Outcome
    method: Method
    accuracy: str
    response_i_error: float | None = None
    """Relative error of ``response_i``; `vibench.sim.scene.solve.solve_scene` defines all four errors."""
    response_ii_error: float | None = None
    relative_i_error: float | None = None
    relative_ii_error: float | None = None
    error_estimate: float | None = None
    """Largest of the relative errors of the four responses."""
    section: Floats | None = None
    """States once per drive period in the window, shape (n, 6), if a Poincaré section was requested."""
    spectrum_hz: Floats | None = None
    """Frequencies of the spectral lines, shape (lines,) [Hz], if a spectrum was requested."""
    spectrum: Floats | None = None
    """Amplitude of x at each spectral line, divided by the drive amplitude, shape (lines,)."""
    memory: StartMemory = StartMemory.UNKNOWN
    """Whether the start (initial state) determines the final motion."""
    ensemble: Ensemble | None = None
    """Motions reached from other starts; None if the start determines the motion, or no time was allowed."""
    target: TargetReport | None = None
    """Requested and reached error and computing time; None if neither error nor time was requested."""

    @property
    def is_one_of_several(self) -> bool:
        """Whether runs from other starts reached other motions."""
        return self.ensemble is not None and len(self.ensemble.motions) > 1

    def to_dict(self) -> dict[str, object]:
        """Return the fields as plain values for JSON, with None for NaN."""
        return _fields_of(self)


def _fields_of(
    value: ScenePrediction | Ensemble | FoundMotion | Share | EscapeRate | TargetReport,
) -> dict[str, object]:
    key = {"requested_motion": "asked"}
    return {key.get(each.name, each.name): _plain(getattr(value, each.name)) for each in fields(value)}


def _plain(value: object) -> object:  # noqa: PLR0911 - one case for each kind of value
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
