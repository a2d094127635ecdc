"""The first moment after m1 leaves a rigid stop on which it stood: too slow to search for touches. SI units.

A search that starts on the stop with no speed cannot tell leaving from touching: the gap grows with t^2 or
t^3 from nothing, and its first digits are rounding. But it surely grows while

    d2|p|/dt2 <= a + j t + b t^2 / 2 <= 0,

a and j the first derivatives there and b a bound of the fourth derivative of p.
"""

import math

from .compiled import compiled
from .detection import ROUNDING, TOUCH, derivative_bound
from .flight import FlightTables, fill_series
from .modes import Complex
from .parameters import Vector
from .rigid_stop import RESOLVED

SHORTEST_PART = 1e-3
"""A departure takes at least this part of a stretch: so little that m1 cannot get farther than rounding
into the stop, so much that a run goes on."""


@compiled
def time_to_depart(series: Vector, length: float, lowest: float, highest: float, scale: float) -> float:
    """Time for which m1 surely leaves the stop on which it stands [s]; 0 where it does not stand on one.

    Arguments as in `sim.detection.first_contact`; p is at time zero where the flight begins.
    """
    touch = TOUCH * min(lowest, highest) + ROUNDING * scale
    side = 0.0
    if highest - series[0] <= touch:
        side = 1.0
    elif lowest + series[0] <= touch:
        side = -1.0
    rate, bend, jerk = side * series[1], side * 2.0 * series[2], side * 6.0 * series[3]
    if side == 0.0 or rate * rate > 2.0 * abs(bend) * RESOLVED * touch:
        return 0.0
    bound = derivative_bound(series, length, 4)
    under_root = jerk * jerk - 2.0 * bend * bound
    sure = 0.0
    if under_root > 0.0:
        sure = 0.5 * (math.sqrt(under_root) - jerk) / max(bound, 1e-300)
    return min(length, max(sure, SHORTEST_PART * length))


@compiled
def departure(phasors: Complex, terms: Complex, series: Vector, tables: FlightTables) -> float:
    """Find how long a flight from these phasors surely leaves a stop [s]; see `time_to_depart`."""
    reach = 0.0
    for j in range(len(phasors)):
        terms[j] = phasors[j] * tables.path[j]
        reach += abs(terms[j])
    par = tables.par
    fill_series(series, terms, tables.rates)
    return time_to_depart(series, tables.grid, par.lower, par.upper, reach)
