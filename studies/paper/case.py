"""A case: one reading of everything that the paper leaves open, under a name.

Every setting that can be changed is a row of `OPTIONS`. The dampings at which claims are measured again: the
paper leaves its unit open.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from vibench.analysis import InvalidRequest, LogarithmOf

from .options import LOWEST_HZ, FigureOptions

SWEEP_AMPLITUDE_M = 5e-6
"""Base amplitude of the sweep of Fig. 13(d): the one that the paper sets beside 1.5 V."""
EQUAL_PARTS = "power:3+5+7"
MOSTLY_SEVENTH = "power:3@0.05+5@0.15+7@0.8"
"""The paper does not say how its three terms share the force."""
FIT_M = 1e-6
"""Where continuous models have the stops' force: p = 46 um (section 2)."""
STEEPEST_FALL = 10.0
"""Of an amplitude with frequency."""
AS_CHOSEN = "the defaults"
PUSH, PUSHED_HZ = 1e-6, 260.0
"""Of other starts: displacements over the gap, and velocities over those at this frequency."""
State = tuple[float, float, float, float, float, float]


class ExponentsBy(StrEnum):
    """How exponents come about; responses are those of the exact motion."""

    EXACT = "exact"
    ODE45 = "ode45"
    """Dormand and Prince's method at MATLAB's default tolerances, 1e-3 and 1e-6, in SI units."""


class Direction(StrEnum):
    """Of the sweep of Fig. 13(d)."""

    UP = "up"
    DOWN = "down"


@dataclass(frozen=True)
class Case:
    """Options under which claims are measured."""

    name: str
    options: FigureOptions
    sweep_amplitude_m: float = SWEEP_AMPLITUDE_M
    """At 266 Hz, where the amplitude changes with frequency."""
    sweep_falls: float = 0.0
    """k of a base amplitude that goes with f^-k: 0 constant displacement, 1 velocity, 2 acceleration."""
    sweep_goes: Direction = Direction.UP
    fit_m: float = FIT_M
    """Indentation at which continuous models are fitted."""
    sum_model: str = EQUAL_PARTS
    """The model n = 3+5+7, and how its terms share the force."""
    exponents_by: ExponentsBy = ExponentsBy.EXACT
    changed: tuple[str, ...] = ()
    """Options that the defaults of a page differ in from those of the program."""
    draw: int = 0
    """Start: 0 is rest; every other number is another start, a millionth of the gap away from it."""

    def fitted(self, model: str) -> str:
        """Give a model as it is fitted here."""
        return model if self.fit_m == FIT_M or not model.startswith("power:") else f"{model}:{self.fit_m:g}"

    @property
    def sentence(self) -> str:
        """Say what is chosen."""
        chosen = self.options.sentence.replace("Options:", "Defaults:")
        return f"{chosen} Changed: {'; '.join(self.changed)}." if self.changed else chosen

    @property
    def start(self) -> State:
        """X, y, z, vx, vy, vz [m, m/s] at the beginning."""
        if self.draw == 0:
            return (0.0,) * 6
        speed = 2.0 * math.pi * PUSHED_HZ
        x, y, z, vx, vy, vz = PUSH * self.options.gap_m * np.random.default_rng(self.draw).uniform(-1, 1, 6)
        return (float(x), float(y), float(z), float(speed * vx), float(speed * vy), float(speed * vz))


@dataclass(frozen=True)
class Alternative:
    """One option changed."""

    name: str
    apply: Callable[[Case], Case]

    def of(self, case: Case) -> Case:
        """Give the case with the option changed, under the option's name."""
        return replace(self.apply(case), name=self.name)


def together(*alternatives: Alternative) -> Alternative:
    """Change several options at once."""

    def apply(case: Case) -> Case:
        for each in alternatives:
            case = each.apply(case)
        return case

    return Alternative(", ".join(each.name for each in alternatives), apply)


def damping(damping_time_s: float) -> Alternative:
    """Change c_i / k_i."""
    options = FigureOptions(damping_time_s=damping_time_s)
    return Alternative(
        options.damping,
        lambda case: replace(
            case, options=replace(case.options, damping_time_s=damping_time_s, damping_ratio=None)
        ),
    )


def damped_alike(ratio: float) -> Alternative:
    """Damp every mass on its own spring by the same ratio."""
    options = FigureOptions(damping_ratio=ratio)
    return Alternative(
        options.damping, lambda case: replace(case, options=replace(case.options, damping_ratio=ratio))
    )


def gapped(gap_m: float) -> Alternative:
    """Change the clearance; the paper's has a tolerance of 15 um."""
    _require_positive("a gap", gap_m)
    return Alternative(
        f"gap {1e6 * gap_m:g} µm", lambda case: replace(case, options=replace(case.options, gap_m=gap_m))
    )


def logarithm(of: LogarithmOf) -> Alternative:
    """Change what the logarithm of eq. 6 is taken of."""
    return Alternative(
        f"log10 of the response [{of.value}]",
        lambda case: replace(case, options=replace(case.options, logarithm_of=of)),
    )


def compared_up_to(highest_hz: float) -> Alternative:
    """Change the upper end of the frequencies at which models are compared."""
    top_hz = FigureOptions.highest_hz
    if not LOWEST_HZ < highest_hz <= top_hz:
        raise InvalidRequest(
            f"models are simulated from {LOWEST_HZ:g} to {top_hz:g} Hz and cannot be compared up to "
            f"{highest_hz:g} Hz; give a frequency between"
        )
    return Alternative(
        f"models compared up to {highest_hz:g} Hz",
        lambda case: replace(case, options=replace(case.options, similarity_highest_hz=highest_hz)),
    )


