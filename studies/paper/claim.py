"""A claim of the paper: a function that measures it, with the bounds of what it wants; and verdicts."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import numpy as np

from vibench.analysis import InvalidRequest

from .case import AS_CHOSEN, DAMPINGS, Alternative, Case
from .reading import Evidence, Reading, Values


@dataclass(frozen=True)
class Expectation:
    """Bounds, both included, within which one measured number upholds a claim."""

    name: str
    unit: str
    """Empty for ratios and counts; ``"%"`` for shares, which are kept as fractions."""
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InvalidRequest(
                f"{self.name!r} wants {self.low:g} to {self.high:g}; give the lower bound first"
            )

    @property
    def sentence(self) -> str:
        """The bounds in words."""
        if math.isinf(self.high):
            return f"≥ {self.shown(self.low)}"
        if math.isinf(self.low):
            return f"≤ {self.shown(self.high)}"
        return f"{self.shown(self.low, '')} to {self.shown(self.high)}"

    def shown(self, value: float, unit: str | None = None) -> str:
        """Write a number with its unit."""
        if not np.isfinite(value):
            return "none"
        text = f"{100 * value:.0f}" if self.unit == "%" else f"{value:.4g}"
        return f"{text} {self.unit if unit is None else unit}".rstrip()


def about(name: str, unit: str, value: float, within: float) -> Expectation:
    """Want a number, give or take a tolerance in its unit."""
    return Expectation(name, unit, value - within, value + within)


def at_least(name: str, unit: str, low: float) -> Expectation:
    """Want a number no smaller."""
    return Expectation(name, unit, low, math.inf)


def at_most(name: str, unit: str, high: float) -> Expectation:
    """Want a number no larger."""
    return Expectation(name, unit, -math.inf, high)


def peaks_at(wanted_hz: tuple[float, ...], within_hz: float) -> tuple[Expectation, ...]:
    """Want a peak near each frequency."""
    return tuple(about(f"peak at {each:g} Hz", "Hz", each, within_hz) for each in wanted_hz)


NO_THIRD = at_most("next peak over the second", "", 0.5)


@dataclass(frozen=True)
class Claim:
    """Something that the paper says and that can be measured."""

    key: str
    place: str
    """Where the paper says it."""
    says: str
    measured_by: str
    """How we measure it, in one sentence."""
    wanted: tuple[Expectation, ...]
    """All of them must be met."""
    measure: Callable[[Reading], Values]
    tried: tuple[Alternative, ...]
    """Alternatives where the defaults do not uphold it, in this order."""
    remark: str
    """What a reader should know where it does not hold; without numbers, which the page measures."""
    draws: int
    """Starts that it is measured from: more where its numbers depend on the motion that chaos ends in."""
    is_scored: bool
    """Whether it is measured again at every damping of the score."""

    def is_met_by(self, values: Values) -> bool:
        """Return whether every number lies within its bounds; nothing (NaN) meets nothing."""
        return all(each.low <= value <= each.high for each, value in zip(self.wanted, values, strict=True))


Measure = Callable[[Reading], Values]


def claim(
    place: str,
    measured_by: str,
    *wanted: Expectation,
    tried: tuple[Alternative, ...] = DAMPINGS,
    draws: int = 1,
    remark: str = "",
    is_scored: bool = True,
) -> Callable[[Measure], Claim]:
    """Make a claim of the function that measures it; its docstring is what the paper says."""

    def made(measure: Measure) -> Claim:
        key, says = measure.__name__.replace("_", "-"), " ".join((measure.__doc__ or "").split())
        return Claim(key, place, says, measured_by, wanted, measure, tried, remark, draws, is_scored)

    return made


costly_claim = partial(claim, tried=(), is_scored=False)
"""A claim that would take too long to measure at every damping."""


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
class Finding:
    """The numbers of a claim under one case, from every start, rest first."""

    case: Case
    draws: tuple[tuple[float, ...], ...]
    met: int
    """Starts that uphold the claim."""

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers from rest."""
        return self.draws[0]

    @property
    def is_met(self) -> bool:
        """Whether every start meets the claim."""
        return self.met == len(self.draws)

    @property
    def is_met_in_part(self) -> bool:
        """By some starts, and not by all."""
        return 0 < self.met < len(self.draws)

    def spread(self, number: int) -> tuple[float, float]:
        """Return the smallest and the largest of one number over all starts; NaN where one has none."""
        values = [draw[number] for draw in self.draws]
        return float(np.min(values)), float(np.max(values))


@dataclass(frozen=True)
class Judgement:
    """A claim with all that was found of it: the defaults first, then the alternatives tried."""

    claim: Claim
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """Whether the claim holds, and how."""
        if self.findings[0].is_met:
            return Verdict.HOLDS
        if self.findings[0].is_met_in_part:
            return Verdict.HOLDS_FOR_SHARE
        return Verdict.FAILS if self.met_under is None else Verdict.HOLDS_UNDER

    @property
    def met_under(self) -> Finding | None:
        """The first finding that upholds the claim."""
        return next((each for each in self.findings if each.is_met), None)


def finding(asked: Claim, evidence: Evidence, case: Case) -> Finding:
    """Measure a claim under one case, from every start.

    From rest alone under an alternative that does not uphold it there: then not every start upholds it.
    Raises InvalidRequest when the measure returns another count of numbers than the claim wants.
    """
    draws = [_measure(asked, evidence, case)]
    if asked.is_met_by(draws[0]) or case.name == AS_CHOSEN:
        draws += [_measure(asked, evidence, replace(case, draw=number)) for number in range(1, asked.draws)]
    return Finding(case, tuple(draws), sum(asked.is_met_by(values) for values in draws))


def _measure(asked: Claim, evidence: Evidence, case: Case) -> tuple[float, ...]:
    values = tuple(float(each) for each in asked.measure(Reading(evidence, case)))
    if len(values) != len(asked.wanted):
        raise InvalidRequest(
            f"the claim {asked.key!r} wants {len(asked.wanted)} numbers and {len(values)} were measured; "
            "give one for each"
        )
    return values


def judgement(asked: Claim, evidence: Evidence, case: Case) -> Judgement:
    """Measure a claim under a case; where it is not upheld, under each of its alternatives until one does."""
    findings = [finding(asked, evidence, case)]
    for alternative in asked.tried:
        if findings[-1].is_met or findings[0].is_met_in_part:
            break
        findings.append(finding(asked, evidence, alternative.of(case)))
    return Judgement(asked, tuple(findings))
