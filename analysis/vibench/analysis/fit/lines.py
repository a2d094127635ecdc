"""Parameters of a specimen, and their fit to the spectral lines of a measured transmission."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import ClassVar, assert_never

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import OptimizeResult, least_squares

from vibench.sim import Specimen

from ..errors import NotEnoughData
from ..frequency_response.results import FrequencyResponse
from ..signals import Complexes, Reals, chi_square_limit, chi_square_of, line_correlation
from ..tables import unit_of


class Parameter(StrEnum):
    """Parameter of a specimen."""

    DAMPING_TIME = "damping_time_s"
    """Damping time c_i / k_i, common to all links."""
    F0 = "f0_hz"
    F1 = "f1_hz"
    F2 = "f2_hz"
    """Frequencies of the single oscillators, f_i = sqrt(k_i / m_i) / 2 pi."""
    M0 = "m0_kg"
    M1 = "m1_kg"
    M2 = "m2_kg"
    """Masses; only one mass can be fitted at a time, because motion determines only ratios of masses."""
    C0 = "c0_ns_per_m"
    C1 = "c1_ns_per_m"
    C2 = "c2_ns_per_m"
    """Individual dampers, independent of the common damping time."""
    GAP = "gap_m"


LINEAR = (Parameter.DAMPING_TIME, Parameter.F0, Parameter.F1, Parameter.F2)
"""Parameters fitted by default to a transmission without collisions."""
MASSES = (Parameter.M0, Parameter.M1, Parameter.M2)
DAMPERS = (Parameter.C0, Parameter.C1, Parameter.C2)
ALSO_FREE = MASSES + DAMPERS
"""Parameters that may be fitted in addition."""
SHOWN = {
    Parameter.DAMPING_TIME: ("c / k", 1e6, "µs"),
    Parameter.F0: ("f0", 1.0, "Hz"),
    Parameter.F1: ("f1", 1.0, "Hz"),
    Parameter.F2: ("f2", 1.0, "Hz"),
    Parameter.M0: ("m0", 1e3, "g"),
    Parameter.M1: ("m1", 1e3, "g"),
    Parameter.M2: ("m2", 1e3, "g"),
    Parameter.C0: ("c0", 1.0, "N s/m"),
    Parameter.C1: ("c1", 1.0, "N s/m"),
    Parameter.C2: ("c2", 1.0, "N s/m"),
    Parameter.GAP: ("gap of the nearer side", 1e6, "µm"),
}
"""Name, factor from SI units, and unit of each parameter in texts."""


@dataclass(frozen=True)
class FittedValue:
    """A fitted parameter with its interval."""

    OWN_UNITS: ClassVar = dict.fromkeys(("value", "low", "high", "sd", "nominal"), "{0.unit}")
    DOCUMENT: ClassVar = "value low high sd bench=nominal"

    parameter: Parameter
    value: float
    low: float
    high: float
    """Bounds at the confidence level of the fit."""
    sd: float
    """Standard deviation; NaN if only bounds are known."""
    nominal: float
    """Value of the parameter in the bench configuration."""

    @property
    def unit(self) -> str:
        """Unit of the values, SI."""
        return unit_of(self.parameter)


def parameter_value(specimen: Specimen, parameter: Parameter) -> float:
    """Return the value of a parameter; for the damping time, the value of link 0 (other links may differ)."""
    masses, stiffnesses = specimen.masses, specimen.stiffnesses
    match parameter:
        case Parameter.DAMPING_TIME:
            return specimen.dampings[0] / stiffnesses[0]
        case Parameter.F0 | Parameter.F1 | Parameter.F2:
            link = LINEAR.index(parameter) - 1
            return float(np.sqrt(stiffnesses[link] / masses[link]) / (2.0 * np.pi))
        case Parameter.M0 | Parameter.M1 | Parameter.M2:
            return masses[MASSES.index(parameter)]
        case Parameter.C0 | Parameter.C1 | Parameter.C2:
            return specimen.dampings[DAMPERS.index(parameter)]
        case Parameter.GAP:
            return min(specimen.gaps_m)
        case _:
            assert_never(parameter)


def with_values(specimen: Specimen, values: Mapping[Parameter, float]) -> Specimen:
    """Return a specimen with changed parameters; a changed mass leaves the frequencies unchanged.

    Dampers that are not given stay proportional to stiffness, and the ratio of the two gaps is kept.
    """
    old = parameter_value(specimen, Parameter.DAMPING_TIME)
    beta = values.get(Parameter.DAMPING_TIME, old)
    shares = [
        c / k / old if old else 1.0 for c, k in zip(specimen.dampings, specimen.stiffnesses, strict=True)
    ]
    m0, m1, m2 = masses = tuple(values.get(each, parameter_value(specimen, each)) for each in MASSES)
    k0, k1, k2 = stiffnesses = [
        mass * (2.0 * np.pi * values.get(name, parameter_value(specimen, name))) ** 2
        for mass, name in zip(masses, LINEAR[1:], strict=True)
    ]
    c0, c1, c2 = (
        values.get(each, share * beta * k)
        for each, share, k in zip(DAMPERS, shares, stiffnesses, strict=True)
    )
    nearest = min(specimen.gaps_m)
    wider = values.get(Parameter.GAP, nearest) / nearest
    lower, upper = specimen.gaps_m
    return replace(
        specimen,
        masses=(m0, m1, m2),
        stiffnesses=(k0, k1, k2),
        dampings=(c0, c1, c2),
        gap_m=wider * upper,
        lower_gap_m=None if specimen.lower_gap_m is None else wider * lower,
    )


LEAST_RELATIVE_SD = 1e-4
"""Smallest relative scatter assumed for a spectral line; calibrations and clocks are no more accurate."""
_LEAST_CLEAR = 10.0
"""Smallest ratio of a line's magnitude to the median scatter nearby, so that ln(magnitude) is normal.

