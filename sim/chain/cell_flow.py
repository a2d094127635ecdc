"""The motion of one pressed cell: its p alone, with the rest of the chain as a series and a memory. SI units.

Within a window the chain is linear but for the force F in the cell, so that (Duhamel)

    p(t) = series(t) - sum_k g_k I_k+1(t),    I_1 = int F dt,  I_k+1 = int I_k dt,    g_k = b.A^k.B

with g_k the Taylor coefficients (Markov parameters) of the chain's answer in p to a unit impulse in the cell.
Nothing of the chain but these few numbers enters, however long it is. With |p| = gap + w^2 and dt = w ds
every rate is a polynomial, as in `sim.contact_flow`; under a power law w stands for p, and s is time. One step
is Dormand and Prince's 8(5,3), from the table.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as _dop

from ..compiled import compiled
from ..contact_flow import STAGES, R, W
from ..parameters import POWER, PowerTerms, Table, Vector
from ..power_flow import power_force

T = 2
MOMENT = 3
"""Unknowns (w, r, t, I_1 ... I_9): the first of the moments."""
MOMENTS = 9
"""With windows of `WINDOW_TURN` the tenth is below 0.2^9/9! = 1.4e-12 of the first."""
WIDTH = MOMENT + MOMENTS
WINDOW_TURN = 0.2
"""Longest window, as the fastest rate of chain and drive times its length [rad]."""
MARKOV_TERMS = MOMENTS + 2
"""g_0 ... g_10."""

WORK_ROWS = STAGES + 4
ARGUMENT, POINT, TRIAL, SPARE = range(STAGES, WORK_ROWS)
"""Rows of a workspace after the stages, as in `sim.contact_flow`."""
STEP_TABLE = np.ascontiguousarray(_dop.A[:STAGES, :STAGES], dtype=np.float64)
STEP_WEIGHTS = np.ascontiguousarray(_dop.B[:STAGES], dtype=np.float64)


class CellLaw(NamedTuple):
    """The stops of one cell as numbers; see `sim.parameters.Parameters`."""

    kind: int
    """YIELDING or POWER."""
    lower: float
    upper: float
    linear_stiffness: float
    contact_stiffness: float
    loss: float
    power: PowerTerms


@compiled
def acceleration_at(series: Vector, tau: float) -> float:
    """Second derivative of a polynomial, coefficients ascending."""
    value = 0.0
    for k in range(len(series) - 1, 1, -1):
        value = value * tau + k * (k - 1.0) * series[k]
    return value


@compiled
def cell_rates(at: Vector, rates: Vector, side: float, series: Vector, markov: Vector, law: CellLaw) -> None:
    """Write d/ds of the unknowns at ``at`` into ``rates``; ``series`` is p without the cell's force."""
    w, r = at[W], at[R]
    if law.kind == POWER:
        force, weight = power_force(w, law.power), 1.0
        rates[W] = r
    else:
        force = side * w * w * (law.linear_stiffness + law.contact_stiffness * w) * (1.0 + law.loss * r)
        weight = w
        rates[W] = 0.5 * r
    memory = markov[1] * force
    for k in range(MOMENTS):
        memory += markov[k + 2] * at[MOMENT + k]
    rates[R] = weight * side * (acceleration_at(series, at[T]) - memory)
    rates[T] = weight
    rates[MOMENT] = weight * force
    for k in range(MOMENT + 1, WIDTH):
        rates[k] = weight * at[k - 1]


@compiled
def cell_step(work: Table, step: float, side: float, series: Vector, markov: Vector, law: CellLaw) -> None:
    """Step from ``work[POINT]``, whose rates are in ``work[0]``, and write the end to ``work[TRIAL]``."""
    argument, point, end = work[ARGUMENT], work[POINT], work[TRIAL]
    for stage in range(1, STAGES):
        argument[:] = 0.0
        for before in range(stage):
            weight = STEP_TABLE[stage, before]
            if weight != 0.0:
                for i in range(WIDTH):
                    argument[i] += weight * work[before, i]
        for i in range(WIDTH):
            argument[i] = point[i] + step * argument[i]
        cell_rates(argument, work[stage], side, series, markov, law)
    end[:] = 0.0
    for stage in range(STAGES):
        for i in range(WIDTH):
            end[i] += STEP_WEIGHTS[stage] * work[stage, i]
    for i in range(WIDTH):
        end[i] = point[i] + step * end[i]
