"""Rows made orthonormal in a metric, and by how much each had grown: the QR step of Lyapunov exponents.

Modified Gram and Schmidt, twice (twice is enough: Giraud, Langou and Rozloznik, Comput. Math. Appl. 50 (2005)
1069).
"""

import math

import numpy as np

from vibench.sim.kernels.arrays import Table, Vector
from vibench.sim.kernels.compile import kernel_without_refcount

PASSES = 2
LOST = 1e-11
"""A row of which no more than this part is left has no direction of its own any more."""


@kernel_without_refcount
def dot(first: Vector, second: Vector, metric: Table) -> float:
    """Inner product first' metric second."""
    total = 0.0
    for i in range(len(first)):
        part = 0.0
        for j in range(len(second)):
            part += metric[i, j] * second[j]
        total += first[i] * part
    return total


@kernel_without_refcount
def orthonormalise(rows: Table, metric: Table, logarithms: Vector) -> None:
    """Make ``rows`` orthonormal in place; add the logarithm of what each is divided by to ``logarithms``.

    A row that has become a combination of those before it (an impact without rebound leaves two such) adds
    minus infinity, and goes on in a direction of its own.
    """
    width = rows.shape[1]
    for i in range(len(rows)):
        row = rows[i]
        whole = math.sqrt(dot(row, row, metric))
        length = _left_of(rows, i, metric)
        if not length > LOST * whole and math.isfinite(whole):
            logarithms[i] = -math.inf
            for axis in range(width):
                # Of the axes one at least leaves enough; the next orthogonalisation tells.
                row[:] = 0.0
                row[axis] = 1.0 / math.sqrt(metric[axis, axis])
                length = _left_of(rows, i, metric)
                if length * length * width > 0.5:
                    break
        else:
            logarithms[i] += math.log(length)
        for k in range(width):
            row[k] /= length


@kernel_without_refcount
def _left_of(rows: Table, i: int, metric: Table) -> float:
    """Take from row ``i`` its part along the rows before, and give the length of what is left."""
    row = rows[i]
    for _ in range(PASSES):
        for j in range(i):
            along = dot(rows[j], row, metric)
            for k in range(len(row)):
                row[k] -= along * rows[j, k]
    return math.sqrt(dot(row, row, metric))


def orthonormal_rows(rows: Table, metric: Table) -> Table:
    """Give rows of the same span, orthonormal in the metric, shape (m, n)."""
    made = np.array(rows, dtype=np.float64)
    orthonormalise(made, metric, np.zeros(len(made)))
    return made