The line's own scatter is estimated from few averages. If it were used, lines whose scatter is small by chance
would be selected, and a correct model refused.
"""
_NEIGHBOURS = 31
"""Number of neighbouring spectral lines over which the median scatter is taken."""
_MOST_OFF = np.log(1e4)
"""Largest |ln| of the ratio of a parameter to its value at the start of the search."""
LEAST_DAMPING_TIME_S = 1e-8
"""Start value of the damping time for a specimen described without damping [s]."""
CHANNEL_PHASES = 2
PHASE_AT_HZ = 100.0
"""Frequency at which the channels' phases are stated [Hz]."""
SCALES = (0.9, 0.95, 1.05, 1.1)
"""Factors on all natural frequencies for further starting points of the search."""
_STEP = 1e-6
"""Logarithmic step of central differences, far above rounding and far below the width of a resonance."""

_HOPELESS = 5.0
"""Multiple of the chi square limit above which no weighting of lines can make a fit valid."""
_MOST_STEPS = 60
"""Maximum number of evaluations of a fit; a fit of a further mode has no optimum if no such mode exists."""

Model = Callable[[Specimen, Reals, Reals], Complexes]
"""Function of specimen, frequencies [Hz] and further parameters that returns m0 / base."""


def loaded_response(
    specimen: Specimen, frequency_hz: Reals, extra_n_per_m: tuple[Complexes | float, ...]
) -> Complexes:
    """Return the response of m0 relative to the base for a specimen with additional loads, shape (lines,).

    m2 is linked to m0, and m1 to m2. A link of dynamic stiffness P in series with the dynamic stiffness A
    behind it gives P A / (P + A). ``extra_n_per_m`` are additional dynamic stiffnesses at m0 and at m2.
    """
    s = 2j * np.pi * frequency_hz
    (m0, m1, m2), springs, dampers = specimen.masses, specimen.stiffnesses, specimen.dampings
    p0, p1, p2 = (k + c * s for k, c in zip(springs, dampers, strict=True))
    at_m0, at_m2 = extra_n_per_m
    behind = m2 * s**2 + at_m2 + p1 * m1 * s**2 / (p1 + m1 * s**2)
    return np.asarray(p0 / (p0 + m0 * s**2 + at_m0 + p2 * behind / (p2 + behind)))


def own_response(specimen: Specimen, frequency_hz: Reals, _: Reals) -> Complexes:
    """Return m0's response relative to the base for the three masses without additional loads."""
    return loaded_response(specimen, frequency_hz, (0.0, 0.0))


@dataclass(frozen=True)
class Freedom:
    """Additional parameters that a fit determines."""

    parameters: tuple[Parameter, ...] = ()
    model: Model = own_response
    starts: tuple[tuple[float, ...], ...] = ((),)
    """Start values of the additional parameters of the model."""
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class LineFit:
    """Result of a fit to spectral lines."""

    specimen: Specimen
    logarithms: Reals
    """Logarithms of the free parameters."""
    covariance: Reals
    """Covariance of the parameters' logarithms, for a correct model."""
    freedoms: Reals
    """Degrees of freedom of each parameter's uncertainty; small if only a few lines determine it."""
    phases: tuple[float, float]
    further: Reals
    chi_square: float


