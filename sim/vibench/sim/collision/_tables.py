"""What is known of a Hertz collision before it happens: the shapes of `vibench.sim.engine`, and the specimen.

SI units.
"""

from typing import NamedTuple

import numpy as np

from ..engine import ABOUT_MIDDLE, HEIGHTS, POINTS, SHARES, TERMS, collision_shapes
from ..flight import WIDE
from ..kernels import Table, Vector, kernel_without_refcount


class CollisionTables(NamedTuple):
    """Numbers of collisions."""

    fastest: float
    """Largest rate of the modes and the drive [1/s]."""
    struck: Table
    """Shape (m, i)."""
    shares: Table
    """Shape (m, k, i): integral up to point i of (t_i - t)^m times the polynomial in phi that is 1 at point k
    alone; time over the duration."""
    ends: Table
    """Shape (k, m): the same up to the end."""
    heights: Vector
    """Times of the points over the duration."""
    shapes: Table
    """Shape (SHAPES, SHAPE_ROWS, POINTS)."""
    durations: Table
    """Shape (SHAPES, 7): as `DURATION` and its neighbours say."""
    about_middle: Table
    """Shape (k, m): what a depth at point k adds to the m-th Taylor term of all about the middle of phi."""


NEWTON_TO_TOP = 4
FARTHEST_TOP = 0.5
"""From the middle of phi: eight terms hold a depth there to 1e-7, and a tenth as far away to rounding."""


@kernel_without_refcount
def top_of(terms: Vector) -> float:
    """Largest value of a Taylor polynomial of `TERMS` terms near its middle."""
    at = 0.0
    for _ in range(NEWTON_TO_TOP):
        slope, bend = 0.0, 0.0
        for term in range(TERMS - 1, 0, -1):
            bend = bend * at + slope
            slope = slope * at + term * terms[term]
        at = min(FARTHEST_TOP, max(-FARTHEST_TOP, at - slope / bend))
    value = 0.0
    for term in range(TERMS - 1, -1, -1):
        value = value * at + terms[term]
    return value


def collisions_in_a_course(fastest: float) -> CollisionTables:
    """Make the numbers of collisions whose course without force is known as a series of p, as in a chain.

    ``struck`` is left to fill in: what a unit impulse adds to the m-th term of p in fastest * t, column P.
    """
    shapes, durations = collision_shapes()
    return CollisionTables(
        fastest=fastest,
        struck=np.zeros((TERMS, WIDE)),
        shares=np.ascontiguousarray(SHARES[:, :, :POINTS]),
        ends=np.ascontiguousarray(SHARES[:, :, POINTS].T),
        heights=HEIGHTS,
        shapes=shapes,
        durations=durations,
        about_middle=ABOUT_MIDDLE,
    )
