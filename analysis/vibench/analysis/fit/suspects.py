"""Find wrong assumptions of a model that does not fit, by dropping each assumption in turn."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import ClassVar

import numpy as np

from vibench.sim import Specimen

from ..signals.arrays import Complexes, Reals
from .lines import Freedom, LineFit, Lines, fit_lines_further, loaded_response, own_response
from .parameters import DAMPERS, MASSES, SHOWN, Parameter, parameter_value

TOLD_APART = 2.0 * float(np.log(20.0))
"""Twice the log likelihood ratio (20 to 1) above which only the better explanation is named."""
_HIGHEST_HZ = 2e4
_MODE_LOW, _MODE_HIGH = (1e-6, 1e-4), (1.0, 0.3)
"""Lower and upper limits of mass ratio and damping ratio of a further mode."""
_MODE_START = (float(np.log(0.02)), float(np.log(0.01)))
"""Start values of the search for a further mode: logarithms of mass ratio and damping ratio."""


class Assumption(StrEnum):
    """Assumption of the model about specimen, sensors or rig."""

    M0 = "m0"
    M1 = "m1"
    M2 = "m2"
    C0 = "c0"
    C1 = "c1"
    C2 = "c2"
    FRICTION = "friction"
    SENSITIVITY = "sensitivity"
    """Ratio of the sensitivities of vibrometer and accelerometer; only the ratio is observable."""
    EXTRA_MODE = "extra mode"
    TABLE_MASS = "table mass"
    GAPS = "gaps"
    LINEARITY = "linearity"


@dataclass(frozen=True)
class Suspect:
    """An assumption of the model, and the quality of the fit without it."""

    DOCUMENT: ClassVar = (
        "assumption would_mend_it=sentence reduced_chi_square mends behind_the_likeliest=behind"
    )

    assumption: Assumption
    sentence: str
    """The change that explains the misfit, with its size."""
    reduced_chi_square: float
    mends: bool
    """Whether the model fits when this assumption is dropped."""
    behind: float
    """Twice the log likelihood ratio to the best suspect, with a penalty of ln(data values) per parameter."""

    @property
    def may_be_it(self) -> bool:
        """Whether the data do not distinguish this assumption from the best suspect."""
        return self.behind < TOLD_APART


def suspects(lines: Lines, usual: LineFit, *, is_nonlinear: bool | None) -> tuple[Suspect, ...]:
    """Fit without each assumption in turn; return them ranked by likelihood and number of parameters.

    Parameters
    ----------
    lines
        Spectral lines that the described model does not fit.
    usual
        Fit of the described model.
    is_nonlinear
        Whether realisations scatter more than noise; None if unknown.
    """
    tried = []
    for assumption, allowed, describe in _assumptions(lines, is_nonlinear=is_nonlinear):
        found = fit_lines_further(lines, allowed, usual)
        parameters = len(allowed.parameters) + len(allowed.low)
        freedom = lines.freedom - parameters
        sentence = describe(found.specimen, found.further)
        if sentence and np.isfinite(found.chi_square):
            tried.append((assumption, sentence, found.chi_square, parameters, freedom))
    if not tried:
        return ()
    # Scale the scatter by the misfit of the best suspect, so that small differences are not significant.
    left = max(1.0, min(chi / freedom for _, _, chi, _, freedom in tried)) * lines.correlation[0]
    reals = 2 * lines.frequency_hz.size
    scores = [chi / left + count * np.log(reals) for _, _, chi, count, _ in tried]
    ranked = sorted(zip(scores, tried, strict=True), key=lambda each: each[0])
    return tuple(
        Suspect(
            assumption,
            sentence,
            chi / freedom,
            mends=chi / freedom <= lines.limit,
            behind=float(score - ranked[0][0]),
        )
        for score, (assumption, sentence, chi, _, freedom) in ranked
    )


_Told = Callable[[Specimen, Reals], str]
"""Function that returns a description of the fitted change, or an empty text for an impossible change."""


def _assumptions(lines: Lines, *, is_nonlinear: bool | None) -> Iterator[tuple[Assumption, Freedom, _Told]]:
    for each in MASSES:
        if each not in lines.free:
            yield Assumption(each.value[:2]), Freedom((each,)), _value_text(lines.nominal, each)
    for each in DAMPERS:
        if each in lines.free:
            continue
        link = each.value[:2]
        if is_nonlinear is not True:
            yield Assumption(link), Freedom((each,)), _value_text(lines.nominal, each)
        if is_nonlinear is not False:
            yield Assumption.FRICTION, Freedom((each,)), _friction_text(lines.nominal, each)
    if not lines.scale_sd:
        yield Assumption.SENSITIVITY, Freedom((), _response, ((0.0,),), (-1.0,), (1.0,)), _gain_text
    top_hz = float(lines.frequency_hz.max())
    starts = (float(np.log(1.3 * top_hz)), float(np.log(2.5 * top_hz)))
    low_hz = float(lines.frequency_hz.min())
    for mass in (0, 2):
        yield (
            Assumption.EXTRA_MODE,
            Freedom(
                (),
                partial(_on_mass, mass),
                tuple((each, *_MODE_START) for each in starts),
                (float(np.log(low_hz)), *np.log(_MODE_LOW)),
                (float(np.log(_HIGHEST_HZ)), *np.log(_MODE_HIGH)),
            ),
            _resonates(f"on m{mass}"),
        )
    yield (
        Assumption.EXTRA_MODE,
        Freedom(
            (),
            _under_foot,
            tuple((each, _MODE_START[1]) for each in starts),
            (float(np.log(low_hz)), np.log(_MODE_LOW[1])),
            (float(np.log(_HIGHEST_HZ)), np.log(_MODE_HIGH[1])),
        ),
        _resonates("between accelerometer and specimen"),
    )


def _value_text(nominal: Specimen, parameter: Parameter) -> _Told:
    name, factor, unit = SHOWN[parameter]
    was = parameter_value(nominal, parameter)

    def describe(specimen: Specimen, _: Reals) -> str:
        value = parameter_value(specimen, parameter)
        change = f"{100 * (value / was - 1):+.3g} %" if was else "none was described"
        return f"{name} of {factor * value:.4g} {unit} instead of {factor * was:.4g} ({change})"

    return describe


def _friction_text(nominal: Specimen, damper: Parameter) -> _Told:
    link, was = damper.value[1], parameter_value(nominal, damper)

    def describe(specimen: Specimen, _: Reals) -> str:
        more = parameter_value(specimen, damper) - was
        return f"friction in link {link}, which adds {more:.3g} N s/m at this level" if more > 0 else ""

    return describe


def _response(specimen: Specimen, frequency_hz: Reals, further: Reals) -> Complexes:
    return np.asarray(np.exp(further[0]) * own_response(specimen, frequency_hz, further))


def _gain_text(_: Specimen, further: Reals) -> str:
    return (
        f"a ratio of vibrometer and accelerometer sensitivity that is {100 * np.expm1(further[0]):+.3g} % "
        "off (a transmission does not show which of the two is wrong)"
    )


def _absorber(mass: float, frequency_hz: Reals, further: Reals) -> Complexes:
    """Return the dynamic stiffness added to a mass by a small mass on a damped spring."""
    own_hz, share, damping = np.exp(further)
    ratio = frequency_hz / own_hz
    spring = 1.0 + 2j * damping * ratio
    return np.asarray(-share * mass * (2 * np.pi * frequency_hz) ** 2 * spring / (spring - ratio**2))


def _on_mass(mass: int, specimen: Specimen, frequency_hz: Reals, further: Reals) -> Complexes:
    absorber = _absorber(specimen.masses[mass], frequency_hz, further)
    return loaded_response(specimen, frequency_hz, (absorber, 0.0) if mass == 0 else (0.0, absorber))


def _under_foot(specimen: Specimen, frequency_hz: Reals, further: Reals) -> Complexes:
    own_hz, damping = np.exp(further)
    ratio = frequency_hz / own_hz
    return np.asarray(own_response(specimen, frequency_hz, further) / (1 - ratio**2 + 2j * damping * ratio))


def _resonates(where: str) -> _Told:
    def describe(_: Specimen, further: Reals) -> str:
        return f"a further mode {where} near {np.exp(further[0]):.3g} Hz"

    return describe