@dataclass(frozen=True, eq=False)
class Lines:
    """Spectral lines and options of a fit of parameters (as logarithms), channel phases and a scale."""

    frequency_hz: Reals
    measured: Complexes
    weights: Reals
    """Weights of the magnitudes of all lines, then of their phases."""
    averages: float
    """Number of independent averages from which the scatter of each spectral line is estimated."""
    correlation: tuple[float, float]
    """Number of spectral lines per independent line, for parameters and for chi square."""
    nominal: Specimen
    free: tuple[Parameter, ...]
    scale_sd: float
    """Stated standard deviation of ln(response sensitivity over base sensitivity); 0 if exact."""

    @property
    def start(self) -> Reals:
        """Start values of the search: logarithms of the free parameters, then zeros."""
        named = [max(parameter_value(self.nominal, each), LEAST_DAMPING_TIME_S) for each in self.free]
        return np.concatenate([np.log(named), np.zeros(CHANNEL_PHASES + (self.scale_sd > 0.0))])

    @property
    def freedom(self) -> int:
        """Number of degrees of freedom of the fit."""
        return 2 * self.frequency_hz.size - len(self.free) - CHANNEL_PHASES

    @property
    def limit(self) -> float:
        """Reduced chi square that one correct model in a thousand exceeds."""
        return chi_square_limit(self.freedom, self.correlation[1])

    def specimen(self, logarithms: Reals) -> Specimen:
        """Return the specimen with the given parameters, each limited to `_MOST_OFF` from its start value."""
        begun = self.start[: len(self.free)]
        values = np.exp(np.clip(logarithms, begun - _MOST_OFF, begun + _MOST_OFF)).tolist()
        return with_values(self.nominal, dict(zip(self.free, values, strict=True)))

    def is_away(self, at: Reals) -> bool:
        """Return whether a search diverged along an undetermined parameter."""
        count = len(self.free)
        return bool(np.any(np.abs(at[:count] - self.start[:count]) > _MOST_OFF))

    def residuals(self, at: Reals, model: Model) -> Reals:
        """Return measured minus modelled values [standard deviations]: magnitudes, phases and a scale."""
        count = len(self.free)
        high_pass, delay = at[count : count + CHANNEL_PHASES]
        rest = at[count + CHANNEL_PHASES :]
        scale, further = (rest[:1], rest[1:]) if self.scale_sd > 0.0 else (np.zeros(0), rest)
        modelled = model(self.specimen(at[:count]), self.frequency_hz, further)
        apart = np.log(self.measured / modelled) - np.sum(scale)
        channels = high_pass * PHASE_AT_HZ / self.frequency_hz + delay * self.frequency_hz / PHASE_AT_HZ
        return np.concatenate(
            [
                self.weights * np.concatenate([apart.real, apart.imag - channels]),
                scale / (self.scale_sd or 1.0),
            ]
        )

    def misfit(self, residuals: Reals) -> Reals:
        """Return the sum of squared residuals of magnitude and phase for each line."""
        magnitudes, phases = np.split(residuals[: 2 * self.frequency_hz.size], 2)
        return np.asarray(magnitudes**2 + phases**2)

    def students(self, residuals: Reals) -> Reals:
        """Return residuals whose squares follow chi square even though the scatter is estimated."""
        count, squared = 2 * self.frequency_hz.size, self.misfit(residuals)
        factor = np.sqrt(chi_square_of(squared, self.averages) / np.maximum(squared, 1e-300))
        return np.concatenate([residuals[:count] * np.tile(factor, 2), residuals[count:]])


def lines_of(
    frequency_response: FrequencyResponse,
    nominal: Specimen,
    free: tuple[Parameter, ...],
    scale_sd: float,
    fitted: Specimen | None = None,
) -> Lines:
    """Select the spectral lines well above their scatter; raises NotEnoughData if too few are left.

    The magnitudes of a fitted specimen, if given, replace the noisy measured ones in this selection.
    """
    measured = np.abs(frequency_response.value)
    frequency_hz = frequency_response.frequency_hz
    size = measured if fitted is None else np.abs(own_response(fitted, frequency_hz, np.zeros(0)))
    scatter = frequency_response.relative_sd_magnitude * measured
    usual = median_filter(np.where(np.isfinite(scatter), scatter, np.inf), _NEIGHBOURS, mode="nearest")
    used = frequency_response.is_significant & np.isfinite(scatter) & (size > _LEAST_CLEAR * usual)
    count, needed = int(np.count_nonzero(used)), 2 * (len(free) + CHANNEL_PHASES)
    if count < needed:
        raise NotEnoughData(
            f"only {count} lines of the transmission are at least {_LEAST_CLEAR:.2g} times as large as the "
            f"scatter, but {len(free)} parameters need {needed}; measure longer, or with a stronger drive"
        )
    spreads = np.concatenate(
        [frequency_response.relative_sd_magnitude[used], frequency_response.sd_phase_rad[used]]
    )
    return Lines(
        frequency_hz=frequency_hz[used],
        measured=frequency_response.value[used],
        weights=1.0 / np.maximum(spreads, LEAST_RELATIVE_SD),
        averages=frequency_response.n_eff,
        correlation=line_correlation(frequency_response.settings.window),
        nominal=nominal,
        free=free,
        scale_sd=scale_sd,
    )


