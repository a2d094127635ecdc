"""Sums over the points of a collision, and over the terms of what is slow beside it. SI units."""

from ..engine import TERMS
from ..kernels import SimdVector, Vector, inlined, sixteen_of_sixteen
from ._tables import CollisionTables


@inlined
def at_heights(terms: Vector, turns: SimdVector) -> SimdVector:
    """Give a polynomial without its first term."""
    value: SimdVector = terms[TERMS - 1] * turns
    for term in range(TERMS - 2, 0, -1):
        value = (value + terms[term]) * turns
    return value


@inlined
def pushed(
    force: Vector, first: int, last: int, place: int, duration: float, collisions: CollisionTables
) -> SimdVector:
    """Give what a force at the points does to a number of the motion, by some terms of the series."""
    turn = collisions.fastest * duration
    factor = duration * turn**first
    value: SimdVector = (
        factor * collisions.struck[first, place] * sixteen_of_sixteen(collisions.shares[first], 0, force)
    )
    for term in range(first + 1, last):
        factor *= turn
        value += (
            factor * collisions.struck[term, place] * sixteen_of_sixteen(collisions.shares[term], 0, force)
        )
    return value
