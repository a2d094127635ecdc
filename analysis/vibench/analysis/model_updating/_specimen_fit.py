"""The specimen that is really on the shaker: damping and frequencies fitted to a measured transmission.

What of a specimen can be fitted, by name: read from a specimen, and given to another.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import assert_never

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import t as student

from vibench.sim import Specimen, base_transmissibility

from ..errors import InvalidRequest, NotEnoughData
from ..frequency_response import FrequencyResponse
from ..signals import DEFAULT_CONFIDENCE, Complexes, Reals


class Parameter(StrEnum):
    """What of a specimen is fitted."""

    DAMPING_TIME = "damping_time_s"
    """c_i / k_i, one for all links."""
    F0 = "f0_hz"
    F1 = "f1_hz"
    F2 = "f2_hz"
    """Frequencies of the single oscillators, f_i = sqrt(k_i / m_i) / 2 pi."""
    GAP = "gap_m"


LINEAR = (Parameter.DAMPING_TIME, Parameter.F0, Parameter.F1, Parameter.F2)
"""What a transmission without collisions tells."""


def parameter_value(specimen: Specimen, parameter: Parameter) -> float:
    """Read one parameter of a specimen; the damping time of a specimen with several is that of link 0."""
    masses, stiffnesses = specimen.masses, specimen.stiffnesses
    match parameter:
        case Parameter.DAMPING_TIME:
            return specimen.dampings[0] / stiffnesses[0]
        case Parameter.F0 | Parameter.F1 | Parameter.F2:
            link = LINEAR.index(parameter) - 1
            return float(np.sqrt(stiffnesses[link] / masses[link]) / (2.0 * np.pi))
        case Parameter.GAP:
            return min(specimen.gaps_m)
        case _:
            assert_never(parameter)


def with_values(specimen: Specimen, values: Mapping[Parameter, float]) -> Specimen:
    """Give a specimen other parameters; the masses stay, and dampings follow their stiffnesses.

    Dampings keep their proportions to the stiffnesses, and two gaps theirs to each other.
    """
    old = parameter_value(specimen, Parameter.DAMPING_TIME)
    beta = values.get(Parameter.DAMPING_TIME, old)
    shares = [
        c / k / old if old else 1.0 for c, k in zip(specimen.dampings, specimen.stiffnesses, strict=True)
    ]
    stiffnesses = tuple(
        mass * (2.0 * np.pi * values.get(name, parameter_value(specimen, name))) ** 2
        for mass, name in zip(specimen.masses, LINEAR[1:], strict=True)
    )
    k0, k1, k2 = (float(each) for each in stiffnesses)
    c0, c1, c2 = (share * beta * k for share, k in zip(shares, (k0, k1, k2), strict=True))
    nearest = min(specimen.gaps_m)
    wider = values.get(Parameter.GAP, nearest) / nearest
    lower, upper = specimen.gaps_m
    return replace(
        specimen,
        stiffnesses=(k0, k1, k2),
        dampings=(c0, c1, c2),
        gap_m=wider * upper,
        lower_gap_m=None if specimen.lower_gap_m is None else wider * lower,
    )


LEAST_RELATIVE_SD = 1e-4
"""No line counts for more than this scatter says: calibrations and clocks are no better."""
CLOCK_RELATIVE_SD = 25e-6
"""Converters promise 50 parts in a million or better, which no recording of its own can tell."""
CHANNEL_PHASES = 2
PHASE_AT_HZ = 100.0
"""Where the phases of the channels are named."""
POOR = 3.0
"""A reduced chi square above which other beginnings are tried."""
SCALES = (0.9, 0.95, 1.05, 1.1)
"""Of all frequencies."""
_STEP = 1e-6
"""Of a logarithm, for a central difference: far above rounding, and far less than a resonance is wide."""


@dataclass(frozen=True)
class FittedValue:
    """A parameter with its interval."""

    parameter: Parameter
    value: float
    low: float
    high: float
    """Both with the confidence of the fit."""
    sd: float
    """Standard deviation; NaN where the interval is one of bounds."""
    nominal: float
    """What the bench configuration says."""


@dataclass(frozen=True, eq=False)
class SpecimenFit:
    """A fitted specimen, and how well it fits."""

    specimen: Specimen
    values: tuple[FittedValue, ...]
    covariance: Reals
    """Of the logarithms of the fitted linear parameters, shape (n, n), in the order of ``values``."""
    lines: int
    """Lines of the transmission that were used."""
    reduced_chi_square: float
    """Squared residual over what the measured scatter explains: 1 for a model that leaves nothing."""
    confidence: float
    phase_rad: tuple[float, float]
    """What the channels add to the phase at 100 Hz: a high pass (falling as 1 / f), and a delay (as f)."""

    def value(self, parameter: Parameter) -> FittedValue:
        """Give one fitted value; InvalidRequest when it was not fitted."""
        for each in self.values:
            if each.parameter is parameter:
                return each
        names = ", ".join(each.parameter for each in self.values)
        raise InvalidRequest(f"{parameter.value} was not fitted; there are {names}")


def fit_specimen(
    frequency_response: FrequencyResponse,
    nominal: Specimen,
    free: Sequence[Parameter] = LINEAR,
    confidence: float = DEFAULT_CONFIDENCE,
) -> SpecimenFit:
    """Fit the linear specimen to a transmission of base to m0 that was measured without collisions.

    Least squares of ln(measured / model), magnitude and phase, each over its measured standard deviation,
    in the logarithms of the parameters. The phase may also differ by a high pass of one channel and a delay
    (a / f and b f), which a calibration of magnitudes does not see; they are fitted beside.
    The covariance is Gauss-Newton's, made larger by the reduced chi square where the model leaves more than
    the scatter explains, and by what the converter's clock may be wrong by.

    Raises InvalidRequest when nothing is free, or the gap is, which no linear transmission tells, and
    NotEnoughData when fewer significant lines than twice what is fitted are left.

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

    """
    free = tuple(free)
    if not free or Parameter.GAP in free:
        raise InvalidRequest(
            f"{', '.join(free) or 'nothing'} was to be fitted to a transmission; it tells any of "
            f"{', '.join(LINEAR)}"
        )
    lines = _lines(frequency_response, nominal, free)
    freedom = 2 * lines.frequency_hz.size - lines.start.size
    found = _descended(lines.residuals, lines.start)
    if 2.0 * found.cost > POOR * freedom:
        # A phase may lie on another branch: begin again from specimens that are stiffer or softer.
        others = [_descended(lines.residuals, lines.start + lines.scaled_by(scale)) for scale in SCALES]
        found = min([found, *others], key=lambda each: each.cost)
    chi_square = float(2.0 * found.cost / freedom)
    slopes = np.asarray(found.jac, dtype=np.float64)
    whole = np.asarray(np.linalg.inv(slopes.T @ slopes) * max(1.0, chi_square))
    logarithms = found.x[: len(free)]
    covariance = whole[: len(free), : len(free)] + _of_the_clock(free)
    reach = float(student.ppf(0.5 + 0.5 * confidence, freedom))
    return SpecimenFit(
        specimen=lines.specimen(logarithms),
        values=_values(free, nominal, logarithms, covariance, reach),
        covariance=covariance,
        lines=lines.frequency_hz.size,
        reduced_chi_square=chi_square,
        confidence=confidence,
        phase_rad=(float(found.x[-2]), float(found.x[-1])),
    )


@dataclass(frozen=True, eq=False)
class _Lines:
    """The lines that are fitted, and what they are fitted by: logarithms of parameters, then two phases."""

    frequency_hz: Reals
    measured: Complexes
    weights: Reals
    """Of the magnitudes, then of the phases."""
    nominal: Specimen
    free: tuple[Parameter, ...]

    @property
    def start(self) -> Reals:
        """Where the search begins."""
        named = np.log([parameter_value(self.nominal, each) for each in self.free])
        return np.concatenate([named, np.zeros(CHANNEL_PHASES)])

    def scaled_by(self, scale: float) -> Reals:
        """Give the step that scales all frequencies."""
        steps = [np.log(scale) if each in LINEAR[1:] else 0.0 for each in self.free]
        return np.array([*steps, *np.zeros(CHANNEL_PHASES)])

    def specimen(self, logarithms: Reals) -> Specimen:
        """Give the specimen of these parameters."""
        return with_values(self.nominal, dict(zip(self.free, np.exp(logarithms).tolist(), strict=True)))

    def residuals(self, at: Reals) -> Reals:
        """Measured less model in standard deviations, magnitudes and then phases."""
        model = base_transmissibility(self.specimen(at[: len(self.free)]), self.frequency_hz)[:, 0]
        apart = np.log(self.measured / model)
        high_pass, delay = at[len(self.free) :]
        channels = high_pass * PHASE_AT_HZ / self.frequency_hz + delay * self.frequency_hz / PHASE_AT_HZ
        return np.asarray(self.weights * np.concatenate([apart.real, apart.imag - channels]))


def _lines(frequency_response: FrequencyResponse, nominal: Specimen, free: tuple[Parameter, ...]) -> _Lines:
    """Take the lines that stand above their uncertainty; NotEnoughData where they are too few."""
    used = frequency_response.is_significant & np.isfinite(frequency_response.relative_sd_magnitude)
    count, needed = int(np.count_nonzero(used)), 2 * (len(free) + CHANNEL_PHASES)
    if count < needed:
        raise NotEnoughData(
            f"{count} lines of the transmission stand above their uncertainty, and {len(free)} parameters "
            f"need {needed}; measure longer or with more drive"
        )
    spreads = np.concatenate(
        [frequency_response.relative_sd_magnitude[used], frequency_response.sd_phase_rad[used]]
    )
    return _Lines(
        frequency_hz=frequency_response.frequency_hz[used],
        measured=frequency_response.value[used],
        weights=1.0 / np.maximum(spreads, LEAST_RELATIVE_SD),
        nominal=nominal,
        free=free,
    )


def _of_the_clock(free: tuple[Parameter, ...]) -> Reals:
    """Covariance that a wrong clock makes: it scales all frequencies, and times inversely."""
    direction = np.array([-1.0 if each is Parameter.DAMPING_TIME else 1.0 for each in free])
    return CLOCK_RELATIVE_SD**2 * np.outer(direction, direction)


def _descended(residuals: Callable[[Reals], Reals], start: Reals) -> OptimizeResult:
    return least_squares(residuals, start, jac="3-point", diff_step=[_STEP], x_scale="jac")


def _values(
    free: tuple[Parameter, ...], nominal: Specimen, found: Reals, covariance: Reals, reach: float
) -> tuple[FittedValue, ...]:
    spreads = np.sqrt(np.diag(covariance))
    return tuple(
        FittedValue(
            parameter=name,
            value=float(np.exp(middle)),
            low=float(np.exp(middle - reach * sd)),
            high=float(np.exp(middle + reach * sd)),
            sd=float(np.exp(middle) * sd),
            nominal=parameter_value(nominal, name),
        )
        for name, middle, sd in zip(free, found, spreads, strict=True)
    )
