"""Compare a measurement with simulated draws: bands, ranks and z, corrected for multiple comparisons.

In chaos, a measurement and its simulation (a draw) are two samples from one distribution. The test is whether
the measurement could be another draw.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy

from ..signals import PER_NEPER_DB, Flags, Integers, Reals
from ..tables import Tabular

AGREEMENT = 0.99
"""Probability that a correct simulation has all |z| within the limit, however many values there are."""
BAND = 0.95
MIXED = -1
"""State of a value that mixes two kinds of motion; such a value is not compared."""
FEWEST_DRAWS = 5
"""Minimum number of draws with the measured kind of motion for a comparison."""
_CLEAR = 0.75
"""No more draws are made if every measured value has |z| within this fraction of the limit."""
_FEWEST_POINTS = 30
"""Minimum number of values per draw for the largest |z| to follow Gumbel's distribution."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """Values of one physical quantity from one analysis: magnitudes, or phases; arrays of shape (points,)."""

    name: str
    """Name of the quantity, such as ``"Response II"`` or ``"band around 201 Hz"``."""
    frequency_hz: Reals
    value: Reals
    """Values of the quantity; NaN where missing."""
    state: Integers | None = None
    """Kind of motion at each point (colliding or not), if it varies; only points of one kind are compared."""


class Phase(Quantity):
    """Phases of one quantity [rad]."""


