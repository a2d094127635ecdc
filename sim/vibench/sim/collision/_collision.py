"""A whole Hertz collision in one: depths at sixteen points and the duration, by Newton's method. SI units.

A collision of the same speed that is pressed alike is known (`vibench.sim.collision`), and so
is how it answers a misfit of its equations; what the other springs make of it beside that is small, and a few
corrections end below what the tolerance sees. Where they do not - next to no speed, springs as fast as the
collision, an instant to stop at in the midst of it - nothing is done here, and the steps of
`vibench.sim.contact` resolve it.
"""

import math
from typing import NamedTuple

import numpy as np

from ..contact import ROOT_FLOOR
from ..engine import (
    BY_DAMPER,
    BY_JERK,
    BY_PRESS,
    BY_SPRING,
    DEEPER,
    DEPTHS as SHAPE_DEPTHS,
    DURATION,
    END_ONTO_DURATION,
    HALF_FORCE,
    HARDEST,
    LASTS_BY,
    ONTO_DURATION,
    POINTS,
    SOFTEST,
    SPACING,
    TERMS,
    TO_DURATION,
)
from ..flight import WIDE, P
from ..kernels import (
    SimdVector,
    Table,
    Vector,
    eight_of_sixteen,
    inlined,
    root,
    sixteen,
    sixteen_of_sixteen,
    store,
    total,
)
from ._sums import at_heights, pushed
from ._tables import CollisionTables

LEAST_TOLERANCE = 1e-7
"""Stricter ones ask for more of the duration than sixteen points know."""
FRESH = 1e-4
"""A contact begins here when its w is below this part of the largest to come: a depth of 1e-8."""
LONGEST_TURN = 0.4
"""Longest collision, as the fastest rate of modes and drive times its time: what the series bears [rad]."""
LONGEST = 3.5
"""Duration of the collision that is pressed hardest, over its depth and speed."""
CLOSE = 0.1
"""Corrections end when depths change by this part of the tolerance; the next would be a thirtieth of it."""
MOST_CORRECTIONS = 8
LAG = 3e-6
"""What the slow springs make of the force is a thousandth, and is found anew while depths change by more."""
SLOW_TERMS = 6
"""Terms of that: the next is 1e-12."""
DEPTHS, FORCE, MISFIT, ACROSS, ACROSS_RATE, WORKSPACE_ROWS = range(6)
"""Rows of a room, at the points: depths over the largest, force [N], misfits of depths; x and vx for who
watches."""
UNIT, DEEPER_BY, PLACE = range(3)
"""Places of `Collision.deepest`."""


class Collision(NamedTuple):
    """One collision, seen from its own side: whatever the stop, p is positive."""

    workspace: Table
    motion: Vector
    """When it begins, shape (WIDE,)."""
    course: Vector
    """Terms of p without force, in fastest * t."""
    moments: Vector
    """Integrals of the force up to the end, as `CollisionTables.ends` has them."""
    after: Vector
    """The motion when it ends."""
    deepest: Vector
    """The depth that a collision of its speed reaches [m], the unit of depths; `DEEPER` of its shape; which
    shape that is."""


def new_collision() -> Collision:
    """Make the memory of all collisions of a run."""
    return Collision(
        np.zeros((WORKSPACE_ROWS, POINTS)),
        np.zeros(WIDE),
        np.zeros(TERMS),
        np.zeros(TERMS),
        np.zeros(WIDE),
        np.zeros(3),
    )


@inlined
def depth_of_fresh(
    root: float,
    root_scale: float,
    speed: float,
    longest: float,
    tolerance: float,
    collisions: CollisionTables,
) -> float:
    """Depth that a contact just begun will reach [m]; zero where it is not fresh, or takes too long."""
    deepest = (root_scale - ROOT_FLOOR) ** 2
    if tolerance < LEAST_TOLERANCE or root > FRESH * root_scale or not speed > 0.0:
        return 0.0
    if LONGEST * deepest >= speed * min(longest, LONGEST_TURN / collisions.fastest):
        return 0.0
    return deepest


@inlined
def find_collision(
    collision: Collision,
    speed: float,
    deepest: float,
    longest: float,
    tolerance: float,
    stiffness: float,
    gap: float,
    collisions: CollisionTables,
) -> float:
    """Find the depths and the duration of a collision whose course without force is written; zero if not."""
    duration = _duration(collision, speed, deepest, tolerance * CLOSE, stiffness, gap, collisions)
    if not 0.0 < duration < min(longest, LONGEST_TURN / collisions.fastest):
        return 0.0
    return duration


