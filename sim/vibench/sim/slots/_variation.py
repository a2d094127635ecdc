"""Small changes of a state, carried along with the motion: the exact derivative of the flow. SI units.

A tangent is a table of changes, one a row: x, y, z, vx, vy, vz and the logarithm of a factor, so that a
change may grow by any amount. The derivative of the flow along a run is what becomes of the six unit changes.
"""

import math

import numpy as np

from ..kernels import Table, Vector, kernel_without_refcount

GROWTH = 6
"""Column of the factor's logarithm: the change itself is exp(row[GROWTH]) * row[:6]."""
TANGENT_SIZE = 7
UNITS = 6
"""Changes that span all directions of a state."""
LARGEST, SMALLEST = 1e100, 1e-100
"""A change beyond these is rescaled: its products with anything physical stay finite."""


def no_tangent() -> Table:
    """Make a tangent of no changes, for a run that may carry some at another time."""
    return np.zeros((0, TANGENT_SIZE))


def unit_tangent() -> Table:
    """Make the six unit changes, whose images are the columns of the flow's derivative."""
    return np.eye(UNITS, TANGENT_SIZE)


def derivative_of(tangent: Table) -> Table:
    """Give the derivative of the flow, shape (6, 6), from what became of `unit_tangent`."""
    return np.asarray((np.exp(tangent[:, GROWTH, None]) * tangent[:, :GROWTH]).T)


@kernel_without_refcount
def keep_in_range(change: Vector) -> None:
    """Move a factor that has become very large or small into the logarithm."""
    size = 0.0
    for i in range(GROWTH):
        size = max(size, abs(change[i]))
    if (size > LARGEST or size < SMALLEST) and 0.0 < size < math.inf:
        for i in range(GROWTH):
            change[i] /= size
        change[GROWTH] += math.log(size)
