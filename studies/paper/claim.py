"""A claim of the paper as data, and what is found of it.

A number that a claim wants, with how far it may be off.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from vibench.analysis import InvalidRequest

from .case import AS_CHOSEN, Alternative, Case
from .evidence import Evidence


@dataclass(frozen=True)
class Expectation:
    """Bounds within which one measured number upholds a claim; both belong to it."""

    name: str
    """What is measured, in a few words."""
    unit: str
    """Empty for ratios and counts; ``"%"`` for shares, which are kept as fractions."""
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InvalidRequest(
                f"{self.name!r} wants {self.low:g} to {self.high:g}; give the lower bound first"
            )

    def is_met_by(self, value: float) -> bool:
        """Say whether a number lies within; nothing (NaN) meets nothing."""
        return self.low <= value <= self.high

    @property
    def sentence(self) -> str:
        """Say the bounds."""
        if math.isinf(self.high):
            return f"≥ {self.shown(self.low)}"
        if math.isinf(self.low):
            return f"≤ {self.shown(self.high)}"
        return f"{self.shown(self.low, '')} to {self.shown(self.high)}"

    def shown(self, value: float, unit: str | None = None) -> str:
        """Write a number with its unit."""
        if not np.isfinite(value):
            return "none"
        named = self.unit if unit is None else unit
        text = f"{100 * value:.0f}" if self.unit == "%" else f"{value:.4g}"
        return f"{text} {named}".rstrip()


def about(name: str, unit: str, value: float, within: float) -> Expectation:
    """Want a number, give or take a tolerance in its unit."""
    return Expectation(name, unit, value - within, value + within)


def at_least(name: str, unit: str, low: float) -> Expectation:
    """Want a number no smaller."""
    return Expectation(name, unit, low, math.inf)


def at_most(name: str, unit: str, high: float) -> Expectation:
    """Want a number no larger."""
    return Expectation(name, unit, -math.inf, high)


Measure = Callable[[Evidence, Case], tuple[float, ...]]
"""Measures the numbers of a claim under a case: one for each expectation, NaN where there is none."""


class Verdict(StrEnum):
    """What is found of a claim."""

    HOLDS = "holds"
    """Under the defaults."""
    HOLDS_FOR_SHARE = "holds for a share of starts"
    """Under the defaults, from some of the starts that were tried: which, is chance."""
    HOLDS_UNDER = "holds under"
    """Not under the defaults, but under a named option."""
    FAILS = "does not hold"
    """Under none of the options that were tried."""


@dataclass(frozen=True)
class Claim:
    """Something that the paper says and that can be measured."""

    key: str
    """Short name, unique."""
    place: str
    """Where the paper says it."""
    says: str
    measured_by: str
    """How we measure it, in one sentence."""
    wanted: tuple[Expectation, ...]
    """All of them must be met."""
    measure: Measure
    alternatives: tuple[Alternative, ...] = ()
    """Options tried where the defaults do not uphold it, in this order."""
    remark: str = ""
    """What a reader should know where it does not hold; without numbers, which the page measures."""
    draws: int = 1
    """Starts that it is measured from: more where its numbers hang on which motion chaos ends in, or when."""
    is_scored: bool = True
    """Whether it is measured again at every damping of the score; not where that would take too long."""


@dataclass(frozen=True)
class Finding:
    """The numbers of a claim under one case."""

    case: Case
    values: tuple[float, ...]
    """From rest."""
    is_met: bool
    """By every start."""
    draws: tuple[tuple[float, ...], ...] = ()
    """The numbers of every start, rest first."""
    met: int = 0
    """Starts that uphold the claim."""

    @property
    def is_met_in_part(self) -> bool:
        """By some starts, and not by all."""
        return 0 < self.met < len(self.draws)

    def spread(self, number: int) -> tuple[float, float]:
        """Give the smallest and the largest of one number over all starts; NaN where one has none."""
        values = [draw[number] for draw in self.draws]
        return float(np.min(values)), float(np.max(values))


@dataclass(frozen=True)
class Judgement:
    """A claim with all that was found of it: the defaults first, then the options tried."""

    claim: Claim
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """Say whether the claim holds, and how."""
        if self.findings[0].is_met:
            return Verdict.HOLDS
        if self.findings[0].is_met_in_part:
            return Verdict.HOLDS_FOR_SHARE
        return Verdict.FAILS if self.met_under is None else Verdict.HOLDS_UNDER

    @property
    def met_under(self) -> Finding | None:
        """The first finding that upholds the claim."""
        return next((each for each in self.findings if each.is_met), None)


def found(claim: Claim, evidence: Evidence, case: Case) -> Finding:
    """Measure a claim under one case, from every start.

    From rest alone under an option that does not uphold it there: then it is not upheld by every start.
    Raises InvalidRequest when the measure gives another count of numbers than the claim wants.
    """
    draws = [_measured(claim, evidence, case)]
    if _is_met(claim, draws[0]) or case.name == AS_CHOSEN:
        draws += [_measured(claim, evidence, replace(case, draw=number)) for number in range(1, claim.draws)]
    met = sum(_is_met(claim, values) for values in draws)
    return Finding(case, draws[0], met == len(draws), tuple(draws), met)


def _measured(claim: Claim, evidence: Evidence, case: Case) -> tuple[float, ...]:
    values = claim.measure(evidence, case)
    if len(values) != len(claim.wanted):
        raise InvalidRequest(
            f"the claim {claim.key!r} wants {len(claim.wanted)} numbers and {len(values)} were measured; "
            "give one for each"
        )
    return values


def _is_met(claim: Claim, values: tuple[float, ...]) -> bool:
    return all(wanted.is_met_by(value) for wanted, value in zip(claim.wanted, values, strict=True))


def judged(claim: Claim, evidence: Evidence, case: Case) -> Judgement:
    """Measure a claim under a case; where it is not upheld, under each of its alternatives until one does."""
    findings = [found(claim, evidence, case)]
    for alternative in claim.alternatives:
        if findings[-1].is_met or findings[0].is_met_in_part:
            break
        findings.append(found(claim, evidence, alternative.of(case)))
    return Judgement(claim, tuple(findings))
