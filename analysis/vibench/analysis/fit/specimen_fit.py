"""Damping and frequencies of the specimen, fitted to a measured transmission."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from vibench.sim import Specimen

from ..errors import InvalidRequest
from ..frequency_response.results import FrequencyResponse
from ..signals.arrays import Reals
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..tables import Tabular
from .lines import Lines, fit_lines, lines_of
from .parameters import (
    ALSO_FREE,
    DAMPERS,
    LINEAR,
    MASSES,
    FittedValue,
    Parameter,
    parameter_value,
    with_values,
)
from .suspects import Assumption, Suspect, suspects

CLOCK_RELATIVE_SD = 25e-6
"""Relative standard deviation of a converter's clock; recordings do not reveal the clock's error."""


@dataclass(frozen=True, eq=False)
class SpecimenFit(Tabular):
    """A fitted specimen, or the reason why the model does not fit."""

    specimen: Specimen
    """Fitted specimen; the described one if the model does not fit."""
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
        """Whether the model explains the spectral lines."""
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
        Whether realisations scatter beyond noise, which suggests friction; None if unknown.
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