@dataclass(frozen=True, eq=False)
class EnsembleCurve(Tabular):
    """One quantity, measured and in every draw.

    Square roots are compared because they are nearly normally distributed, both for accurate and for random
    magnitudes (skewness -0.1 for Rayleigh's distribution; logarithms -1.1).

    The limit of |z| accounts for the number of frequencies (Sidak 1967), few draws (Student's t), and long
    tails (each draw is compared with the others). 1 % of correct simulations exceed this limit.
    """

    DOCUMENT: ClassVar = (
        "quantity=name agrees=verdict compared outside largest_z limit_z=limit share_in_band frequency_hz "
        "measured median lower upper z rank draws=count"
    )

    name: str
    frequency_hz: Reals
    """Frequencies of the points, shape (points,)."""
    measured: Reals
    """Measured values of the quantity, shape (points,)."""
    draws: Reals
    """Simulated values of the quantity, shape (draws, points); NaN where the kind of motion differs."""

    @cached_property
    def count(self) -> Integers:
        """Number of draws with a value at each point, shape (points,)."""
        return np.asarray(np.sum(np.isfinite(self._roots), axis=0), dtype=np.int64)

    @cached_property
    def median(self) -> Reals:
        """Median of the draws, shape (points,); NaN for fewer than two draws."""
        return self._value(_over_draws(self._roots, np.nanmedian))

    @cached_property
    def lower(self) -> Reals:
        """Lower end of the band that contains 95 % of further draws; NaN for fewer than five draws."""
        return self._value(self._mean - self._reach)

    @cached_property
    def upper(self) -> Reals:
        """Upper end of the band that contains 95 % of further draws; NaN for fewer than five draws."""
        return self._value(self._mean + self._reach)

    @cached_property
    def relative_sd(self) -> Reals:
        """Relative standard deviation of the draws, shape (points,); NaN for fewer than two draws."""
        return 2 * self._sd / self._mean

    @cached_property
    def rank(self) -> Integers:
        """Number of draws below the measured value, shape (points,)."""
        return np.asarray(np.sum(self._roots < self._root, axis=0), dtype=np.int64)

    @cached_property
    def z(self) -> Reals:
        """Measured value as an equivalent normal deviate, shape (points,); NaN if not compared.

        z has the same probability as Student's t of one more draw, (sqrt(m) - mean) / (sd sqrt(1 + 1/n)).
        """
        return np.where(self._is_compared, _deviates(self._root, self._mean, self._sd, self.count), np.nan)

    @property
    def compared(self) -> int:
        """Number of points with enough draws for a comparison."""
        return int(np.sum(self._is_compared))

    @property
    def largest_z(self) -> float:
        """The z with the largest magnitude; NaN without comparisons."""
        z = self.z[np.isfinite(self.z)]
        return float(z[np.argmax(np.abs(z))]) if z.size else np.nan

    @cached_property
    def limit(self) -> float:
        """Limit: the largest |z| of all compared points that chance explains.

        This is the limit for normal values, or a larger one if the draws have longer tails.
        """
        normal = z_limit(self.compared)
        own = np.abs(self._z_of_draws[:, self._is_compared])
        own = own[np.isfinite(own).any(axis=1)]
        if self.compared < _FEWEST_POINTS or len(own) < FEWEST_DRAWS:
            return normal
        return max(normal, largest_of_chance(np.nanmax(own, axis=1)))

    @property
    def outside(self) -> int:
        """Number of points whose |z| exceeds the limit for chance."""
        return int(np.sum(np.abs(self.z[np.isfinite(self.z)]) > self.limit))

    @property
    def agrees(self) -> bool:
        """Whether the measurement could be another draw."""
        return self.outside == 0

    @property
    def agrees_clearly(self) -> bool:
        """Whether more draws would hardly change the agreement (`benchmarks/twin_agreement.py --stop`)."""
        return abs(self.largest_z) <= _CLEAR * z_limit(self.compared)

    @property
    def verdict(self) -> bool | None:
        """Whether measurement and draws agree; None without comparisons."""
        return self.agrees if self.compared else None

    @property
    def share_in_band(self) -> float:
        """Fraction of compared points within the 95 % band."""
        inside = np.abs(self._root - self._mean) <= self._reach
        return float(np.mean(inside[self._is_compared])) if self.compared else np.nan

    @property
    def sentence(self) -> str:
        """Result of the comparison in words."""
        if not self.compared:
            return f"{self.name}: too few draws to compare (few draws show the measured kind of motion)"
        verdict = "within" if self.agrees else "outside"
        if self.measured.size == 1:
            agrees = "agrees with" if self.agrees else "differs from"
            # A value outside the 95 % band may still agree, so state the limit for |z|.
            limit = "" if self.share_in_band else f", {verdict} the limit of {self.limit:.1f}"
            measured, median, lower, upper = map(
                self._text, (self.measured, self.median, self.lower, self.upper)
            )
            return (
                f"{self.name} {measured} {agrees} the twin's {median} (95 % of draws {lower} to {upper}; "
                f"rank {self.rank[0]} of {self.count[0]}, z = {self.z[0]:+.1f}{limit})"
            )
        worst_hz = self.frequency_hz[np.nanargmax(np.abs(self.z))]
        return (
            f"{self.name}: {100 * self.share_in_band:.0f} % of {self.compared} values within the twin's 95 % "
            f"band, largest |z| {abs(self.largest_z):.1f} standard deviations at {worst_hz:.4g} Hz, "
            f"{verdict} the limit of {self.limit:.1f}"
        )

    @cached_property
    def _z_of_draws(self) -> Reals:
        """The z of each draw relative to the other draws, shape (draws, points); NaN with too few draws."""
        left = self.count - 1
        away = self._roots - self._mean
        with np.errstate(invalid="ignore", divide="ignore"):
            squares = left * self._sd**2
            # Sum of squares of the other draws; less than 1e-9 of the sum of all draws is a rounding error.
            others = np.maximum(squares - away**2 * self.count / left, 1e-9 * squares)
            found = _deviates(self._roots, self._mean - away / left, np.sqrt(others / (left - 1)), left)
        return np.where(left >= FEWEST_DRAWS, found, np.nan)

    def _text(self, values: Reals) -> str:
        return f"{values[0]:.4g}"

    def _value(self, roots: Reals) -> Reals:
        return np.asarray(np.maximum(roots, 0.0) ** 2)

    @cached_property
    def _roots(self) -> Reals:
        return np.sqrt(np.where(self.draws >= 0, self.draws, np.nan))

    @cached_property
    def _root(self) -> Reals:
        return np.sqrt(np.where(self.measured > 0, self.measured, np.nan))

    @cached_property
    def _mean(self) -> Reals:
        return _over_draws(self._roots, np.nanmean)

    @cached_property
    def _sd(self) -> Reals:
        return _over_draws(self._roots, lambda x, axis: np.nanstd(x, axis=axis, ddof=1))

    @cached_property
    def _reach(self) -> Reals:
        count = np.maximum(self.count, 2)
        reach = scipy.stats.t.ppf(0.5 + 0.5 * BAND, count - 1) * self._sd * np.sqrt(1 + 1 / count)
        return np.where(self.count >= FEWEST_DRAWS, reach, np.nan)

    @cached_property
    def _is_compared(self) -> Integers:
        with np.errstate(invalid="ignore"):
            return np.asarray(np.isfinite(self._root) & (self.count >= FEWEST_DRAWS) & (self._sd > 0))


