"""The numbers of one step under a power law, for any length of it. SI units.

The motion is the eight numbers u of `vibench.sim.flight`, linear but for the law's force F.
Over a step F is a polynomial through its values F_k at Gauss's points c_i, so that all that follows is
linear in what the step begins with, u, and in F:

    p(c_i h) = free_i u + sum_k gain_ik F_k,      u(h) = u + move u + sum_k feed_k F_k

(collocation at Gauss's points, exact for the linear part: Hairer, Lubich and Wanner, Geometric Numerical
Integration, 2nd ed. 2006, section II.1.3). The Taylor series of exp(A h) gives every table: it converges to
rounding for the lengths that are used, needs no modes, and loses nothing where a step is short.
"""

from typing import NamedTuple

from ..flight import WIDE, P
from ..kernels import Table, Vector, eight, inlined, kernel_without_refcount, store

POINTS = 8
"""Gauss's points in a step. With ten a step costs half as much again and is a tenth longer."""
FREE, GAIN, MOVE, FEED, INNER = 0, 8, 16, 24, 32
"""First rows of the tables, each of eight rows with eight places; of the last there are two for each point:
what u and F make of the motion there."""
END_ROWS, ALL_ROWS = 32, 32 + 16 * POINTS


class StepSeries(NamedTuple):
    """What the numbers of a step of any length are made of."""

    fastest: float
    """Largest rate of the modes and the drive [1/s], to which lengths are relative."""
    powers: Table
    """Shape (order, j, i): what the j-th number of the motion adds to the i-th, (A / fastest)^m / m!."""
    struck: Table
    """Shape (order, i): the same of a unit of F [1/N]."""
    shares: Table
    """Shape (order, k, i): integral up to c_i of (c_i - s)^m times what is 1 at point k alone."""
    ends: Table
    """Shape (order, k): the same up to the step's end."""
    heights: Table
    """Shape (order, i): c_i^m."""


@inlined
def _add_row(numbers: Table, row: int, factor: float, table: Table, term: int) -> None:
    store(numbers, row, eight(numbers, row) + factor * eight(table, term))


@inlined
def _clear(numbers: Table, first: int, last: int) -> None:
    for row in range(first, last):
        for i in range(WIDE):
            numbers[row, i] = 0.0


@kernel_without_refcount
def fill_ends(numbers: Table, length: float, series: StepSeries) -> None:
    """Write what is needed to make a step of ``length`` [s]."""
    _clear(numbers, 0, END_ROWS)
    factor = 1.0
    for term in range(len(series.powers)):
        powers, shares, struck = series.powers[term], series.shares[term], series.struck
        for j in range(WIDE):
            _add_row(numbers, FREE + j, powers[j, P] * factor, series.heights, term)
            if term > 0:
                _add_row(numbers, MOVE + j, factor, powers, j)
            _add_row(numbers, FEED + j, factor * length * series.ends[term, j], struck, term)
            _add_row(numbers, GAIN + j, struck[term, P] * factor * length, shares, j)
        factor *= series.fastest * length


@kernel_without_refcount
def fill_inner(numbers: Table, length: float, series: StepSeries) -> None:
    """Write what is needed to know the whole motion at the points of a step."""
    _clear(numbers, END_ROWS, ALL_ROWS)
    for i in range(POINTS):
        factor, first = 1.0, INNER + 2 * WIDE * i
        for term in range(len(series.powers)):
            height, shares = factor * series.heights[term, i], series.shares[term]
            for j in range(WIDE):
                _add_row(numbers, first + j, height, series.powers[term], j)
                _add_row(numbers, first + WIDE + j, factor * length * shares[j, i], series.struck, term)
            factor *= series.fastest * length


@kernel_without_refcount
def fill_levels(levels: Table, lengths: Vector, series: StepSeries) -> None:
    """Write the numbers of steps of all ``lengths``, shape (levels, ALL_ROWS, WIDE)."""
    for level in range(len(lengths)):
        fill_ends(levels[level], lengths[level], series)
        fill_inner(levels[level], lengths[level], series)
