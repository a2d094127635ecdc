"""Quantiles of Student's, the normal and Poisson's distribution, in closed form.

They are those of scipy.special, which takes a fifth of a second to import: more than most predictions.
"""

import math
from collections.abc import Callable


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
    """Return the mean of a Poisson count that stays below ``fewer_than`` with this probability."""

    def below(mean: float) -> float:
        terms = (k * math.log(mean) - mean - math.lgamma(k + 1.0) for k in range(fewer_than))
        return math.fsum(map(math.exp, terms))

    return _root(below, probability, 2.0 * fewer_than + 40.0)


def _root(decreasing: Callable[[float], float], value: float, high: float) -> float:
    """Find where a function takes a value between 0 and ``high``, to the last digit, by bisection."""
    low = 0.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if decreasing(middle) > value else (low, middle)
    return high
