"""A claim of the paper: a function that measures it, the required bounds, and verdicts."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import numpy as np

from vibench.analysis import InvalidRequest

from .options import AS_CHOSEN, DAMPINGS, Alternative, Case
from .reading import Evidence, Reading, Values


@dataclass(frozen=True)
class Expectation:
    """Inclusive bounds between which a measured number must lie if the claim is to hold."""

    name: str
    unit: str
    """Unit; empty for ratios and counts, ``"%"`` for shares, which are stored as fractions."""
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InvalidRequest(
                f"{self.name!r} has the bounds {self.low:g} to {self.high:g}; give the lower bound first"
            )

    @property
    def sentence(self) -> str:
        """The bounds in words."""
        if math.isinf(self.high):
            return f"≥ {self.number_text(self.low)}"
        if math.isinf(self.low):
            return f"≤ {self.number_text(self.high)}"
        if self.low == self.high:
            return self.number_text(self.low)
        return f"{self.number_text(self.low, '')} to {self.number_text(self.high)}"

    def number_text(self, value: float, unit: str | None = None) -> str:
        """Return a number with its unit."""
        if not np.isfinite(value):
            return "none"
        text = f"{100 * value:.0f}" if self.unit == "%" else f"{value:.4g}"
        return f"{text} {self.unit if unit is None else unit}".rstrip()


def about(name: str, unit: str, value: float, within: float) -> Expectation:
    """Return the requirement that a number equals a value within a tolerance, both in ``unit``."""
    return Expectation(name, unit, value - within, value + within)


def at_least(name: str, unit: str, low: float) -> Expectation:
    """Return the requirement that a number is at least a lower bound."""
    return Expectation(name, unit, low, math.inf)


def at_most(name: str, unit: str, high: float) -> Expectation:
    """Return the requirement that a number is at most an upper bound."""
    return Expectation(name, unit, -math.inf, high)


def peaks_at(wanted_hz: tuple[float, ...], within_hz: float) -> tuple[Expectation, ...]:
    """Return one requirement per expected peak: the measured frequency must agree within ``within_hz``."""
    return tuple(about(f"{each:g} Hz peak", "Hz", each, within_hz) for each in wanted_hz)


NO_THIRD = at_most("third peak over second", "", 0.5)
Measure = Callable[[Reading], Values]


@dataclass(frozen=True)
class Claim:
    """A measurable claim of the paper."""

    key: str
    place: str
    says: str
    measured_by: str
    """Method of measurement, in one sentence."""
    limits: tuple[Expectation, ...]
    """Requirements; the claim holds if all of them are met."""
    measure: Measure
    tried: tuple[Alternative, ...]
    """Alternatives to test, in this order, if the claim fails with the defaults."""
    remark: str
    """Comment on a failed claim, without measured numbers, because the page states these numbers."""
    draws: int
    """Number of initial states; several if the numbers depend on which motion follows a chaotic transient."""
    is_scored: bool
    """Whether the claim is also measured at every damping of the score."""

    def is_met_by(self, values: Values) -> bool:
        """Return whether every number lies within its bounds; NaN lies outside."""
        return all(each.low <= value <= each.high for each, value in zip(self.limits, values, strict=True))


def claim(
    place: str,
    measured_by: str,
    *wanted: Expectation,
    tried: tuple[Alternative, ...] = DAMPINGS,
    draws: int = 1,
    remark: str = "",
    is_scored: bool = True,
) -> Callable[[Measure], Claim]:
    """Return a decorator for a function that measures a claim; its docstring is the paper's statement."""

    def make_claim(measure: Measure) -> Claim:
        key, says = measure.__name__.replace("_", "-"), " ".join((measure.__doc__ or "").split())
        return Claim(key, place, says, measured_by, wanted, measure, tried, remark, draws, is_scored)

    return make_claim


costly_claim = partial(claim, tried=(), is_scored=False)
"""Decorator for a claim that takes too long to be measured at every damping."""


class Verdict(StrEnum):
    """Verdict on a claim."""

    HOLDS = "holds"
    HOLDS_FOR_SHARE = "holds for a share of starts"
    """With the defaults, the claim holds only for some initial states, which are a matter of chance."""
    HOLDS_UNDER = "holds under"
    FAILS = "does not hold"


@dataclass(frozen=True)
class Finding:
    """Numbers of a claim with the options of one case, for every initial state; the first state is rest."""

    case: Case
    draws: tuple[tuple[float, ...], ...]
    met_draws: int
    """Number of initial states for which the claim holds."""

    @property
    def values(self) -> tuple[float, ...]:
        """Numbers of the claim for the motion from rest."""
        return self.draws[0]

    @property
    def is_met(self) -> bool:
        """Whether the claim holds for every initial state."""
        return self.met_draws == len(self.draws)

    @property
    def is_met_in_part(self) -> bool:
        """Whether the claim holds for some initial states, but not for all."""
        return 0 < self.met_draws < len(self.draws)

    @property
    def share(self) -> str:
        """Number of initial states for which the claim holds, of all initial states, in words."""
        return f"{self.met_draws} of {len(self.draws)}"

    def spread(self, number: int) -> tuple[float, float]:
        """Return smallest and largest value of one number over the initial states; NaN if any is missing."""
        values = [draw[number] for draw in self.draws]
        return float(np.min(values)), float(np.max(values))


@dataclass(frozen=True)
class Judgement:
    """All findings on a claim: with the default options, then with the alternatives that were tested."""

    claim: Claim
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """Whether the claim holds, and with which options."""
        if self.findings[0].is_met:
            return Verdict.HOLDS
        if self.findings[0].is_met_in_part:
            return Verdict.HOLDS_FOR_SHARE
        return Verdict.FAILS if self.first_met is None else Verdict.HOLDS_UNDER

    @property
    def first_met(self) -> Finding | None:
        """The first finding for which the claim holds."""
        return next((each for each in self.findings if each.is_met), None)


def finding(claim: Claim, evidence: Evidence, case: Case) -> Finding:
    """Measure a claim with the options of one case, from every initial state.

    With alternative options, a claim that fails for the motion from rest is not measured from other initial
    states. Raises InvalidRequest when the number of measured values differs from the number of requirements.
    """

    def measure(draw: int) -> tuple[float, ...]:
        return tuple(map(float, claim.measure(Reading(evidence, replace(case, draw=draw)))))

    draws = [measure(case.draw)]
    required, measured = len(claim.limits), len(draws[0])
    if measured != required:
        raise InvalidRequest(
            f"the claim {claim.key!r} requires {required} numbers, but {measured} were measured; "
            "measure one number for each requirement"
        )
    if claim.is_met_by(draws[0]) or case.name == AS_CHOSEN:
        draws += map(measure, range(1, claim.draws))
    return Finding(case, tuple(draws), sum(map(claim.is_met_by, draws)))


def judgement(claim: Claim, evidence: Evidence, case: Case) -> Judgement:
    """Measure a claim with a case's options; if it fails, try alternatives until it holds."""
    findings = [finding(claim, evidence, case)]
    for alternative in claim.tried:
        if findings[-1].is_met or findings[0].is_met_in_part:
            break
        findings.append(finding(claim, evidence, alternative.of(case)))
    return Judgement(claim, tuple(findings))
