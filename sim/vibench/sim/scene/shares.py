"""Intervals of counted shares and rates, valid in 19 cases of 20."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

# Quantiles of Student's, the normal and Poisson's distribution, in closed form.
# They equal those of scipy.special, whose import (0.2 s) takes longer than most predictions.


def student_quantile(freedom: int, probability: float) -> float:
    """Return the quantile of Student's t above its median, for a whole number of degrees of freedom.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964), eqs. 26.7.3 and 26.7.4.
    """

    def outside(angle: float) -> float:
        total, power = 0.0, math.cos(angle) ** (freedom % 2)
        for k in range(2 + freedom % 2, freedom + 1, 2):
            total += power
            power *= math.cos(angle) ** 2 * (k - 1) / k
        inside = math.sin(angle) * total
        return 1.0 - (2.0 / math.pi * (angle + inside) if freedom % 2 else inside)

    angle = _root(outside, 2.0 * (1.0 - probability), 0.5 * math.pi)
    return math.sqrt(freedom) * math.tan(angle)


def normal_quantile(tail: float) -> float:
    """Return the standard normal value that is exceeded with the probability ``tail``, at most one half."""
    return math.sqrt(2.0) * _root(math.erfc, 2.0 * tail, 30.0)


def poisson_mean(fewer_than: int, probability: float) -> float:
    """Return the mean of a Poisson count that is below ``fewer_than`` with this probability."""

    def below(mean: float) -> float:
        terms = (k * math.log(mean) - mean - math.lgamma(k + 1.0) for k in range(fewer_than))
        return math.fsum(map(math.exp, terms))

    return _root(below, probability, 2.0 * fewer_than + 40.0)


def _root(decreasing: Callable[[float], float], value: float, high: float) -> float:
    """Find where a function takes a value, between 0 and ``high``, to the last digit by bisection."""
    low = 0.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if decreasing(middle) > value else (low, middle)
    return high


UNSURE = 0.05
"""Probability that an interval misses its value."""


@dataclass(frozen=True)
class Share:
    """A share of starts with its interval."""

    share: float
    low: float
    high: float


def wilson_share(count: float, trials: float, unsure: float = UNSURE) -> Share:
    """Return the share for ``count`` of ``trials`` with Wilson's interval.

    It is valid for few trials, also if none or all count (Wilson, J. Am. Stat. Assoc. 22 (1927) 209;
    Brown, Cai and DasGupta, Stat. Sci. 16 (2001) 101). Raises ValueError for no trials, a count above the
    trials, or an invalid probability.

    Parameters
    ----------
    count, trials
        Number of successes, and of trials.
    unsure
        Probability that the interval misses the share.
    """
    if not (0.0 <= count <= trials < math.inf and trials > 0.0 and 0.0 < unsure < 1.0):
        msg = (
            f"{count} of {trials} trials, unsure to {unsure}, are not allowed: "
            "give one trial or more, at most as many counted, and a probability between 0 and 1."
        )
        raise ValueError(msg)
    deviations = normal_quantile(0.5 * unsure)
    share, weight = count / trials, deviations**2 / trials
    middle = (share + 0.5 * weight) / (1.0 + weight)
    half = math.sqrt(weight * (share * (1.0 - share) + 0.25 * weight)) / (1.0 + weight)
    # At 0 and 1 the interval is exact; rounding would miss them.
    return Share(
        share=share,
        low=0.0 if count == 0 else middle - half,
        high=1.0 if count == trials else middle + half,
    )


@dataclass(frozen=True)
class Count:
    """Trials with one outcome."""

    trials: float
    """Not a whole number if dependent trials count for fewer."""
    is_final: bool
    """False if the trials were not followed to their end and may have any outcome."""


def shares_of(counts: Sequence[Count]) -> tuple[Share, ...]:
    """Return the shares of several outcomes, whose intervals all hold together in 19 cases of 20.

    For two outcomes one interval is enough. For more, each interval is widened so that together they fail as
    rarely as a single one (Goodman, Technometrics 7 (1965) 247). Intervals also hold for the final outcomes
    of trials that are not final.
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
    """Rate at which chaos dies out (one over its mean lifetime), from several starts."""

    rate_per_s: float
    """Number of escapes over the total time in chaos [1/s]."""
    low_per_s: float
    """Lower 97.5 % confidence limit of the rate; zero without escapes."""
    high_per_s: float
    """Upper 97.5 % confidence limit of the rate; 95 % without escapes."""
    escapes: int
    """Number of starts whose chaos died out."""
    chaotic_s: float
    """Total time that all starts were followed in chaos."""

    @property
    def lifetime_above_s(self) -> float:
        """Return a lower bound on the mean lifetime of chaos."""
        return 1.0 / self.high_per_s

    @property
    def lifetime_below_s(self) -> float:
        """Return an upper bound on the mean lifetime of chaos; infinite without escapes."""
        return 1.0 / self.low_per_s if self.low_per_s > 0.0 else math.inf


def escape_rate(escapes: int, chaotic_s: float) -> EscapeRate:
    """Return the rate at which chaos dies out, from the number of escapes in the total time of all starts.

    Lifetimes of transient chaos are exponentially distributed (Grebogi, Ott and Yorke, Physica D 7 (1983)
    181); unfinished ones count as far as they were followed. The interval is for a Poisson process
    (Garwood, Biometrika 28 (1936) 437).
    """
    tail = UNSURE if escapes == 0 else 0.5 * UNSURE
    low = 0.0 if escapes == 0 else poisson_mean(escapes, 1.0 - tail) / chaotic_s
    high = poisson_mean(escapes + 1, tail) / chaotic_s
    return EscapeRate(escapes / chaotic_s, low, high, escapes, chaotic_s)
