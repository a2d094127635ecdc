"""What is observed of a whole collision: its peaks and its lines. SI units."""

from ..kernels import (
    eight_of_sixteen,
    inlined,
    largest,
    sixteen,
    store,
)
from ._collision import DEEPER_BY, DEPTHS, UNIT, Collision
from ._tables import CollisionTables, top_of

ABOVE_POINTS = 1.03
"""The largest depth is at most this many times the largest one at the points."""


@inlined
def deepest_of(best: float, collision: Collision, gap: float, collisions: CollisionTables) -> float:
    """Largest abs(p) of a collision, or ``best`` if that is larger; the course of p or x is written over."""
    unit, depths = collision.deepest[UNIT] * collision.deepest[DEEPER_BY], collision.workspace[DEPTHS]
    if gap + unit * ABOVE_POINTS * largest(sixteen(depths, 0)) > best:
        store(collision.course, 0, eight_of_sixteen(collisions.about_middle, 0, depths))
        best = max(best, gap + unit * top_of(collision.course))
    return best