class PhaseCurve(EnsembleCurve):
    """Phases, measured and in every draw [rad]; the angles from the draws' mean direction are compared.

    These angles lie within half a turn, so the band may extend beyond pi. Phases that scatter over the whole
    circle do not disagree.
    """

    OWN_UNITS: ClassVar = {"measured": "rad", "draws": "rad"}

    def _text(self, values: Reals) -> str:
        return f"{np.degrees(values[0]):.2f}°"

    @cached_property
    def _direction(self) -> Reals:
        """Mean direction of the draws, within half a turn of the measured phase."""
        found: Reals = np.angle(np.nansum(np.exp(1j * self.draws), axis=0))
        return np.where(np.isfinite(self.measured), self.measured - _turn(self.measured - found), found)

    def _value(self, roots: Reals) -> Reals:
        return np.asarray(self._direction + roots)

    @cached_property
    def _roots(self) -> Reals:
        return _turn(self.draws - self._direction)

    @cached_property
    def _root(self) -> Reals:
        return np.asarray(self.measured - self._direction)


def _turn(angle_rad: Reals) -> Reals:
    """Return the angles, reduced to -pi to pi [rad]."""
    return np.asarray(np.angle(np.exp(1j * angle_rad)))


def _deviates(roots: Reals, mean: Reals, sd: Reals, count: Integers) -> Reals:
    """Convert Student's t of one more draw to the normal deviate of equal probability (at least 1e-300)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        deviate = (roots - mean) / (sd * np.sqrt(1 + 1 / np.maximum(count, 1)))
        tail = scipy.stats.t.logsf(np.abs(deviate), np.maximum(count - 1, 1))
    return np.asarray(np.sign(deviate) * scipy.stats.norm.isf(np.exp(np.maximum(tail, -690.0))))


def largest_of_chance(largest: Reals) -> float:
    """Return the limit that the largest |z| of another draw stays below in 99 % of cases.

    ``largest`` contains the largest |z| of each draw (five or more). The limit is a quantile of the Gumbel
    distribution with the mean and standard deviation of these values. Both are uncertain if draws are few, so
    a fitted factor widens the limit; otherwise 2 % of cases with 16 draws and 5 % with five would exceed it.
    """
    quantile = (-np.log(-np.log(AGREEMENT)) - np.euler_gamma) * np.sqrt(6) / np.pi
    widened = quantile * (1 + 3.3 / largest.size + 5 / largest.size**2)
    return float(np.mean(largest) + widened * np.std(largest, ddof=1))


def z_limit(values: int) -> float:
    """Return the |z| that, in 99 % of cases, none of ``values`` independent normal deviates exceeds."""
    return float(scipy.stats.norm.isf(0.5 * (1 - AGREEMENT ** (1 / max(values, 1)))))


def ensemble_curves(
    measured: Sequence[Quantity], draws: Sequence[Sequence[Quantity]]
) -> tuple[EnsembleCurve, ...]:
    """Return each measured quantity with its draws; quantities without draws are left out."""
    found = []
    for each in measured:
        rows = [_comparable(each, one) for draw in draws for one in draw if one.name == each.name]
        if rows:
            curve = PhaseCurve if isinstance(each, Phase) else EnsembleCurve
            found.append(curve(each.name, each.frequency_hz, each.value, np.array(rows)))
    return tuple(found)


def _comparable(measured: Quantity, drawn: Quantity) -> Reals:
    """Return a draw's values; NaN where its points or its kind of motion differ from the measurement."""
    if drawn.value.shape != measured.value.shape:
        return np.full(measured.value.shape, np.nan)
    if measured.state is None or drawn.state is None:
        return drawn.value
    alike = (measured.state == drawn.state) & (measured.state != MIXED)
    return np.where(alike, drawn.value, np.nan)


def _over_draws(values: Reals, reduce: object) -> Reals:
    """Apply ``reduce`` over the draws; return NaN, without a warning, at points with fewer than two draws."""
    some = np.sum(np.isfinite(values), axis=0) > 1
    found = np.full(values.shape[1:], np.nan)
    if some.any():
        found[some] = reduce(values[:, some], axis=0)  # type: ignore[operator]
    return found


@dataclass(frozen=True)
class CurveDifference(Tabular):
    """Ratio of measured to simulated magnitude; arrays of shape (points,)."""

    DOCUMENT: ClassVar = "median_abs_db rms_db share_within_two_standard_errors=share_within_two"

    frequency_hz: Reals
    decibel: Reals
    standard_errors: Reals
    """ln(measured / simulated) divided by the combined standard deviation; infinite if the latter is zero."""

    def where(self, kept: Flags) -> "CurveDifference":
        """Return the ratios at the points flagged by ``kept``."""
        return CurveDifference(self.frequency_hz[kept], self.decibel[kept], self.standard_errors[kept])

    @property
    def median_abs_db(self) -> float:
        """Median of the absolute difference; like the other numbers, NaN without points to compare."""
        return _of_known(lambda known: np.median(np.abs(known)), self.decibel)

    @property
    def rms_db(self) -> float:
        """Root mean square of the difference."""
        return _of_known(lambda known: np.sqrt(np.mean(known**2)), self.decibel)

    @property
    def share_within_two(self) -> float:
        """Fraction of points within two standard errors; 0.95 is expected for scatter alone."""
        return _of_known(lambda known: np.mean(np.abs(known) <= 2), self.standard_errors)


