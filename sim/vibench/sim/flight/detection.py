"""Whether, and when, a flight touches a stop: proved by a bound on the acceleration, never sampled. SI units.

Over a stretch p is a Taylor polynomial (exact to rounding) and |d2p/dt2| <= bound. Two rules follow:
the stretch is clear if both end gaps exceed bound * h^2 / 8; and from gap g with approach speed v no
stop can be reached sooner than 2 g / (v + sqrt(v^2 + 2 bound g)). The second converges quadratically
to a real crossing and never steps over one, however short the touch.
"""

import math

import numpy as np

from ..kernels.arrays import Vector
from ..kernels.compile import kernel_without_refcount

LARGEST_BOUND = 1e150
"""Beyond it squares overflow, and nothing can be said about touches [m/s^2]."""
SERIES_TERMS = 14
"""With |rate| * h <= `LONGEST_TURN` the first term left out is below 1e-18 of the sum."""
LONGEST_TURN = 0.25
"""Longest stretch, as the fastest rate of the system times its length [rad]."""
NEVER = -1.0

TOUCH = 1e-12
"""A gap below this part of the stop's distance counts as closed (4.5e-17 m for the paper's)."""
ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
"""A gap below this part of the largest term of p is rounding, and counts as closed."""
JUST_SHORT = 0.999
"""Part of the earliest possible return that is taken after leaving a stop."""
SHORTEST_ADVANCE = 1e-15
"""An advance is at least this long [s], so that a search always ends."""
TIGHTER_AFTER = 4
"""Advances after which a tighter bound is worth its cost."""
PATIENCE = 400
"""Advances after which the shortest one grows: a tangency followed for ever has no crossing."""
IMPATIENT = 1e-4
"""... to this part of the stretch."""


@kernel_without_refcount
def polynomial_at(series: Vector, tau: float) -> tuple[float, float]:
    """Value and derivative of a polynomial, coefficients ascending, an even number of them.

    Even and odd powers are summed apart: two short chains take half the time of a long one.
    """
    square = tau * tau
    even, odd, even_slope, odd_slope = 0.0, 0.0, 0.0, 0.0
    for k in range(len(series) - 2, -1, -2):
        even_slope = even_slope * square + even
        odd_slope = odd_slope * square + odd
        even = even * square + series[k]
        odd = odd * square + series[k + 1]
    return even + tau * odd, odd + 2.0 * tau * (even_slope + tau * odd_slope)


@kernel_without_refcount
def derivative_bound(series: Vector, length: float, derivative: int) -> float:
    """Bound of a derivative of a polynomial on [0, length]; coefficients ascending."""
    bound, power = 0.0, 1.0
    for k in range(derivative, len(series)):
        factor = 1.0
        for i in range(derivative):
            factor *= k - i
        bound += factor * abs(series[k]) * power
        power *= length
    return bound


@kernel_without_refcount
def _earliest(gap: float, approach: float, bound: float) -> float:
    """Earliest time [s] at which a gap can close when it closes now at ``approach`` [m/s]."""
    if gap == math.inf:  # or the formula divides infinite by infinite
        return math.inf
    root = math.sqrt(approach * approach + 2.0 * bound * gap)
    if approach > 0.0:
        return 2.0 * gap / (approach + root)
    return JUST_SHORT * (root - approach) / bound


@kernel_without_refcount
def first_contact(
    series: Vector, length: float, lowest: float, highest: float, bound: float, scale: float
) -> float:
    """Find the first touch of p with either stop on [0, length].

    Parameters
    ----------
    series
        p as a polynomial in the time since the start of the stretch [m, s].
    length, lowest, highest, bound
        Length of the stretch [s]; distances of the stops at negative and positive p [m], infinite for none;
        bound on abs(d2p/dt2) [m/s^2].
    scale
        Size of the terms that p was summed from [m]; its rounding decides what is a touch.

    Returns
    -------
    The time of the touch [s], or NEVER. A stop that is being left at the start is no touch.

    """
    nearer = min(lowest, highest)
    if nearer == math.inf:
        return NEVER
    touch = TOUCH * nearer + ROUNDING * scale
    shortest = min(SHORTEST_ADVANCE, IMPATIENT * length)
    positive = bound + 1e-300
    tau, advances = 0.0, 0
    while tau < length:
        p, rate = polynomial_at(series, tau)
        upper, lower = highest - p, lowest + p
        if (upper <= touch and rate > 0.0) or (lower <= touch and rate < 0.0):
            return tau
        advance = min(_earliest(max(upper, 0.0), rate, positive), _earliest(max(lower, 0.0), -rate, positive))
        tau += max(advance, shortest)
        advances += 1
        if advances == TIGHTER_AFTER:
            # What bounds the terms of p knows nothing of how they cancel; the polynomial does.
            positive = min(positive, derivative_bound(series, length, 2) + 1e-300)
        if advances == PATIENCE:
            shortest = IMPATIENT * length
    return NEVER


UNPROVED = -2.0
NEWTON = 6
"""Corrections to a touch; two are the rule."""


@kernel_without_refcount
def touched_side(p: float, rate: float, lowest: float, highest: float) -> float:
    """Side of the stop that is touched at p: the nearer one, not the one moved towards.

    At a grazing touch the speed is rounding and its sign says nothing. Where there is no room between the
    stops, p is rounding in its turn, and the speed tells.
    """
    if highest == math.inf:
        return -1.0
    if lowest == math.inf:
        return 1.0
    above, below = highest - p, lowest + p
    if abs(above - below) <= 0.5 * (highest + lowest):
        return math.copysign(1.0, rate)
    return 1.0 if above < below else -1.0
