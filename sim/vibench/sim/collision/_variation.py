"""What a whole collision makes of a small change: the derivative of the collision itself. SI units.

With the stop's slope D_k at the points of the collision a change of p there solves sixteen linear equations,
as under a power law (`vibench.sim.power_law`). The force is nothing at both ends, so that a
collision that ends earlier or later by the change makes no difference of the first order.
"""

import math

import numpy as np

from ..flight import P, read_change, write_change
from ..kernels import Table, eight_of_eight, kernel_without_refcount, sixteen, solve_in_place, store
from ..slots import UNITS, Parameters, keep_in_range
from ._collision import DEPTHS, Collision
from ._sums import at_heights, move_on
from ._tables import POINTS, TERMS, CollisionTables

SLOPES, BEFORE, AFTER, COURSE, MOMENTS, EQUATIONS = range(6)


def collision_memory() -> Table:
    """Memory that one run hands to every collision."""
    return np.zeros((EQUATIONS + POINTS, POINTS + UNITS))


@kernel_without_refcount
def propagate_tangent_collision(
    tangent: Table,
    collision: Collision,
    duration: float,
    par: Parameters,
    collisions: CollisionTables,
    memory: Table,
) -> None:
    """Carry every change over the collision just found."""
    slopes, before, after, equations = memory[SLOPES], memory[BEFORE], memory[AFTER], memory[EQUATIONS:]
    turn, deepest = collisions.fastest * duration, collision.deepest[0]
    for k in range(POINTS):
        slopes[k] = (
            1.5 * par.contact_stiffness * math.sqrt(max(deepest * collision.workspace[DEPTHS, k], 0.0))
        )
        for i in range(POINTS):
            gain, factor = 0.0, duration
            for term in range(1, TERMS):
                factor *= turn
                gain += factor * collisions.struck[term, P] * collisions.shares[term, k, i]
            equations[i, k] = (1.0 if i == k else 0.0) - gain * slopes[k]
    for column in range(len(tangent)):
        write_change(before, tangent[column])
        course, there = memory[COURSE, :TERMS], memory[AFTER, :POINTS]
        store(course, 0, eight_of_eight(collisions.onto_p, 0, before))
        store(there, 0, at_heights(course, turn * sixteen(collisions.heights, 0)))
        for i in range(POINTS):
            equations[i, POINTS + column] = there[i] + before[P]
    solve_in_place(equations, POINTS, POINTS + len(tangent))
    for column in range(len(tangent)):
        change, moments = tangent[column], memory[MOMENTS]
        write_change(before, change)
        for term in range(TERMS):
            moments[term] = 0.0
            for k in range(POINTS):
                moments[term] += collisions.ends[k, term] * slopes[k] * equations[k, POINTS + column]
        move_on(after, before, moments, duration, collisions)
        read_change(change, after)
        keep_in_range(change)
