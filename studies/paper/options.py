"""Options for choices that the paper leaves open, and their changes by name."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from vibench.analysis import SIMILARITY_THRESHOLD, InvalidRequest, LogarithmOf
from vibench.sim import Accuracy, Observable, Specimen, SpecimenTable, usual_specimen
from vibench.sim.study import GivenStart, Study, StudyObservable, frequency_range

AMPLITUDES_M = (1e-6, 5e-6, 10e-6, 50e-6)
"""The paper's four amplitudes, from weak to strong (section 3.1; Figs. 3, 6 and 7)."""
LOWEST_HZ = 5.0
_LONGEST_DAMPING_TIME_S = 0.01
"""Largest damping time, more than fifteen times critical damping in the paper's third mode."""
_LEAST_GAP_M, _LARGEST_GAP_M = 1e-9, 0.01
"""Limits of the gap [m]: 1/1000 of the smallest drive amplitude, and 200 times the largest amplitude."""
_PAPER = usual_specimen()
AS_CHOSEN = "the defaults"
FIT_M = 1e-6
"""Indentation [m] at which continuous models are fitted to the stops: p = 46 um (section 2)."""
STEEPEST_FALL = 10.0
PUSH, PUSHED_HZ = 1e-6, 260.0
"""Largest displacement in initial states other than rest [gaps]; frequency for scaling velocities [Hz]."""
WITH_EXPONENT: tuple[StudyObservable, ...] = (Observable.RESPONSE, Observable.LYAPUNOV)


class FrequencyGrid(StrEnum):
    """Spacing of the frequencies; the paper does not give it."""

    COARSE = "coarse"
    """Every 5 Hz, similar to the paper's curves."""
    FINE = "fine"
    """Every 1 Hz, which resolves each jump."""

    @property
    def step_hz(self) -> float:
        """Frequency spacing."""
        return {FrequencyGrid.COARSE: 5.0, FrequencyGrid.FINE: 1.0}[self]


class ExponentsBy(StrEnum):
    """Method for Lyapunov exponents; responses always use the exact motion."""

    EXACT = "exact"
    ODE45 = "ode45"
    """Dormand and Prince's method at MATLAB's default tolerances, 1e-3 and 1e-6, in SI units."""


class Direction(StrEnum):
    """Direction of the sweep of Fig. 13(d)."""

    UP = "up"
    DOWN = "down"


