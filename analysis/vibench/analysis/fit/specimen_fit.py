"""The specimen that is really on the shaker: damping and frequencies fitted to a measured transmission."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from vibench.sim import Specimen

from ..errors import InvalidRequest
from ..frequency_response.results import FrequencyResponse
from ..signals.arrays import Reals
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..tables import Labelled
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
from .suspects import Suspect, suspects

CLOCK_RELATIVE_SD = 25e-6
"""Converters promise 50 parts in a million or better, which no recording of its own can tell."""


@dataclass(frozen=True, eq=False)
class SpecimenFit(Labelled):
    """A fitted specimen, or why the model fits none."""

    specimen: Specimen
    """Fitted specimen; the described one where the model does not fit."""
    values: tuple[FittedValue, ...]
    """Empty where it does not."""
    covariance: Reals
    """Of the logarithms of the fitted linear parameters, shape (n, n), in the order of ``values``."""
    lines: int
    """Lines of the transmission that were used."""
    reduced_chi_square: float
    """Per degree of freedom: 1 for a model that leaves nothing but the lines' own scatter, whose estimate's
    own uncertainty is in it."""
    limit: float
    """What one right model in a thousand exceeds."""
    suspects: tuple[Suspect, ...]
    """Where the model does not fit: which assumption would mend it, the likeliest first."""
    confidence: float
    phase_rad: tuple[float, float]
    """What the channels add to the phase at 100 Hz: a high pass (falling as 1 / f), and a delay (as f)."""

    @property
    def fits(self) -> bool:
        """Whether the model explains the lines."""
        return self.reduced_chi_square <= self.limit

    def drawn(self, rng: np.random.Generator) -> Specimen:
        """Return a specimen of the fit's uncertainty."""
        logarithms = rng.multivariate_normal([np.log(each.value) for each in self.values], self.covariance)
        drawn = zip((each.parameter for each in self.values), np.exp(logarithms), strict=True)
        return with_values(self.specimen, {name: float(value) for name, value in drawn})

    def value(self, parameter: Parameter) -> FittedValue:
        """Return one fitted value; InvalidRequest when it was not fitted."""
        for each in self.values:
            if each.parameter is parameter:
                return each
        names = ", ".join(each.parameter for each in self.values) or "none"
        raise InvalidRequest(f"{parameter.value} was not fitted; there are {names}")


def fit_specimen(
    frequency_response: FrequencyResponse,
    nominal: Specimen,
    free: Sequence[Parameter] = LINEAR,
    confidence: float = DEFAULT_CONFIDENCE,
    *,
    scale_sd: float = 0.0,
    is_nonlinear: bool | None = None,
) -> SpecimenFit:
    """Fit linear parameters to magnitude and phase, line by line weighted by their scatter.

    The lines' scatter was estimated from few averages, so that each weighs by Student's likelihood. A fit
    whose chi square a right model exceeds once in a thousand times is refused: it has no values, and the
    assumptions that could be wrong, ranked.

    Raises InvalidRequest when nothing is free, or what no linear transmission tells: the gap, or more than
    one mass, and NotEnoughData when fewer significant lines than twice what is fitted are left.

    Parameters
    ----------
    transmission
        Displacement over displacement, delays removed.
    nominal
        Where the search begins, and what stays of the parameters that are not free; contact and gap too.
    free
        What is fitted.
    confidence
        Of the intervals.
    scale_sd
        Relative standard deviation of the sensors' sensitivities, vibrometer over accelerometer, as their
        calibrations state it; taken as exact when 0.
    is_nonlinear
        Whether realisations scatter more than noise does: friction and not damping; None when not known.
    """
    free = tuple(free)
    allowed = (*LINEAR, *ALSO_FREE)
    if not free or not set(free) <= set(allowed) or len(set(free) & set(MASSES)) > 1:
        raise InvalidRequest(
            f"{', '.join(free) or 'nothing'} was to be fitted to a transmission; it tells any of "
            f"{', '.join(allowed)}, one mass at a time"
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


def _of_the_clock(free: tuple[Parameter, ...]) -> Reals:
    """Covariance that a wrong clock makes: it scales all frequencies, and times inversely."""
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
