"""What a step under a power law makes of a small change: the derivative of the step itself. SI units.

With the law's slope D_k at Gauss's points a change of p there solves eight linear equations,
(1 - gain D) dp = free du, and the rest follows from D dp as the motion does from F. Nothing is integrated
anew, and what holds for the step, such as being symplectic without damping, holds for its derivative.
"""

import numpy as np

from ..flight import read_change, write_change
from ..kernels import (
    Table,
    eight,
    eight_of_eight,
    inlined,
    kernel,
    kernel_without_refcount,
    solve_in_place,
    store,
)
from ..model import MOST_TERMS
from ..slots import UNITS, PowerTerms, keep_in_range
from ._flow import whole_power
from ._numbers import FEED, FREE, GAIN, MOVE, POINTS
from ._step import PowerStepState

SLOPES, BEFORE, AFTER, EQUATIONS = range(4)
"""Rows of the memory: the law's slopes, a change at the step's start and at its end, and the equations."""


@kernel
def power_memory() -> Table:
    """Memory that one run hands to every step."""
    return np.zeros((EQUATIONS + POINTS, POINTS + UNITS))


@inlined
def power_stiffness(p: float, power: PowerTerms) -> float:
    """Slope of a power law, dF/dp [N/m]; infinite or NaN where it overflows."""
    u = p * power.inverse_reference
    square, grown, exponent, slope = u * u, 1.0, 1, 0.0
    for place in range(MOST_TERMS):
        if power.halves[place] > 0:
            grown *= whole_power(square, power.halves[place])
            exponent += 2 * power.halves[place]
            slope += exponent * power.forces[place] * grown
    result: float = slope * power.inverse_reference
    return result


@kernel_without_refcount
def propagate_tangent_power(
    tangent: Table, step: PowerStepState, numbers: Table, power: PowerTerms, memory: Table
) -> None:
    """Carry every change over the step just tried and found good."""
    slopes, before, after, equations = memory[SLOPES], memory[BEFORE], memory[AFTER], memory[EQUATIONS:]
    for k in range(POINTS):
        slopes[k] = power_stiffness(step.place[k], power)
        for i in range(POINTS):
            equations[i, k] = (1.0 if i == k else 0.0) - numbers[GAIN + k, i] * slopes[k]
    for column in range(len(tangent)):
        write_change(before, tangent[column])
        store(after, 0, eight_of_eight(numbers, FREE, before))
        for i in range(POINTS):
            equations[i, POINTS + column] = after[i]
    solve_in_place(equations, POINTS, POINTS + len(tangent))
    for column in range(len(tangent)):
        change = tangent[column]
        write_change(before, change)
        free = eight(before, 0) + eight_of_eight(numbers, MOVE, before)
        for k in range(POINTS):
            before[k] = slopes[k] * equations[k, POINTS + column]
        store(after, 0, free + eight_of_eight(numbers, FEED, before))
        read_change(change, after)
        keep_in_range(change)
