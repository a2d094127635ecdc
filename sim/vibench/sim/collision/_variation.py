"""What a whole collision makes of a small change: the derivative of the collision itself. SI units.

With the stop's slope at the points of the collision a change of p there solves sixteen linear equations, as
under a power law (`vibench.sim.power_law`). The answer of a collision that is pressed alike stands ready
(`CollisionTables.shapes`) and is corrected until it solves these. The force is nothing at both ends, so that
a collision that ends earlier or later by the change makes no difference of the first order.
"""

import numpy as np

from ..engine import END_ONTO_DURATION, ONTO_DURATION, POINTS, TERMS, TO_DURATION
from ..flight import P, read_change, write_change
from ..kernels import (
    Table,
    eight_of_eight,
    eight_of_sixteen,
    kernel_without_refcount,
    root,
    sixteen,
    sixteen_of_sixteen,
    store,
    total,
)
from ..slots import Parameters, keep_in_range
from ._collision import DEPTHS, PLACE, SLOW_TERMS, UNIT, Collision
from ._sums import at_heights, move_on
from ._tables import CollisionTables

SLOPES, BEFORE, AFTER, COURSE, MOMENTS, CHANGE, MISFIT, GAINS = range(8)
"""Rows of a memory. From the last on: what a change of p at one point adds to p at all of them."""
EXACT = 1e-13
"""Corrections end when they change the solution by this part of it."""
MOST_CORRECTIONS = 24
"""The next is a thirtieth of the last, or less."""


def collision_memory() -> Table:
    """Memory that one run hands to every collision."""
    return np.zeros((GAINS + POINTS, POINTS))


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
    turn, slopes = collisions.fastest * duration, memory[SLOPES]
    depths = collision.deepest[UNIT] * sixteen(collision.workspace, DEPTHS)
    store(slopes, 0, 1.5 * par.contact_stiffness * root(depths))
    for k in range(POINTS):
        factor = slopes[k] * duration * turn
        gain = factor * collisions.struck[1, P] * sixteen(collisions.shares[1], k)
        for term in range(2, SLOW_TERMS):
            factor *= turn
            gain += factor * collisions.struck[term, P] * sixteen(collisions.shares[term], k)
        store(memory, GAINS + k, gain)
    before, after, course, moments = (
        memory[BEFORE, :TERMS],
        memory[AFTER, :TERMS],
        memory[COURSE, :TERMS],
        memory[MOMENTS, :TERMS],
    )
    for change in tangent:
        write_change(before, change)
        store(course, 0, eight_of_eight(collisions.onto_p, 0, before))
        free = before[P] + at_heights(course, turn * sixteen(collisions.heights, 0))
        store(memory, MISFIT, free)
        _solve(memory, collision, collisions)
        store(memory, CHANGE, sixteen(memory, SLOPES) * sixteen(memory, CHANGE))
        store(moments, 0, eight_of_sixteen(collisions.ends, 0, memory[CHANGE]))
        move_on(after, before, moments, duration, collisions)
        read_change(change, after)
        keep_in_range(change)


@kernel_without_refcount
def _solve(memory: Table, collision: Collision, collisions: CollisionTables) -> None:
    """Write the change of p at the points: free + gains change = change, where the misfit begins as free.

    The answer that stands ready is that of depths and duration; the duration is kept by a misfit of the end.
    """
    place = int(collision.deepest[PLACE])
    shape, end_onto_duration = collisions.shapes[place], collisions.durations[place, END_ONTO_DURATION]
    misfit = free = sixteen(memory, MISFIT)
    change = 0.0 * free
    for _ in range(MOST_CORRECTIONS):
        end = -total(sixteen(shape, ONTO_DURATION) * misfit) / end_onto_duration
        step = sixteen_of_sixteen(shape, 0, memory[MISFIT]) + end * sixteen(shape, TO_DURATION)
        change = change - step
        store(memory, CHANGE, change)
        if not total(step * step) > EXACT * EXACT * total(change * change):
            return
        misfit = free + sixteen_of_sixteen(memory, GAINS, memory[CHANGE]) - change
        store(memory, MISFIT, misfit)