@inlined
def _press(collision: Collision, depths: SimdVector, stiff: float, collisions: CollisionTables) -> None:
    """Write the force at the points, and what comes of it by the end."""
    force = collision.workspace[FORCE]
    store(force, 0, stiff * depths * root(depths))
    store(collision.moments, 0, eight_of_sixteen(collisions.ends, 0, force))


@inlined
def _end_depth(collision: Collision, duration: float, collisions: CollisionTables) -> float:
    """How far p comes from where it was by the end."""
    turn, course, moments = collisions.fastest * duration, collision.course, collision.moments
    value = 0.0
    for term in range(TERMS - 1, 0, -1):
        value = turn * (value + course[term] + duration * collisions.struck[term, P] * moments[term])
    return value


@inlined
def _begin(
    collision: Collision, unit: float, deepest: float, press: float, stiff: float, collisions: CollisionTables
) -> float:
    """Write depths as far as they are known beforehand, to the first order; gives the duration likewise."""
    place = int((press - SOFTEST) / SPACING + 0.5)
    shape, known = collisions.shapes[place], collisions.durations[place]
    turn = collisions.fastest * unit
    # Each number of the specimen in units of the collision.
    kick = turn * stiff * unit / (deepest * HALF_FORCE)
    beside, jerk = press - (SOFTEST + SPACING * place), collision.course[3] * turn**3 / deepest
    damper, spring = collisions.struck[2, P] * turn * kick, collisions.struck[3, P] * turn * turn * kick
    depths = sixteen(shape, SHAPE_DEPTHS) + beside * sixteen(shape, BY_PRESS) + jerk * sixteen(shape, BY_JERK)
    depths += damper * sixteen(shape, BY_DAMPER) + spring * sixteen(shape, BY_SPRING)
    store(collision.workspace, DEPTHS, depths)
    later = beside * known[LASTS_BY] + jerk * known[LASTS_BY + 1]
    later += damper * known[LASTS_BY + 2] + spring * known[LASTS_BY + 3]
    collision.deepest[UNIT], collision.deepest[DEEPER_BY] = deepest, known[DEEPER]
    collision.deepest[PLACE] = place
    duration: float = unit * (known[DURATION] + later)
    return duration


@inlined
def _duration(
    collision: Collision,
    speed: float,
    deepest: float,
    close: float,
    stiffness: float,
    gap: float,
    collisions: CollisionTables,
) -> float:
    """Find the depths at the points and the duration; zero where the corrections do not end."""
    workspace, fastest, unit = collision.workspace, collisions.fastest, deepest / speed
    press = 2.0 * collision.course[2] * fastest * fastest * unit / speed
    if not SOFTEST <= press <= HARDEST:
        return 0.0
    stiff = stiffness * deepest * math.sqrt(deepest)
    duration = _begin(collision, unit, deepest, press, stiff, collisions)
    place = int((press - SOFTEST) / SPACING + 0.5)
    shape, end_onto_duration = collisions.shapes[place], collisions.durations[place, END_ONTO_DURATION]
    begun, over, changed = collision.motion[P] - gap, 1.0 / deepest, 1.0
    depths = sixteen(workspace, DEPTHS)
    slow = 0.0 * depths
    for _ in range(MOST_CORRECTIONS):
        _press(collision, depths, stiff, collisions)
        if changed > LAG * LAG:
            slow = pushed(workspace[FORCE], 2, SLOW_TERMS, P, duration, collisions)
        end = over * (begun + _end_depth(collision, duration, collisions))
        free = at_heights(collision.course, fastest * duration * sixteen(collisions.heights, 0))
        there = begun + free + slow + pushed(workspace[FORCE], 1, 2, P, duration, collisions)
        misfit = over * there - depths
        store(workspace, MISFIT, misfit)
        later = end_onto_duration * end + total(sixteen(shape, ONTO_DURATION) * misfit)
        change = sixteen_of_sixteen(shape, 0, workspace[MISFIT]) + end * sixteen(shape, TO_DURATION)
        depths, changed = depths - change, total(change * change)
        duration -= unit * later
        if not changed > close * close:
            store(workspace, DEPTHS, depths)
            _press(collision, depths, stiff, collisions)
            return duration if changed <= close * close else 0.0
    return 0.0
