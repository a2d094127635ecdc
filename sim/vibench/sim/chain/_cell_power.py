"""A cell under a power law, whose force acts at every p: steps of eight points within a window. SI units.

As in `vibench.sim.power_law`: over a step the force is the polynomial through its values at eight Gauss's
points, found by substitution. What the chain makes of the force is in the cell's Taylor coefficients. The
step is symmetric in time, so that without damping energy is neither made nor lost one way.
"""

import math

import numpy as np

from ..contact import ARGUMENT, DEEPEST
from ..engine import AT_END, AT_START, POINTS_AT, POWER_SHARES
from ..kernels import (
    Table,
    Vector,
    eight,
    eight_of_eight,
    eights,
    inlined,
    kernel_without_refcount,
    largest,
    store,
    total,
)
from ..power_law import power_force, power_forces, stiffest_rate
from ._cell_contact import PUSHED, SUMMARY_ONLY, log_moment, motion_in_series
from ._cell_flow import (
    MEMORY,
    MOMENT,
    MOMENTS,
    RATE,
    ROOT,
    ROOT_SCALE,
    SIDE,
    STEP,
    CellLaw,
    age_moments,
    write_aged,
)

POINTS = len(POINTS_AT)
GAIN, FORCE, ROWS = 0, POINTS, POINTS + 1
"""Rows of a memory: what the force at one point adds to p at all of them; the force there."""
_AT_POINTS: Table = np.ascontiguousarray(POWER_SHARES[:MOMENTS, :, :POINTS])
_AT_END: Table = np.ascontiguousarray(POWER_SHARES[:MOMENTS, :, POINTS])
"""Integrals of (t_i - t)^m times the polynomial that is 1 at point k alone; shape (m, k, i), (m, k)."""
FIT = 1e4
"""Allowed misfit of the force's polynomial at the ends of a step, over the tolerance: as motion that it would
make, over the size of the motion."""
MOST_SUBSTITUTIONS = 30
TRY_LONGER = 0.015
"""A step is followed by a longer one if its misfit was this part of what is allowed."""
WALL_TURN = 5.0
"""A step turns the stiffest spring on its way by this much at most, or it might pass a wall unseen [rad]."""
FADING = 0.999
"""How much of a past size of p is left after a step."""
FINER = 0.01
"""Part of what a step of `vibench.sim.power_law` may misfit: windows are short, and steps seldom shorter."""
CLOSE, CLOSEST = 1e-3, 1e-15
"""Substitution ends when p changes by this part of the tolerance, or of itself."""
LONGER, SHORTER = 2.0**0.5, 0.5
NOTHING_MOVES = 1e-150
MOST_TRIES = 200
"""Of a step, each half as long as the one before."""


@kernel_without_refcount
def begin_power(cell: Vector, series: Vector, length: float) -> None:
    """Take p and dp/dt of a cell from the chain."""
    cell[SIDE], cell[ROOT], cell[RATE] = 1.0, series[0], series[1]
    if cell[STEP] == 0.0:
        cell[STEP] = length


@kernel_without_refcount
def press_power(
    cell: Vector,
    tau: float,
    until: float,
    later: Vector,
    series: Vector,
    markov: Vector,
    law: CellLaw,
    tolerance: float,
    memory: Table,
    work: Table,
    log: Table,
) -> float:
    """Advance a cell by one step towards ``until``; gives its length, or zero where none could be made.

    Parameters
    ----------
    cell, series, markov, law, tolerance, work, log
        As in `vibench.sim.chain.press_cell`.
    tau, until
        Time now and time to stop at, since the window began [s].
    later
        p without force from now on, in powers of the time from now on.
    memory
        Shape (ROWS, POINTS).

    """
    left = until - tau
    length = min(cell[STEP], left)
    start = power_force(cell[ROOT], law.power)
    for _ in range(MOST_TRIES):
        length = _that_sees_the_wall(length, cell[ROOT], cell[RATE], markov, law)
        misfit = _try_step(cell, length, start, later, markov, law, tolerance, memory)
        if misfit <= 1.0:
            break
        length *= SHORTER
    else:
        return 0.0
    if length < left or misfit < TRY_LONGER:
        cell[STEP] = length * (LONGER if misfit < TRY_LONGER else 1.0)
    if len(log) > SUMMARY_ONLY:
        _log_points(cell, tau, length, memory, work, log)
    _take(cell, length, memory)
    p, rate = motion_in_series(cell[MEMORY:], series, markov, tau + length)
    if len(log) > 0:
        log[0, PUSHED] += length * largest(eight(memory, FORCE))
        log[0, DEEPEST] = max(log[0, DEEPEST], _highest(cell[ROOT], cell[RATE], p, rate, length))
    cell[ROOT_SCALE] = max(abs(p), FADING * cell[ROOT_SCALE])
    cell[ROOT], cell[RATE] = p, rate
    return length