def fit_lines(lines: Lines) -> LineFit:
    """Start the fit from the described specimen; if that fails, also from stiffer and softer specimens."""
    usual = Freedom()
    best = _fit_from(lines, usual, lines.start)
    if 2.0 * best.cost > lines.limit * lines.freedom:
        # The fit may be off by a whole turn of phase, so start again from stiffer and softer specimens.
        stiffer = np.zeros(lines.start.size)
        stiffer[: len(lines.free)] = [each in LINEAR[1:] for each in lines.free]
        others = [_fit_from(lines, usual, lines.start + np.log(scale) * stiffer) for scale in SCALES]
        best = min([best, *others], key=lambda each: each.cost)
    if np.isinf(best.cost):
        raise NotEnoughData(
            f"the {lines.frequency_hz.size} lines of the transmission above the scatter do not determine "
            f"{', '.join(lines.free)}; measure longer, or with a stronger drive"
        )
    return _fit_from_description(lines, usual, best)


def fit_lines_further(lines: Lines, allowed: Freedom, usual: LineFit) -> LineFit:
    """Fit a model with additional parameters, starting from the previous result and from the description."""
    opened = replace(lines, free=(*lines.free, *allowed.parameters))
    begun = [np.concatenate([usual.logarithms, opened.start[len(lines.free) :]]), opened.start]
    ways = [(start, further) for start in begun for further in allowed.starts]
    found = [_fit_from(opened, allowed, np.concatenate([start, further])) for start, further in ways]
    return _fit_from_description(opened, allowed, min(found, key=lambda each: each.cost))


def _fit_from(lines: Lines, allowed: Freedom, start: Reals) -> OptimizeResult:
    """Fit by least squares, which converges from a distant start, and then by likelihood."""
    open_ended = np.full(start.size - len(allowed.low), np.inf)
    bounds = (np.concatenate([-open_ended, allowed.low]), np.concatenate([open_ended, allowed.high]))

    def plain(at: Reals) -> Reals:
        return lines.residuals(at, allowed.model)

    def likely(at: Reals) -> Reals:
        return lines.students(plain(at))

    near = _descent(plain, start, bounds)
    if not lines.is_away(near.x):
        left = likely(near.x)
        near.update(cost=0.5 * float(left @ left))
        if left @ left <= _HOPELESS * lines.limit * lines.freedom:
            near = _descent(likely, near.x, bounds)
    if lines.is_away(near.x):
        near.update(cost=np.inf)
    return near


def _descent(
    residuals: Callable[[Reals], Reals], start: Reals, bounds: tuple[Reals, Reals]
) -> OptimizeResult:
    return least_squares(
        residuals,
        start,
        diff_step=[_STEP],
        x_scale="jac",
        bounds=bounds,
        ftol=1e-9,
        xtol=1e-10,
        max_nfev=_MOST_STEPS,
    )


def _fit_from_description(lines: Lines, allowed: Freedom, found: OptimizeResult) -> LineFit:
    count = len(lines.free)
    phases = found.x[count : count + CHANNEL_PHASES]
    spread = 2.0 * max(lines.averages - 1.0, 0.5)
    # The scatter is estimated, so the likelihood is Student's t. The variance of the likelihood's slope is
    # (spread + 2) / spread times the curvature (Huber 1967; 1.25 times for 8 degrees of freedom).
    squared = lines.misfit(lines.residuals(found.x, allowed.model))
    around = ((found.x + step, found.x - step) for step in _STEP * np.eye(found.x.size))
    pairs = [[lines.residuals(at, allowed.model) for at in both] for both in around]
    slopes = np.stack([(above - below) / (2 * _STEP) for above, below in pairs], axis=1)
    slopes[: 2 * squared.size] *= np.tile(np.sqrt(spread * (spread + 2)) / (spread + squared), 2)[:, None]
    wider = lines.correlation[0] * (spread + 2) / spread
    whole = np.asarray(wider * np.linalg.pinv(slopes.T @ slopes, rcond=1e-14, hermitian=True), np.float64)
    # By Welch and Satterthwaite (JCGM 100:2008, G.4); the magnitude and phase of a line share one scatter.
    squares = (whole @ slopes.T)[:count, : 2 * lines.frequency_hz.size] ** 2
    shares = squares[:, : lines.frequency_hz.size] + squares[:, lines.frequency_hz.size :]
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1e-300)
    return LineFit(
        specimen=lines.specimen(found.x[:count]),
        logarithms=found.x[:count],
        covariance=whole[:count, :count],
        freedoms=spread / np.maximum(np.sum(shares**2, axis=1), 1e-300),
        phases=(float(phases[0]), float(phases[1])),
        further=found.x[count + CHANNEL_PHASES + (lines.scale_sd > 0.0) :],
        chi_square=float(2.0 * found.cost),
    )
