"""95 % confidence intervals of shares and rates that are estimated from counts."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

# Quantiles of Student's t, the normal and the Poisson distribution, in closed form. They equal those of
# scipy.special, which is not used because importing it (0.2 s) takes longer than most scenes.


@cache
def student_quantile(freedom: int, probability: float) -> float:
    """Return a quantile of Student's t above its median, for a whole number of degrees of freedom.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964), eqs. 26.7.3 and 26.7.4.
    """

    def tail_share(angle: float) -> float:
        total, power = 0.0, math.cos(angle) ** (freedom % 2)
        for k in range(2 + freedom % 2, freedom + 1, 2):
            total += power
            power *= math.cos(angle) ** 2 * (k - 1) / k
        inside = math.sin(angle) * total
        return 1.0 - (2.0 / math.pi * (angle + inside) if freedom % 2 else inside)

    angle = _root(tail_share, 2.0 * (1.0 - probability), 0.5 * math.pi)
    return math.sqrt(freedom) * math.tan(angle)


def normal_quantile(tail: float) -> float:
    """Return the value that a standard normal variable exceeds with probability ``tail`` (at most 0.5)."""
    return math.sqrt(2.0) * _root(math.erfc, 2.0 * tail, 30.0)


def poisson_mean(fewer_than: int, probability: float) -> float:
    """Return the mean at which a Poisson count is below ``fewer_than`` with the given ``probability``."""

    def cumulative(mean: float) -> float:
        terms = (k * math.log(mean) - mean - math.lgamma(k + 1.0) for k in range(fewer_than))
        return math.fsum(map(math.exp, terms))

    return _root(cumulative, probability, 2.0 * fewer_than + 40.0)


def _root(decreasing: Callable[[float], float], value: float, high: float) -> float:
    """Return the argument (0 to ``high``) at which a decreasing function equals ``value``, by bisection."""
    low = 0.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if decreasing(middle) > value else (low, middle)
    return high


UNSURE = 0.05
"""Probability that a confidence interval does not contain the true value."""


@dataclass(frozen=True)
class Share:
    """Estimated share, such as a share of starts, with the limits of the confidence interval."""

    share: float
    low: float
    high: float


def wilson_share(count: float, trials: float, unsure: float = UNSURE) -> Share:
    """Return the share of successes, ``count`` of ``trials``, with Wilson's interval.

    The interval is valid for few trials, even with no failure or no success (Wilson, J. Am. Stat. Assoc. 22
    (1927) 209; Brown, Cai and DasGupta, Stat. Sci. 16 (2001) 101). Raises ValueError for no trials, more
    successes than trials, or an invalid probability.

    Parameters
    ----------
    count, trials
        Number of successes, and of trials.
    unsure
        Probability that the interval does not contain the true share.
    """
    if not (0.0 <= count <= trials < math.inf and trials > 0.0 and 0.0 < unsure < 1.0):
        msg = (
            f"{count} of {trials} trials with an error probability of {unsure} are not allowed: "
            "give 1 trial or more, a count from 0 to all trials, and a probability between 0 and 1."
        )
        raise ValueError(msg)
    deviations = normal_quantile(0.5 * unsure)
    share, weight = count / trials, deviations**2 / trials
    middle = (share + 0.5 * weight) / (1.0 + weight)
    half = math.sqrt(weight * (share * (1.0 - share) + 0.25 * weight)) / (1.0 + weight)
    # Set the limits 0 and 1 exactly, without rounding errors.
    return Share(
        share=share,
        low=0.0 if count == 0 else middle - half,
        high=1.0 if count == trials else middle + half,
    )


@dataclass(frozen=True)
class Count:
    """Number of trials with the outcome whose share is estimated."""

    trials: float
    """Number of trials; not an integer if dependent trials count as less than one."""
    is_final: bool
    """Whether all trials have ended; otherwise unfinished trials may still have any outcome."""


def shares_of(counts: Sequence[Count]) -> tuple[Share, ...]:
    """Return the shares of several outcomes with simultaneous 95 % confidence intervals.

    With two outcomes the intervals are ordinary intervals. With more outcomes, each interval is widened so
    that all hold jointly (Goodman, Technometrics 7 (1965) 247). The intervals allow for every possible final
    outcome of the trials that have not ended.
    """
    trials = sum(each.trials for each in counts)
    pending = sum(each.trials for each in counts if not each.is_final)
    unsure = UNSURE / (len(counts) if len(counts) > 2 else 1)
    found = []
    for each in counts:
        now = wilson_share(each.trials, trials, unsure)
        highest = each.trials + pending if each.is_final else pending
        high = wilson_share(highest, trials, unsure).high
        found.append(replace(now, low=now.low if each.is_final else 0.0, high=high))
    return tuple(found)


@dataclass(frozen=True)
class EscapeRate:
    """Rate at which chaos ends, estimated from several starts; the inverse rate is the mean lifetime."""

    rate_per_s: float
    """Number of escapes from chaos divided by the total time in chaos [1/s]."""
    low_per_s: float
    """One-sided lower 97.5 % confidence limit of the escape rate [1/s]; zero without escapes."""
    high_per_s: float
    """One-sided upper 97.5 % confidence limit of the escape rate; the 95 % limit without escapes."""
    escapes: int
    """Number of starts whose chaos ended."""
    chaotic_s: float
    """Total simulated time in chaos of the runs from all starts [s]."""

    @property
    def lifetime_above_s(self) -> float:
        """Lower bound on the mean lifetime of chaos [s]."""
        return 1.0 / self.high_per_s


def escape_rate(escapes: int, chaotic_s: float) -> EscapeRate:
    """Return the rate at which chaos ends, from the number of escapes and the total time in chaos [s].

    Lifetimes of transient chaos are exponentially distributed (Grebogi, Ott and Yorke, Physica D 7 (1983)
    181). Chaos that has not ended contributes the time up to the end of its run. The confidence interval is
    Garwood's for a Poisson process (Biometrika 28 (1936) 437).
    """
    tail = UNSURE if escapes == 0 else 0.5 * UNSURE
    low = 0.0 if escapes == 0 else poisson_mean(escapes, 1.0 - tail) / chaotic_s
    high = poisson_mean(escapes + 1, tail) / chaotic_s
    return EscapeRate(escapes / chaotic_s, low, high, escapes, chaotic_s)
