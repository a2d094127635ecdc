"""Fit damping and frequencies to a measured transmission; if the model does not fit, rank its assumptions."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import ClassVar

import numpy as np
from scipy.stats import t as student

from vibench.sim import Specimen

from ..errors import InvalidRequest
from ..frequency_response.results import FrequencyResponse
from ..signals import DEFAULT_CONFIDENCE, Complexes, Reals
from ..tables import Tabular
from .lines import (
    ALSO_FREE,
    DAMPERS,
    LINEAR,
    MASSES,
    SHOWN,
    FittedValue,
    Freedom,
    LineFit,
    Lines,
    Parameter,
    fit_lines,
    fit_lines_further,
    lines_of,
    loaded_response,
    own_response,
    parameter_value,
    with_values,
)

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
        Whether realisations scatter more than noise explains; None if unknown.
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
    # Increase the scatter by the misfit of the best suspect: small differences are then not significant.
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
    for model, first, where in (
        (partial(_on_mass, 0), 0, "on m0"),
        (partial(_on_mass, 2), 0, "on m2"),
        (_under_foot, 1, "between accelerometer and specimen"),  # its mass ratio is not a parameter
    ):
        allowed = Freedom(
            (),
            model,
            tuple((each, *_MODE_START[first:]) for each in starts),
            (float(np.log(low_hz)), *np.log(_MODE_LOW[first:])),
            (float(np.log(_HIGHEST_HZ)), *np.log(_MODE_HIGH[first:])),
        )
        yield Assumption.EXTRA_MODE, allowed, _resonates(where)


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


CLOCK_RELATIVE_SD = 25e-6
"""Relative standard deviation of a converter's clock; recordings do not reveal the clock's error."""


@dataclass(frozen=True, eq=False)
class SpecimenFit(Tabular):
    """A fitted specimen, or the reason why the model does not fit."""

    specimen: Specimen
    """Fitted specimen; the described specimen if the model does not fit."""
    values: tuple[FittedValue, ...]
    """Fitted values; empty if the model does not fit."""
    covariance: Reals
    """Covariance of the logarithms of the fitted parameters, shape (n, n), in the order of ``values``."""
    lines: int
    """Number of spectral lines that were fitted."""
    reduced_chi_square: float
    """Reduced chi square from estimated scatter, about 1 if the model explains the lines."""
    limit: float
    """Reduced chi square that one correct model in a thousand exceeds."""
    suspects: tuple[Suspect, ...]
    """Assumptions whose change would explain a misfit, the most likely first."""
    confidence: float
    phase_rad: tuple[float, float]
    """Channel phases at 100 Hz due to a high pass (proportional to 1 / f) and a delay (proportional to f)."""

    @property
    def fits(self) -> bool:
        """Whether the model fits the spectral lines."""
        return self.reduced_chi_square <= self.limit

    def random_specimen(self, rng: np.random.Generator) -> Specimen:
        """Return a random specimen within the fit's uncertainty."""
        logarithms = rng.multivariate_normal([np.log(each.value) for each in self.values], self.covariance)
        drawn = zip((each.parameter for each in self.values), np.exp(logarithms), strict=True)
        return with_values(self.specimen, {name: float(value) for name, value in drawn})

    def value(self, parameter: Parameter) -> FittedValue:
        """Return one fitted value; raises InvalidRequest if it was not fitted."""
        for each in self.values:
            if each.parameter is parameter:
                return each
        names = ", ".join(each.parameter for each in self.values) or "none"
        raise InvalidRequest(f"{parameter.value} was not fitted; fitted parameters: {names}")


def fit_specimen(
    frequency_response: FrequencyResponse,
    nominal: Specimen,
    free: Sequence[Parameter] = LINEAR,
    confidence: float = DEFAULT_CONFIDENCE,
    *,
    scale_sd: float = 0.0,
    is_nonlinear: bool | None = None,
) -> SpecimenFit:
    """Fit linear parameters to magnitude and phase, weighted by the scatter of the lines.

    The scatter is estimated from few averages, so Student's likelihood is used. A fit is refused if its chi
    square exceeds the value that a correct model exceeds in one of a thousand cases. A refused fit has no
    values but a ranking of assumptions that may be wrong.

    Raises InvalidRequest when no parameter is free, or for parameters that no linear transmission determines
    (gap, more than one mass), and NotEnoughData for too few significant lines.

    Parameters
    ----------
    frequency_response
        Ratio of displacements, with delays removed.
    nominal
        Start of the search, and values of all parameters that are not free.
    free
        Parameters to fit.
    confidence
        Confidence of the intervals.
    scale_sd
        Relative standard deviation of the sensitivity ratio vibrometer / accelerometer; 0 if exact.
    is_nonlinear
        Whether realisations scatter more than noise does, which suggests friction; None if unknown.
    """
    free = tuple(free)
    allowed = (*LINEAR, *ALSO_FREE)
    if not free or not set(free) <= set(allowed) or len(set(free) & set(MASSES)) > 1:
        raise InvalidRequest(
            f"a fit of {', '.join(free) or 'no parameter'} was requested; a transmission can determine "
            f"{', '.join(allowed)}, but at most one mass"
        )
    lines = lines_of(frequency_response, nominal, free, scale_sd)
    found = fit_lines(lines)
    clear = lines_of(frequency_response, nominal, free, scale_sd, found.specimen)
    if not np.array_equal(clear.frequency_hz, lines.frequency_hz):
        lines, found = clear, fit_lines(clear)
    chi_square = found.chi_square / lines.freedom
    fits = chi_square <= lines.limit
    covariance = found.covariance * max(1.0, chi_square) + _of_the_clock(free)
    reach = np.asarray(student.ppf(0.5 + 0.5 * confidence, np.minimum(found.freedoms, lines.freedom)))
    return SpecimenFit(
        specimen=found.specimen if fits else nominal,
        values=_values(lines, found.logarithms, covariance, reach) if fits else (),
        covariance=covariance,
        lines=lines.frequency_hz.size,
        reduced_chi_square=chi_square,
        limit=lines.limit,
        suspects=() if fits else suspects(lines, found, is_nonlinear=is_nonlinear),
        confidence=confidence,
        phase_rad=found.phases,
    )


def not_linear(nominal: Specimen, sentence: str) -> SpecimenFit:
    """Return a refused fit for a recording that no linear model explains; ``sentence`` states the reason."""
    suspect = Suspect(Assumption.LINEARITY, sentence, np.nan, mends=False, behind=0.0)
    nan = float("nan")
    return SpecimenFit(nominal, (), np.zeros((0, 0)), 0, nan, nan, (suspect,), nan, (nan, nan))


def _of_the_clock(free: tuple[Parameter, ...]) -> Reals:
    """Return the covariance due to the clock error, which scales frequencies and, inversely, times."""
    frequencies = (*LINEAR[1:], *DAMPERS)
    direction = np.array([float(each in frequencies) - (each is Parameter.DAMPING_TIME) for each in free])
    return CLOCK_RELATIVE_SD**2 * np.outer(direction, direction)


def _values(lines: Lines, found: Reals, covariance: Reals, reach: Reals) -> tuple[FittedValue, ...]:
    spreads = np.sqrt(np.diag(covariance))
    return tuple(
        FittedValue(
            parameter=name,
            value=float(np.exp(middle)),
            low=float(np.exp(middle - far * sd)),
            high=float(np.exp(middle + far * sd)),
            sd=float(np.exp(middle) * sd),
            nominal=parameter_value(lines.nominal, name),
        )
        for name, middle, sd, far in zip(lines.free, found, spreads, reach, strict=True)
    )