def _of_known(reduce: Callable[[Reals], Any], values: Reals) -> float:
    known = values[~np.isnan(values)]
    return float(reduce(known)) if known.size else np.nan


def logarithmic_difference(
    frequency_hz: Reals, measured: tuple[Reals, Reals], simulated: tuple[Reals, Reals]
) -> CurveDifference:
    """Compare magnitudes; each pair is (magnitude, relative standard deviation)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        nepers = np.log(measured[0] / simulated[0])
        spread = np.hypot(measured[1], simulated[1])
        return CurveDifference(frequency_hz, PER_NEPER_DB * nepers, np.asarray(nepers / spread))


# Motions that end by chance, described by a rate per second.
#
# Transient chaos ends at a different time in every run, and so do collisions in a sweep. Escapes have a
# constant rate (Tel and Lai, Phys. Rep. 460 (2008), ch. 1); each run gives one sample of the escape time.

_ONE_EDGE_S = 2.0
"""If the motion ends within this interval [s] in all runs, its end has a common cause and is not random."""


@dataclass(frozen=True)
class Ending:
    """End of a motion in one run: the earliest possible end, and the actual end or the end of the record."""

    what: str
    """Kind of motion: ``"collisions"`` or ``"irregular motion"``."""
    start_s: float
    stop_s: float
    ended: bool
    """Whether the motion ended; False if it lasted to the end of the record."""


@dataclass(frozen=True)
class EscapeRate:
    """Rate at which a motion ends by chance."""

    DOCUMENT: ClassVar = (
        "what runs ends measured_ended=measured.ended measured_end_s=measured.stop_s counted_from_s=from_s "
        "events exposure_s per_s per_s_lower=bounds_per_s.0 per_s_upper=bounds_per_s.1"
    )

    what: str
    runs: int
    """Number of runs including the measured one."""
    ends: int
    measured: Ending
    exposure_s: float
    """Total time of all runs during which an end would have been counted [s]."""
    events: int
    """Number of counted ends, excluding the end at ``from_s``."""
    from_s: float
    """Time of the first end in any run, from which ends are counted [s]."""

    @property
    def per_s(self) -> float:
        """Most likely rate: events divided by exposure [1/s]."""
        return self.events / self.exposure_s

    @property
    def bounds_per_s(self) -> tuple[float, float]:
        """Exact 95 % bounds of a Poisson rate (Garwood 1936)."""
        low = float(scipy.stats.chi2.ppf(0.025, 2 * self.events)) if self.events else 0.0
        high = float(scipy.stats.chi2.ppf(0.975, 2 * self.events + 2))
        return low / (2 * self.exposure_s), high / (2 * self.exposure_s)

    @property
    def sentence(self) -> str:
        """Rate and bounds in words."""
        low, high = self.bounds_per_s
        return (
            f"The end of {self.what} is random: it occurred in {self.ends} of {self.runs} runs, including "
            f"the measured one; after the first end, each other run ended at a rate of {self.per_s:.2g} per "
            f"second ({low:.2g} to {high:.2g})"
        )


def escape_rate(measured: Sequence[Ending], draws: Sequence[Sequence[Ending]]) -> EscapeRate | None:
    """Return the rate from the measured run and its draws; None if no run ended or all ended together."""
    if not measured:
        return None
    mine = measured[0]
    runs = [mine, *(one for draw in draws for one in draw[:1] if one.what == mine.what)]
    stops = np.array([each.stop_s for each in runs if each.ended])
    if len(runs) == 1 or not stops.size or np.ptp([each.stop_s for each in runs]) < _ONE_EDGE_S:
        return None
    # Count from the first end in any run: earlier, it may have been impossible for a run to end.
    from_s = float(stops.min())
    exposure_s = sum(max(each.stop_s - from_s, 0.0) for each in runs)
    if exposure_s <= 0.0:
        return None
    return EscapeRate(mine.what, len(runs), stops.size, mine, exposure_s, stops.size - 1, from_s)