def swept_at(amplitude_m: float) -> Alternative:
    """Change the base amplitude of the sweep."""
    _require_positive("a base amplitude", amplitude_m)
    return Alternative(
        f"sweep of {1e6 * amplitude_m:g} µm", lambda case: replace(case, sweep_amplitude_m=amplitude_m)
    )


def summed(model: str) -> Alternative:
    """Change how the three terms of the sum share the force."""
    try:
        FigureOptions().specimen(model)
    except ValueError as error:
        raise InvalidRequest(f"the sum cannot be {model}: {error}") from error
    return Alternative(f"the sum as {model}", lambda case: replace(case, sum_model=model))


def sweep_falling(power: float) -> Alternative:
    """Let the base amplitude of the sweep go with f^-power."""
    if not 0.0 <= power <= STEEPEST_FALL:
        raise InvalidRequest(
            f"a base amplitude that goes with f^-{power:g} is not allowed; give a power from 0 to "
            f"{STEEPEST_FALL:g}"
        )
    return Alternative(f"sweep with A0 ~ f^-{power:g}", lambda case: replace(case, sweep_falls=power))


def swept(goes: Direction) -> Alternative:
    """Change the direction of the sweep."""
    return Alternative(f"swept {goes.value}", lambda case: replace(case, sweep_goes=goes))


def fitted_at(indentation_m: float) -> Alternative:
    """Change the indentation at which continuous models have the stops' force."""
    _require_positive("an indentation", indentation_m)
    return Alternative(
        f"models fitted at {1e6 * indentation_m:g} µm", lambda case: replace(case, fit_m=indentation_m)
    )


def exponents_by(method: ExponentsBy) -> Alternative:
    """Change how exponents come about."""
    return Alternative(f"exponents by {method.value}", lambda case: replace(case, exponents_by=method))


def _require_positive(what: str, value: float) -> None:
    if not 0.0 < value < math.inf:
        raise InvalidRequest(f"{what} of {value:g} m is not allowed; give a positive one")


@dataclass(frozen=True)
class Option:
    """A setting that the paper leaves open, as it is written: NAME=VALUE."""

    about: str
    example: str
    """A value."""
    made: Callable[[str], Alternative]


def _of_number(make: Callable[[float], Alternative]) -> Callable[[str], Alternative]:
    return lambda text: make(float(text))


OPTIONS: Mapping[str, Option] = MappingProxyType(
    {
        "zeta": Option(
            "the ratio of c_i = 2 zeta m_i w_i, each mass on its own spring",
            "0.0165",
            _of_number(damped_alike),
        ),
        "gap": Option("clearance [m]", "45e-6", _of_number(gapped)),
        "fit": Option("indentation at which models are fitted [m]", "0.45e-6", _of_number(fitted_at)),
        "sum": Option("shares of 3+5+7", "3@0.05+5@0.15+7@0.8", lambda text: summed(f"power:{text}")),
        "compared": Option("models are compared up to [Hz]", "400", _of_number(compared_up_to)),
        "log": Option(
            f"log10 of eq. 6 in {', '.join(LogarithmOf)}", "mm", lambda text: logarithm(LogarithmOf(text))
        ),
        "exponents": Option(
            f"{' or '.join(ExponentsBy)}", "ode45", lambda text: exponents_by(ExponentsBy(text))
        ),
        "sweep-amplitude": Option("of the sweep's base [m]", "5e-6", _of_number(swept_at)),
        "sweep-falls": Option("k of the sweep's A0 ~ f^-k", "2", _of_number(sweep_falling)),
        "sweep": Option(f"{' or '.join(Direction)}", "down", lambda text: swept(Direction(text))),
    }
)
"""What `vibench reproduce --with` takes."""


def case_with(options: FigureOptions, said: Sequence[str]) -> Case:
    """Give the defaults of a page: options, and what is said as NAME=VALUE.

    Raises InvalidRequest as `option_named` does.
    """
    named = [option_named(each) for each in said]
    case = together(*named).apply(Case(AS_CHOSEN, options))
    return replace(case, changed=tuple(each.name for each in named))


def option_named(text: str) -> Alternative:
    """Read NAME=VALUE.

    Raises InvalidRequest for a name that is no row of `OPTIONS`, or a value that it does not take.
    """
    name, _, value = (part.strip() for part in text.partition("="))
    if name not in OPTIONS:
        forms = ", ".join(f"{key}={option.example}" for key, option in OPTIONS.items())
        raise InvalidRequest(f"{text!r} is no option of the paper; give one such as {forms}")
    option = OPTIONS[name]
    try:
        return option.made(value)
    except InvalidRequest:
        raise
    except ValueError as error:
        raise InvalidRequest(
            f"{text!r} is not allowed: {name} is {option.about}, such as {name}={option.example}"
        ) from error


SCORED_S = (1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5, 4e-5, 5e-5)
"""c_i / k_i: 1e-5 s is the literal reading in mm, g and ms; the chaos that the paper shows ends above."""
ALIKE = damped_alike(0.0165)
BY_ODE45 = exponents_by(ExponentsBy.ODE45)
DAMPINGS = (*(damping(value) for value in SCORED_S if value != FigureOptions.damping_time_s), ALIKE)
"""Tried, in this order, where a claim turns on the damping."""
NARROWER_FIT = fitted_at(0.45e-6)
SEVENTH_COUNTS = summed(MOSTLY_SEVENTH)
COMPARED_LOWER = compared_up_to(400.0)
CLOSEST = together(NARROWER_FIT, SEVENTH_COUNTS, COMPARED_LOWER)
"""The reading of the continuous models under which most claims hold."""
