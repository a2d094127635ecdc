"""Lift-off: the first moment after m1 leaves a rigid stop it stood on: too slow to search for touches. SI.

A search that starts on the stop with no speed cannot tell leaving from touching: the gap grows with t^2 or
t^3 from nothing, and its first digits are rounding. But it surely grows while

    d2|p|/dt2 <= a + j t + b t^2 / 2 <= 0,

a and j the first derivatives there and b a bound of the fourth derivative of p; and as long as m1 cannot have
crossed to the other stop.
"""

import math

from ..flight import derivative_bound
from ..kernels import Vector, kernel_without_refcount
from ..rigid import RESOLVED
from ..slots import Parameters

SHORTEST_PART = 1e-3
"""A departure takes at least this part of a stretch: so little that m1 cannot get farther than rounding
into the stop, so much that a run goes on."""
NEARLY = 0.99
"""Part of the least time to the other stop: the speed at the start, which is rounding, is in the rest."""


@kernel_without_refcount
def time_to_lift_off(series: Vector, length: float, closed: float, par: Parameters) -> float:
    """Time for which m1 surely leaves the stop on which it stands [s]; 0 where it does not stand on one.

    ``series`` is p as in `vibench.sim.flight.first_contact` from the start of the flight,
    ``closed`` the gap that counts as none.
    """
    side = 0.0
    if par.upper - series[0] <= closed:
        side = 1.0
    elif par.lower + series[0] <= closed:
        side = -1.0
    rate, bend, jerk = side * series[1], side * 2.0 * series[2], side * 6.0 * series[3]
    # A speed that cannot carry m1 out of what counts as closed, against the bend or against the jerk alone
    # (r^2 / 2b and, with the bend gone to nothing at a release, 2 r sqrt(2 r / j) / 3), is none.
    by_bend = rate * rate <= 2.0 * abs(bend) * RESOLVED * closed
    by_jerk = 8.0 * abs(rate) ** 3 <= 9.0 * abs(jerk) * (RESOLVED * closed) ** 2
    if side == 0.0 or not (by_bend or by_jerk):
        return 0.0
    if bend > 0.0 and not (jerk < 0.0 and 2.0 * bend**3 <= 3.0 * closed * jerk * jerk):
        # Still pressed on the stop, and by more than rounding: so far would it go before it turns.
        return 0.0
    bound = derivative_bound(series, length, 4)
    under_root = jerk * jerk - 2.0 * bend * bound
    sure = 0.0
    if under_root > 0.0:
        sure = 0.5 * (math.sqrt(under_root) - jerk) / max(bound, 1e-300)
    fastest = derivative_bound(series, length, 2)
    across = NEARLY * math.sqrt(2.0 * (par.lower + par.upper) / max(fastest, 1e-300))
    return min(length, across, max(sure, SHORTEST_PART * length))
