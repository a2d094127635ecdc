"""The motion of one pressed cell: its p alone, with the rest of the chain as a series and a memory. SI units.

Within a window the chain is linear but for the force F in the cell, so that (Duhamel)

    p(t) = series(t) - sum_k g_k I_k+1(t),    I_1 = int F dt,  I_k+1 = int I_k dt,    g_k = b.A^k.B

with g_k the Taylor coefficients (Markov parameters) of the chain's answer in p to a unit impulse in the cell.
Nothing of the chain but these few numbers enters, however long it is. With |p| = gap + w^2 and dt = w ds
every rate is a polynomial, and one step is Dormand and Prince's 8(5,3), both as in
`vibench.sim.contact`.
"""

from typing import NamedTuple

from ..contact import (
    A21,
    A31,
    A32,
    A41,
    A43,
    A51,
    A53,
    A54,
    A61,
    A64,
    A65,
    A71,
    A74,
    A75,
    A76,
    A81,
    A84,
    A85,
    A86,
    A87,
    A91,
    A94,
    A95,
    A96,
    A97,
    A98,
    A101,
    A104,
    A105,
    A106,
    A107,
    A108,
    A109,
    A111,
    A114,
    A115,
    A116,
    A117,
    A118,
    A119,
    A121,
    A124,
    A125,
    A126,
    A127,
    A128,
    A129,
    A1110,
    A1210,
    A1211,
    B1,
    B6,
    B7,
    B8,
    B9,
    B10,
    B11,
    B12,
    STAGES,
    R,
    W,
)
from ..flight import SERIES_TERMS
from ..kernels import Table, Vector, inlined, kernel_without_refcount
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

WORK_ROWS = STAGES + 5
ARGUMENT, POINT, TRIAL, SPARE, CURVATURE = range(STAGES, WORK_ROWS)
"""Rows of a workspace after the stages, as in `vibench.sim.contact`; the last is a curvature
long.
"""
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


@inlined
def stop_rates(
    at: Vector, rates: Vector, side: float, curvature: Vector, markov: Vector, law: CellLaw
) -> None:
    """Write d/ds of the unknowns at ``at`` into ``rates``; ``curvature`` is d2p/dt2 without the force."""
    w, r = at[W], at[R]
    force = side * w * w * (law.linear_stiffness + law.contact_stiffness * w) * (1.0 + law.loss * r)
    taken = markov[1] * force + memory_force(markov, at[MOMENT:])
    rates[W] = 0.5 * r
    rates[R] = w * side * (acceleration_at(curvature, at[T]) - taken)
    rates[T] = w
    rates[MOMENT] = w * force
    for k in range(MOMENT + 1, WIDTH):
        rates[k] = w * at[k - 1]


@kernel_without_refcount
def stop_step(  # noqa: C901 - the twelve stages of one formula, in order
    work: Table, step: float, side: float, curvature: Vector, markov: Vector, law: CellLaw
) -> None:
    """Step from ``work[POINT]``, whose rates are in ``work[0]``, and write the end to ``work[TRIAL]``."""
    h = step
    k1, k2, k3, k4, k5, k6 = work[0], work[1], work[2], work[3], work[4], work[5]
    k7, k8, k9, k10, k11, k12 = work[6], work[7], work[8], work[9], work[10], work[11]
    u, y, end = work[ARGUMENT], work[POINT], work[TRIAL]
    for i in range(WIDTH):
        u[i] = y[i] + h * (A21 * k1[i])
    stop_rates(u, k2, side, curvature, markov, law)
    for i in range(WIDTH):
        u[i] = y[i] + h * (A31 * k1[i] + A32 * k2[i])
    stop_rates(u, k3, side, curvature, markov, law)
    for i in range(WIDTH):
        u[i] = y[i] + h * (A41 * k1[i] + A43 * k3[i])
    stop_rates(u, k4, side, curvature, markov, law)
    for i in range(WIDTH):
        u[i] = y[i] + h * (A51 * k1[i] + A53 * k3[i] + A54 * k4[i])
    stop_rates(u, k5, side, curvature, markov, law)
    for i in range(WIDTH):
        u[i] = y[i] + h * (A61 * k1[i] + A64 * k4[i] + A65 * k5[i])
    stop_rates(u, k6, side, curvature, markov, law)
    for i in range(WIDTH):
        u[i] = y[i] + h * (A71 * k1[i] + A74 * k4[i] + A75 * k5[i] + A76 * k6[i])
    stop_rates(u, k7, side, curvature, markov, law)
    for i in range(WIDTH):
        u[i] = y[i] + h * (A81 * k1[i] + A84 * k4[i] + A85 * k5[i] + A86 * k6[i] + A87 * k7[i])
    stop_rates(u, k8, side, curvature, markov, law)
    for i in range(WIDTH):
        early = A91 * k1[i] + A94 * k4[i] + A95 * k5[i]
        u[i] = y[i] + h * (early + A96 * k6[i] + A97 * k7[i] + A98 * k8[i])
    stop_rates(u, k9, side, curvature, markov, law)
    for i in range(WIDTH):
        early = A101 * k1[i] + A104 * k4[i] + A105 * k5[i] + A106 * k6[i]
        u[i] = y[i] + h * (early + A107 * k7[i] + A108 * k8[i] + A109 * k9[i])
    stop_rates(u, k10, side, curvature, markov, law)
    for i in range(WIDTH):
        early = A111 * k1[i] + A114 * k4[i] + A115 * k5[i] + A116 * k6[i]
        u[i] = y[i] + h * (early + A117 * k7[i] + A118 * k8[i] + A119 * k9[i] + A1110 * k10[i])
    stop_rates(u, k11, side, curvature, markov, law)
    for i in range(WIDTH):
        early = A121 * k1[i] + A124 * k4[i] + A125 * k5[i] + A126 * k6[i] + A127 * k7[i]
        u[i] = y[i] + h * (early + A128 * k8[i] + A129 * k9[i] + A1210 * k10[i] + A1211 * k11[i])
    stop_rates(u, k12, side, curvature, markov, law)
    for i in range(WIDTH):
        early = B1 * k1[i] + B6 * k6[i] + B7 * k7[i] + B8 * k8[i]
        end[i] = y[i] + h * (early + B9 * k9[i] + B10 * k10[i] + B11 * k11[i] + B12 * k12[i])
