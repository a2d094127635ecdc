"""The motion of one pressed cell: its p alone, with the rest of the chain as a series and a memory. SI units.

Within a window the chain is linear but for the force F in the cell, so that (Duhamel)

    p(t) = series(t) - sum_k g_k I_k+1(t),    I_1 = int F dt,  I_k+1 = int I_k dt,    g_k = b.A^k.B

with g_k the Taylor coefficients (Markov parameters) of the chain's answer in p to a unit impulse in the cell.
Nothing of the chain but these few numbers enters, however long it is. With |p| = gap + w^2 and dt = w ds
every rate is a polynomial, and one step is Dormand and Prince's 8(5,3), both as in
`vibench.sim.contact`.
"""

from typing import NamedTuple

from ..contact import WORK_ROWS, R, W, rates_of
from ..flight import SERIES_TERMS
from ..kernels import Vector, inlined, kernel_without_refcount
from ..slots import PowerTerms

T = 2
MOMENT = 3
"""Unknowns (w, r, t, I_1 ... I_9): the first of the moments."""
MOMENTS = 9
"""With windows of `WINDOW_TURN` the tenth is below 0.2^9/9! = 1.4e-12 of the first."""
WIDTH = MOMENT + MOMENTS
WINDOW_TURN = 0.2
"""Longest window, as the fastest rate of chain and drive times its length [rad]."""
SIDE, ROOT, RATE, STEP, ROOT_SCALE, RATE_SCALE, MEMORY = range(7)
"""Places of a cell's row: as in `vibench.sim.slots`; from MEMORY on I_1 ... since the window
began.
"""
CELL_SIZE = MEMORY + MOMENTS
MARKOV_TERMS = MOMENTS + 2
"""g_0 ... g_10."""

CURVATURE = WORK_ROWS
"""Row of a cell's workspace after those of `vibench.sim.contact`: the free motion's second derivative."""
YIELDING, POWER = range(2)
"""How a cell's force acts: by stops that give way, or everywhere."""


class CellLaw(NamedTuple):
    """The stops of one cell as numbers; see `vibench.sim.slots.Parameters`."""

    kind: int
    """YIELDING or POWER."""
    lower: float
    upper: float
    linear_stiffness: float
    contact_stiffness: float
    loss: float
    power: PowerTerms


CURVATURE_TERMS = SERIES_TERMS - 2


@kernel_without_refcount
def fill_curvature(curvature: Vector, series: Vector) -> None:
    """Write the second derivative of a polynomial, coefficients ascending, shape (CURVATURE_TERMS,)."""
    for k in range(CURVATURE_TERMS):
        curvature[k] = (k + 2.0) * (k + 1.0) * series[k + 2]


@inlined
def acceleration_at(curvature: Vector, tau: float) -> float:
    """Sum the twelve terms in groups of four: the shortest chain of dependent multiplications."""
    c, square = curvature, tau * tau
    low = (c[0] + c[1] * tau) + square * (c[2] + c[3] * tau)
    middle = (c[4] + c[5] * tau) + square * (c[6] + c[7] * tau)
    high = (c[8] + c[9] * tau) + square * (c[10] + c[11] * tau)
    fourth = square * square
    value: float = low + fourth * (middle + fourth * high)
    return value


@inlined
def memory_force(markov: Vector, moments: Vector) -> float:
    """Sum g_k+1 I_k over the nine moments: what earlier force still takes from d2p/dt2."""
    g, m = markov, moments
    early = g[2] * m[0] + g[3] * m[1] + g[4] * m[2]
    middle = g[5] * m[3] + g[6] * m[4] + g[7] * m[5]
    value: float = early + middle + (g[8] * m[6] + g[9] * m[7] + g[10] * m[8])
    return value


class CellSystem(NamedTuple):
    """What moves p of one cell besides the free motion: its force, and the chain's answer to it."""

    markov: Vector
    """g_k of p, shape (MARKOV_TERMS,)."""
    law: CellLaw


@rates_of(CellSystem, WIDTH)
@inlined
def cell_rates(
    at: Vector, rates: Vector, side: float, curvature: Vector, middle: float, system: CellSystem
) -> None:
    """Write d/ds of the unknowns at ``at`` into ``rates``.

    ``curvature`` is d2p/dt2 without the force, in powers of (t - middle).
    """
    law, w, r = system.law, at[W], at[R]
    free = acceleration_at(curvature, at[T] - middle) - memory_force(system.markov, at[MOMENT:])
    force = side * w * w * (law.linear_stiffness + law.contact_stiffness * w) * (1.0 + law.loss * r)
    rates[W], rates[R] = 0.5 * r, w * side * (free - system.markov[1] * force)
    rates[T] = w
    rates[MOMENT] = w * force
    for k in range(MOMENT + 1, WIDTH):
        rates[k] = w * at[k - 1]


@kernel_without_refcount
def age_moments(cell: Vector, by: float) -> None:
    """Let time pass without a force: I_k+1 grows by the integral of I_k, exactly."""
    for k in range(MOMENTS - 1, 0, -1):
        share, added = 1.0, 0.0
        for back in range(1, k + 1):
            share *= by / back
            added += share * cell[MEMORY + k - back]
        cell[MEMORY + k] += added


@kernel_without_refcount
def write_aged(node: Vector, cell: Vector, tau: float, by: float) -> None:
    """Write a log's row of what a cell's moments would be ``by`` after ``tau`` without a force in between."""
    node[W], node[R], node[T] = 0.0, 0.0, tau + by
    for k in range(MOMENTS):
        share = 1.0
        node[MOMENT + k] = cell[MEMORY + k]
        for back in range(1, k + 1):
            share *= by / back
            node[MOMENT + k] += share * cell[MEMORY + k - back]