@dataclass(frozen=True)
class Case:
    """Named options for choices that the paper leaves open, for figures and for claims."""

    name: str = AS_CHOSEN
    damping_time_s: float = 2e-5
    """c_i = damping time * k_i."""
    damping_ratio: float | None = None
    """c_i = 2 * damping ratio * m_i * w_i of each mass on its own spring; replaces the damping time."""
    gap_m: float = 45e-6
    accuracy: Accuracy = Accuracy.STANDARD
    grid: FrequencyGrid = FrequencyGrid.COARSE
    highest_hz: float = 600.0
    similarity_highest_hz: float = 500.0
    """Upper end of the frequency grid for comparing models; similarity rates depend on this limit."""
    logarithm_of: LogarithmOf = LogarithmOf.MILLIMETRES
    threshold: float = SIMILARITY_THRESHOLD
    duration_s: float = 30.0
    window_s: float = 5.0
    """Observed window as in the paper: the last 5 s of 30 s from rest."""
    budget_s: float = 0.0
    """Time for runs from other initial states: zero, because each point in the paper is from one run."""
    sweep_amplitude_m: float = 5e-6
    """Base amplitude at 266 Hz: the value that the paper gives for 1.5 V."""
    sweep_falls: float = 0.0
    """Exponent k of a base amplitude ~ f^-k; 0, 1, 2 for constant displacement, velocity, acceleration."""
    sweep_goes: Direction = Direction.UP
    fit_m: float = FIT_M
    sum_model: str = "power:3+5+7"
    """The model n = 3+5+7 with the shares of its terms, which the paper does not give."""
    exponents_by: ExponentsBy = ExponentsBy.EXACT
    changed: tuple[str, ...] = ()
    """Options that differ from the program's defaults, in words."""
    draw: int = 0
    """Number of the initial state: 0 is rest; each other state is a millionth of the gap away from rest."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping_time_s <= _LONGEST_DAMPING_TIME_S:
            raise InvalidRequest(
                f"a damping time of {self.damping_time_s:g} s is not allowed; give 0 to "
                f"{_LONGEST_DAMPING_TIME_S:g}"
            )
        if self.damping_ratio is not None and not 0.0 <= self.damping_ratio < math.inf:
            raise InvalidRequest(
                f"a damping ratio of {self.damping_ratio} is not allowed; give zero or a positive ratio"
            )
        if not _LEAST_GAP_M <= self.gap_m <= _LARGEST_GAP_M:
            raise InvalidRequest(
                f"a gap of {self.gap_m:g} m is not allowed; give {_LEAST_GAP_M:g} to {_LARGEST_GAP_M:g}"
            )
        for what, value in (("a base amplitude", self.sweep_amplitude_m), ("an indentation", self.fit_m)):
            if not 0.0 < value < math.inf:
                raise InvalidRequest(f"{what} of {value:g} m is not allowed; give a positive length")
        if not 0.0 <= self.sweep_falls <= STEEPEST_FALL:
            raise InvalidRequest(
                f"a base amplitude ~ f^-{self.sweep_falls:g} is not allowed; give a power from "
                f"0 to {STEEPEST_FALL:g}"
            )
        top_hz = Case.highest_hz
        if not LOWEST_HZ < self.similarity_highest_hz <= top_hz:
            raise InvalidRequest(
                f"models are simulated from {LOWEST_HZ:g} to {top_hz:g} Hz and cannot be compared up to "
                f"{self.similarity_highest_hz:g} Hz; give a frequency in this range"
            )
        try:
            self._specimen_table.specimen(self.sum_model, None, self.gap_m)
        except ValueError as error:
            raise InvalidRequest(f"the model n = 3+5+7 cannot be {self.sum_model}: {error}") from error

    @property
    def frequencies_hz(self) -> tuple[float, ...]:
        """Frequencies of a response curve."""
        return frequency_range(LOWEST_HZ, self.highest_hz, self.grid.step_hz)

    @property
    def similarity_frequencies_hz(self) -> tuple[float, ...]:
        """Frequencies for the comparison of models."""
        return frequency_range(LOWEST_HZ, self.similarity_highest_hz, self.grid.step_hz)

    def model_name(self, model: str) -> str:
        """Return a model's name, with the indentation of the fit if this case changes that indentation."""
        return model if self.fit_m == FIT_M or not model.startswith("power:") else f"{model}:{self.fit_m:g}"

    def study(self, models: tuple[str, ...], amplitudes_m: tuple[float, ...], **replaced: Any) -> Study:
        """Return the study of models at amplitudes with these options; other fields may be replaced."""
        chosen: dict[str, Any] = {
            "models": tuple(map(self.model_name, models)),
            "amplitudes_m": amplitudes_m,
            "gaps_m": (self.gap_m,),
            "specimen": self._specimen_table,
            "damping_times_s": (self.damping_time_s,) if self.damping_ratio is None else None,
            "frequencies_hz": self.frequencies_hz,
            "accuracy": self.accuracy,
            "duration_s": self.duration_s,
            "window_s": self.window_s,
            "budget_s": self.budget_s,
        }
        if self.draw:
            chosen["starts"] = (GivenStart(label=f"draw {self.draw}", state=self.start),)
        return Study(**(chosen | replaced))

    def specimen(self, contact: str = "hertz") -> Specimen:
        """Return the paper's specimen with these options."""
        damping_time_s = self.damping_time_s if self.damping_ratio is None else None
        return self._specimen_table.specimen(self.model_name(contact), damping_time_s, self.gap_m)

    @property
    def only_damping_time_s(self) -> float:
        """Damping time for a figure without damping ratio; raises InvalidRequest if a ratio is set."""
        if self.damping_ratio is not None:
            raise InvalidRequest("this figure takes no damping ratio; give a damping time")
        return self.damping_time_s

    @property
    def _specimen_table(self) -> SpecimenTable:
        if self.damping_ratio is None:
            return _PAPER
        masses_and_springs = zip(_PAPER.masses_kg, _PAPER.stiffnesses, strict=True)
        dampings = [2.0 * self.damping_ratio * math.sqrt(m * k) for m, k in masses_and_springs]
        return SpecimenTable.model_validate({"dampings_ns_per_m": dampings})

    @property
    def damping(self) -> str:
        """The damping in words."""
        if self.damping_ratio is None:
            return f"c = {self.damping_time_s:.3g} s · k"
        return f"c_i = 2 · {self.damping_ratio:g} · m_i ω_i"

    @property
    def sentence(self) -> str:
        """The options as a sentence under a figure."""
        return (
            f"Options: {self.damping}, gap {1e6 * self.gap_m:g} µm, "
            f"{self.accuracy.value} accuracy, every {self.grid.step_hz:g} Hz, {self.duration_s:g} s from "
            f"rest, the last {self.window_s:g} s observed."
        )

    @property
    def start(self) -> tuple[float, float, float, float, float, float]:
        """Initial x, y, z, vx, vy, vz [m, m/s]."""
        if self.draw == 0:
            return (0.0,) * 6
        speed = 2.0 * math.pi * PUSHED_HZ
        x, y, z, vx, vy, vz = PUSH * self.gap_m * np.random.default_rng(self.draw).uniform(-1, 1, 6)
        return (float(x), float(y), float(z), float(speed * vx), float(speed * vy), float(speed * vz))

    @property
    def choices(self) -> str:
        """The default options in words, followed by the changed options."""
        chosen = self.sentence.replace("Options:", "Defaults:")
        return f"{chosen} Changed: {'; '.join(self.changed)}." if self.changed else chosen