@inlined
def _highest(p: float, rate: float, later: float, later_rate: float, length: float) -> float:
    """Bound abs(p) over a step: where it turns once, it stays below the tangents of both ends."""
    ends = max(abs(p), abs(later))
    if rate * later_rate >= 0.0:
        return ends
    return max(ends, min(abs(p) + length * abs(rate), abs(later) + length * abs(later_rate)))


@kernel_without_refcount
def _that_sees_the_wall(length: float, p: float, rate: float, markov: Vector, law: CellLaw) -> float:
    """Shorten a step until it turns the stiffest spring on its way by `WALL_TURN` at most."""
    outward = max(rate if p >= 0.0 else -rate, 0.0)
    for _ in range(MOST_TRIES):
        if length * stiffest_rate(abs(p) + outward * length, 0.0, markov[1], law.power) <= WALL_TURN:
            break
        length *= SHORTER
    return length


@kernel_without_refcount
def _try_step(
    cell: Vector,
    length: float,
    start: float,
    later: Vector,
    markov: Vector,
    law: CellLaw,
    tolerance: float,
    memory: Table,
) -> float:
    """Find the force at the points of a step; gives its misfit over what is allowed."""
    for k in range(POINTS):
        factor, gain = length, 0.0 * eight(_AT_POINTS[0], k)
        for m in range(1, MOMENTS):
            factor *= length / m
            gain += (-markov[m] * factor) * eight(_AT_POINTS[m], k)
        store(memory, GAIN + k, gain)
    at = length * eight(POINTS_AT, 0)
    free = eights(later[len(later) - 1])
    for k in range(len(later) - 2, -1, -1):
        free = free * at + later[k]
    weight = length * length * markov[1]
    size = max(cell[ROOT_SCALE], abs(cell[ROOT]), largest(free)) + NOTHING_MOVES
    close = size * max(CLOSE * tolerance, CLOSEST)
    force, is_settled = eights(start), False
    for _ in range(MOST_SUBSTITUTIONS):
        store(memory, FORCE, force)
        push = power_forces(free + eight_of_eight(memory, GAIN, memory[FORCE]), law.power)
        change = weight * largest(push - force)
        force = push
        if not change > close:
            is_settled = change <= close
            break
    if not is_settled:
        return math.inf
    store(memory, FORCE, force)
    end, factor = 0.0, 1.0
    for k in range(len(later) - 1, -1, -1):
        end = end * length + later[k]
    for m in range(1, MOMENTS):
        factor *= length / m
        end -= markov[m] * factor * length * total(eight(_AT_END, m) * force)
    before = total(eight(AT_START, 0) * force) - start
    after = total(eight(AT_END, 0) * force) - power_force(end, law.power)
    misfit: float = weight * max(abs(before), abs(after)) / (FINER * FIT * tolerance * size)
    return misfit


@kernel_without_refcount
def _take(cell: Vector, length: float, memory: Table) -> None:
    """Add the step's force to the moments of the window."""
    age_moments(cell, length)
    factor, force = 1.0, eight(memory, FORCE)
    for m in range(MOMENTS):
        factor *= length / max(m, 1)
        cell[MEMORY + m] += factor * total(eight(_AT_END, m) * force)


@kernel_without_refcount
def _log_points(cell: Vector, tau: float, length: float, memory: Table, work: Table, log: Table) -> None:
    """Log the motion at the points of a step."""
    node = work[ARGUMENT]
    for point in range(POINTS):
        passed, factor = length * POINTS_AT[point], 1.0
        write_aged(node, cell, tau, passed)
        for k in range(MOMENTS):
            factor *= length / max(k, 1)
            pushed = 0.0
            for i in range(POINTS):
                pushed += _AT_POINTS[k, i, point] * memory[FORCE, i]
            node[MOMENT + k] += factor * pushed
        log_moment(log, node)
