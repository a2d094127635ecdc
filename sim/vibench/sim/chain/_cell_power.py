"""A cell under a power law: its force acts at every p, so that its own time is time itself. SI units.

The unknowns are those of `vibench.sim.chain` with p and dp/dt in the places of w and r. The step
is the same, from the table of its coefficients.
"""

import math

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as _dop

from ..contact import STAGES, R, W
from ..kernels import Table, Vector, kernel_without_refcount
from ..power_law import MOST_SHORTENINGS, SHORTENING, WALL_TURN, power_force
from ..slots import PowerTerms
from ._cell_flow import (
    ARGUMENT,
    MOMENT,
    POINT,
    RATE,
    RATE_SCALE,
    ROOT,
    ROOT_SCALE,
    SIDE,
    STEP,
    TRIAL,
    WIDTH,
    CellLaw,
    T,
    acceleration_at,
    memory_force,
)

STEP_TABLE = np.ascontiguousarray(_dop.A[:STAGES, :STAGES], dtype=np.float64)
STEP_WEIGHTS = np.ascontiguousarray(_dop.B[:STAGES], dtype=np.float64)
FIRST_PART = 0.05
"""First step, as a part of the window."""
FADING = 0.999
"""How much of a past size is left after a window."""


@kernel_without_refcount
def power_cell_rates(at: Vector, rates: Vector, curvature: Vector, markov: Vector, power: PowerTerms) -> None:
    """Write d/dt of the unknowns at ``at`` into ``rates``."""
    force = power_force(at[W], power)
    taken = markov[1] * force + memory_force(markov, at[MOMENT:])
    rates[W] = at[R]
    rates[R] = acceleration_at(curvature, at[T]) - taken
    rates[T] = 1.0
    rates[MOMENT] = force
    for k in range(MOMENT + 1, WIDTH):
        rates[k] = at[k - 1]


@kernel_without_refcount
def power_cell_step(  # noqa: C901 - stages, terms and unknowns are three loops
    work: Table, step: float, curvature: Vector, markov: Vector, power: PowerTerms
) -> None:
    """Step from ``work[POINT]``, whose rates are in ``work[0]``, and write the end to ``work[TRIAL]``."""
    argument, point, end = work[ARGUMENT], work[POINT], work[TRIAL]
    for stage in range(1, STAGES):
        for i in range(WIDTH):
            argument[i] = 0.0
        for before in range(stage):
            weight = STEP_TABLE[stage, before]
            if weight != 0.0:
                for i in range(WIDTH):
                    argument[i] += weight * work[before, i]
        for i in range(WIDTH):
            argument[i] = point[i] + step * argument[i]
        power_cell_rates(argument, work[stage], curvature, markov, power)
    for i in range(WIDTH):
        end[i] = 0.0
    for stage in range(STAGES):
        for i in range(WIDTH):
            end[i] += STEP_WEIGHTS[stage] * work[stage, i]
    for i in range(WIDTH):
        end[i] = point[i] + step * end[i]


@kernel_without_refcount
def begin_power(cell: Vector, series: Vector, markov: Vector, law: CellLaw, length: float) -> None:
    """Take p and dp/dt of a cell under a power law from the chain, and the sizes that errors are held to."""
    p, rate = series[0], series[1]
    secant = power_force(p, law.power) / p if p != 0.0 else 0.0
    turn = math.sqrt(max(secant * markov[1], 1.0 / (length * length)))
    cell[SIDE], cell[ROOT], cell[RATE] = 1.0, p, rate
    cell[ROOT_SCALE] = max(abs(p) + abs(rate) / turn, FADING * cell[ROOT_SCALE])
    cell[RATE_SCALE] = max(abs(rate) + abs(p) * turn, FADING * cell[RATE_SCALE])
    if cell[STEP] == 0.0:
        cell[STEP] = FIRST_PART * length


@kernel_without_refcount
def short_of_the_wall(step: float, at: Vector, markov: Vector, law: CellLaw) -> float:
    """Shorten a step until it turns the steepest spring on its way by little: see
    `vibench.sim.power_law`.
    """
    exponent = 1
    for half in law.power.halves:
        exponent += 2 * half
    outward = at[R] if at[W] >= 0.0 else -at[R]
    for _ in range(MOST_SHORTENINGS):
        reach = abs(at[W]) + max(outward, 0.0) * step
        secant = power_force(reach, law.power) / reach if reach > 0.0 else 0.0
        if step * math.sqrt(exponent * secant * markov[1]) <= WALL_TURN:
            break
        step *= SHORTENING
    return step
