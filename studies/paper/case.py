"""Cases: one value for each option that the paper leaves open, and alternatives to test."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from vibench.analysis import InvalidRequest, LogarithmOf
from vibench.sim import Specimen
from vibench.sim.study import GivenStart, Study

from .options import LOWEST_HZ, FigureOptions

AS_CHOSEN = "the defaults"
FIT_M = 1e-6
"""Indentation [m] at which continuous models are fitted to the stops: p = 46 um (section 2)."""
STEEPEST_FALL = 10.0
PUSH, PUSHED_HZ = 1e-6, 260.0
"""Largest displacement of initial states other than rest [gaps]; frequency that scales velocities [Hz]."""


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
class Case(FigureOptions):
    """Options with which claims are measured."""

    name: str = AS_CHOSEN
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
        for what, value in (("a base amplitude", self.sweep_amplitude_m), ("an indentation", self.fit_m)):
            if not 0.0 < value < math.inf:
                raise InvalidRequest(f"{what} of {value:g} m is not allowed; give a positive one")
        if not 0.0 <= self.sweep_falls <= STEEPEST_FALL:
            raise InvalidRequest(
                f"a base amplitude ~ f^-{self.sweep_falls:g} is not allowed; give a power from "
                f"0 to {STEEPEST_FALL:g}"
            )
        top_hz = FigureOptions.highest_hz
        if not LOWEST_HZ < self.similarity_highest_hz <= top_hz:
            raise InvalidRequest(
                f"models are simulated from {LOWEST_HZ:g} to {top_hz:g} Hz and cannot be compared up to "
                f"{self.similarity_highest_hz:g} Hz; give a frequency in this range"
            )
        super().__post_init__()
        try:
            super().specimen(self.sum_model)
        except ValueError as error:
            raise InvalidRequest(f"the model n = 3+5+7 cannot be {self.sum_model}: {error}") from error

    def model_name(self, model: str) -> str:
        """Return a model's name, with the indentation of the fit if this case changes that indentation."""
        return model if self.fit_m == FIT_M or not model.startswith("power:") else f"{model}:{self.fit_m:g}"

    def specimen(self, contact: str = "hertz") -> Specimen:
        """Return the paper's specimen with the options of this case."""
        return super().specimen(self.model_name(contact))

    def study(self, models: tuple[str, ...], amplitudes_m: tuple[float, ...], **replaced: Any) -> Study:
        """Return a study with the initial state of this case."""
        if self.draw:
            replaced["starts"] = (GivenStart(label=f"draw {self.draw}", state=self.start),)
        return super().study(tuple(map(self.model_name, models)), amplitudes_m, **replaced)

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
    label: str
    """Format of the name of a case in which this setting is changed."""
    read: Callable[[str], Any] = float
    scale: float | None = None
    """Factor that converts the value to the number in the label; None for the value itself."""


OPTIONS: Mapping[str, Option] = {
    "zeta": Option(
        "the damping ratio in c_i = 2 zeta m_i w_i, each mass on its own spring",
        "0.0165",
        "damping_ratio",
        "c_i = 2 · {:g} · m_i ω_i",
    ),
    "gap": Option("clearance [m]", "45e-6", "gap_m", "gap {:g} µm", scale=1e6),
    "fit": Option(
        "indentation at which models are fitted [m]",
        "0.45e-6",
        "fit_m",
        "models fitted at {:g} µm",
        scale=1e6,
    ),
    "sum": Option("shares of 3+5+7", "3@0.05+5@0.15+7@0.8", "sum_model", "the sum as {}", "power:{}".format),
    "compared": Option(
        "highest frequency at which models are compared [Hz]",
        "400",
        "similarity_highest_hz",
        "models compared up to {:g} Hz",
    ),
    "log": Option(
        f"log10 of eq. 6 in {', '.join(LogarithmOf)}",
        "mm",
        "logarithm_of",
        "log10 of the response [{}]",
        LogarithmOf,
    ),
    "exponents": Option(" or ".join(ExponentsBy), "ode45", "exponents_by", "exponents by {}", ExponentsBy),
    "sweep-amplitude": Option(
        "base amplitude of the sweep [m]", "5e-6", "sweep_amplitude_m", "sweep of {:g} µm", scale=1e6
    ),
    "sweep-falls": Option(
        "exponent k of A0 ~ f^-k in the sweep", "2", "sweep_falls", "sweep with A0 ~ f^-{:g}"
    ),
    "sweep": Option(" or ".join(Direction), "down", "sweep_goes", "a {}ward sweep", Direction),
}
"""Settings for `vibench reproduce --with`."""


def change(name: str, value: Any) -> Alternative:
    """Return the alternative that changes a setting."""
    option = OPTIONS[name]
    shown = value if option.scale is None else option.scale * value
    return Alternative(option.label.format(shown), {option.field: value})


def case_with(options: FigureOptions, given: Sequence[str]) -> Case:
    """Return the case with these options and the settings NAME=VALUE.

    Raises InvalidRequest as `parse_option` does.
    """
    named = [parse_option(each) for each in given]
    case = Case(**vars(options), changed=tuple(each.name for each in named))
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
DAMPINGS = (*(damping(value) for value in SCORED_S if value != FigureOptions.damping_time_s), ALIKE)
"""Damping values to test, in this order, for a claim that depends on damping."""
NARROWER_FIT = change("fit", 0.45e-6)
SEVENTH_COUNTS = change("sum", "power:3@0.05+5@0.15+7@0.8")
COMPARED_LOWER = change("compared", 400.0)
CLOSEST = together(NARROWER_FIT, SEVENTH_COUNTS, COMPARED_LOWER)
"""The options of the continuous models with which the most claims hold."""