@dataclass(frozen=True)
class Alternative:
    """A named change of a case's options."""

    name: str
    changes: Mapping[str, Any]

    def of(self, case: Case) -> Case:
        """Return the case with these changes and this name.

        Raises InvalidRequest for a value that is not allowed.
        """
        return replace(case, name=self.name, **self.changes)


def together(*alternatives: Alternative) -> Alternative:
    """Return an alternative that combines the options of several alternatives."""
    changes = {key: value for each in alternatives for key, value in each.changes.items()}
    return Alternative(", ".join(each.name for each in alternatives), changes)


def damping(damping_time_s: float) -> Alternative:
    """Return an alternative with another damping time c_i / k_i."""
    changes = {"damping_time_s": damping_time_s, "damping_ratio": None}
    return Alternative(f"c = {damping_time_s:.3g} s · k", changes)


@dataclass(frozen=True)
class Option:
    """A setting that the paper leaves open, in the form NAME=VALUE."""

    about: str
    example: str
    field: str
    label: Callable[[Any], str]
    """Function of the value that returns the name of a case in which this setting is changed."""
    read: Callable[[str], Any] = float


OPTIONS: Mapping[str, Option] = {
    "zeta": Option(
        "the damping ratio in c_i = 2 zeta m_i w_i, each mass on its own spring",
        "0.0165",
        "damping_ratio",
        "c_i = 2 · {:g} · m_i ω_i".format,
    ),
    "gap": Option("clearance [m]", "45e-6", "gap_m", lambda gap_m: f"gap {1e6 * gap_m:g} µm"),
    "fit": Option(
        "indentation at which models are fitted [m]",
        "0.45e-6",
        "fit_m",
        lambda fit_m: f"models fitted at {1e6 * fit_m:g} µm",
    ),
    "sum": Option(
        "shares of 3+5+7", "3@0.05+5@0.15+7@0.8", "sum_model", "the sum as {}".format, "power:{}".format
    ),
    "compared": Option(
        "highest frequency at which models are compared [Hz]",
        "400",
        "similarity_highest_hz",
        "models compared up to {:g} Hz".format,
    ),
    "log": Option(
        f"log10 of eq. 6 in {', '.join(LogarithmOf)}",
        "mm",
        "logarithm_of",
        "log10 of the response [{}]".format,
        LogarithmOf,
    ),
    "exponents": Option(
        " or ".join(ExponentsBy), "ode45", "exponents_by", "exponents by {}".format, ExponentsBy
    ),
    "sweep-amplitude": Option(
        "base amplitude of the sweep [m]",
        "5e-6",
        "sweep_amplitude_m",
        lambda amplitude_m: f"sweep of {1e6 * amplitude_m:g} µm",
    ),
    "sweep-falls": Option(
        "exponent k of A0 ~ f^-k in the sweep", "2", "sweep_falls", "sweep with A0 ~ f^-{:g}".format
    ),
    "sweep": Option(" or ".join(Direction), "down", "sweep_goes", "a {}ward sweep".format, Direction),
}
"""Settings for `vibench reproduce --with`."""


def change(name: str, value: Any) -> Alternative:
    """Return the alternative that changes a setting."""
    option = OPTIONS[name]
    return Alternative(option.label(value), {option.field: value})


def case_with(options: Case, given: Sequence[str]) -> Case:
    """Return the case with these options and the settings NAME=VALUE.

    Raises InvalidRequest as `parse_option` does.
    """
    named = [parse_option(each) for each in given]
    case = replace(options, changed=tuple(each.name for each in named))
    return replace(case, **together(*named).changes)


def parse_option(text: str) -> Alternative:
    """Parse NAME=VALUE; raises InvalidRequest for an unknown name or a value that is not allowed."""
    name, _, value = (part.strip() for part in text.partition("="))
    if name not in OPTIONS:
        forms = ", ".join(f"{key}={option.example}" for key, option in OPTIONS.items())
        raise InvalidRequest(f"{text!r} is not an option of the paper; give one such as {forms}")
    option = OPTIONS[name]
    try:
        found = change(name, option.read(value))
        found.of(Case())
    except InvalidRequest:
        raise
    except ValueError as error:
        raise InvalidRequest(
            f"{text!r} is not allowed: {name} is {option.about}, such as {name}={option.example}"
        ) from error
    return found


SCORED_S = (1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5, 4e-5, 5e-5)
"""Values of c_i / k_i [s]: 1e-5 s is the paper's value read in mm, g and ms; larger values prevent chaos."""
ALIKE = change("zeta", 0.0165)
BY_ODE45 = change("exponents", ExponentsBy.ODE45)
DAMPINGS = (*(damping(value) for value in SCORED_S if value != Case.damping_time_s), ALIKE)
"""Damping values to test, in this order, for a claim that depends on damping."""
NARROWER_FIT = change("fit", 0.45e-6)
SEVENTH_COUNTS = change("sum", "power:3@0.05+5@0.15+7@0.8")
COMPARED_LOWER = change("compared", 400.0)
CLOSEST = together(NARROWER_FIT, SEVENTH_COUNTS, COMPARED_LOWER)
"""The options of the continuous models with which the most claims hold."""
