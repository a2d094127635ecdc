"""A cell while its force acts: from touching a stop to leaving it, with controlled error. SI units.

Steps, landings and errors are those of `vibench.sim.contact`, for the unknowns of a cell.
"""

import math

import numpy as np

from ..contact import (
    APEX_SECANTS,
    DEEPEST,
    HELD,
    LANDING,
    LEFT,
    LOGGED,
    MOST_STEPS,
    NEAR,
    NOT_FINITE,
    POINT,
    RATE_FLOOR,
    ROOT_FLOOR,
    SLOWEST_TOUCH,
    SPARE,
    STALLED,
    TRIAL,
    R,
    W,
    foreseen_collision,
    gap_of,
    step_error,
    step_factor,
    step_to_exit,
    step_to_time,
    trial_step,
)
from ..flight import polynomial_at
from ..kernels import Table, Vector, copy_row, kernel, kernel_without_refcount
from ._cell_flow import (
    CURVATURE,
    MEMORY,
    MOMENT,
    MOMENTS,
    RATE,
    RATE_SCALE,
    ROOT,
    ROOT_SCALE,
    SIDE,
    STEP,
    WIDTH,
    CellLaw,
    CellSystem,
    T,
    cell_rates,
)

CARE = 1e-4
"""Part of the tolerance that a step may use. Errors of steps take energy and do not give it, so that they add
up from contact to contact; those of whole collisions do not. Here they are below what is left of those."""
FINEST = 1e-11
PUSHED, SO_FAR = 3, 4
"""Places of a log's first row, after those of `vibench.sim.contact`: the variation of I_1 in the window, and
its last value.
"""
SUMMARY_ONLY = 1
"""Rows of a log that keeps its first row alone."""
FIRST_STEP_TOLERANCE = 1e-6
"""The tolerance for which a contact's first step is tuned; it scales with the eighth root."""


@kernel
def cell_workspace() -> Table:
    """Memory that one run (one thread) hands to every contact."""
    return np.zeros((CURVATURE + 1, WIDTH))


@kernel_without_refcount
def motion_in_series(moments: Vector, series: Vector, markov: Vector, tau: float) -> tuple[float, float]:
    """Displacement and velocity ``tau`` after the window began: the series less what the force has done."""
    value, slope = polynomial_at(series, tau)
    for k in range(1, MOMENTS):
        value -= markov[k] * moments[k]
        slope -= markov[k] * moments[k - 1]
    slope -= markov[MOMENTS] * moments[MOMENTS - 1]
    return value, slope


@kernel_without_refcount
def begin_pressing(
    cell: Vector,
    side: float,
    p: float,
    rate: float,
    acceleration: float,
    markov: Vector,
    law: CellLaw,
    tolerance: float,
) -> None:
    """Enter contact at any penetration; ``acceleration`` is that of p without the stop, times side.

    The first step resolves the elastic collision or a slow pressing, whichever is faster: see
    `vibench.sim.contact.begin_contact`.
    """
    root = math.sqrt(max(side * p - gap_of(side, law.lower, law.upper), 0.0))
    rate *= side
    if root == 0.0:
        rate = max(rate, SLOWEST_TOUCH)
    speed, deepest = foreseen_collision(
        root, rate, law.linear_stiffness * markov[1], law.contact_stiffness * markov[1]
    )
    tuned = min(1.0, (tolerance / FIRST_STEP_TOLERANCE) ** 0.125)
    cell[SIDE], cell[ROOT], cell[RATE] = side, root, rate
    cell[ROOT_SCALE], cell[RATE_SCALE] = deepest + ROOT_FLOOR, speed + RATE_FLOOR
    cell[STEP] = tuned * min(4.8 * deepest / speed / 5.0, 0.7 / math.sqrt(0.5 * abs(acceleration) + 1e-300))


@kernel_without_refcount
def log_moment(log: Table, at: Vector) -> None:
    """Add a point of the motion as the log's next row, if there is room."""
    row = int(log[0, LOGGED]) + 1
    if row < len(log):
        copy_row(log[row], at)
        log[0, LOGGED] = row


@kernel_without_refcount
def _far(w: float, side: float, law: CellLaw) -> float:
    """abs(p) of a pressed cell [m]."""
    return gap_of(side, law.lower, law.upper) + w * w


@kernel_without_refcount
def _log_apex(
    log: Table, work: Table, step: float, side: float, curvature: Vector, system: CellSystem
) -> None:
    """Note the largest abs(p) of the step just taken; where r turns, step to r = 0 exactly."""
    log[0, DEEPEST] = max(log[0, DEEPEST], _far(work[TRIAL, W], side, system.law))
    before, after = work[POINT, R], work[TRIAL, R]
    # While r falls w stays below the tangents of both ends, of slope r/2.
    highest = min(work[POINT, W] + 0.5 * step * abs(before), work[TRIAL, W] + 0.5 * step * abs(after))
    if before * after >= 0.0 or _far(highest, side, system.law) <= log[0, DEEPEST]:
        return
    copy_row(work[SPARE], work[TRIAL])
    low, high = 0.0, step
    for _ in range(APEX_SECANTS):
        part = low + (high - low) * before / (before - after)
        trial_step(work, part, side, curvature, 0.0, system)
        log[0, DEEPEST] = max(log[0, DEEPEST], _far(work[TRIAL, W], side, system.law))
        if work[TRIAL, R] * before > 0.0:
            low, before = part, work[TRIAL, R]
        else:
            high, after = part, work[TRIAL, R]
    copy_row(work[TRIAL], work[SPARE])


@kernel_without_refcount
def _gather(work: Table, cell: Vector, tau: float) -> None:
    at = work[POINT]
    at[W], at[R], at[T] = cell[ROOT], cell[RATE], tau
    for k in range(MOMENTS):
        at[MOMENT + k] = cell[MEMORY + k]


@kernel_without_refcount
def _scatter(work: Table, cell: Vector, series: Vector, markov: Vector, law: CellLaw) -> None:
    """Hand back the point reached; the first two moments become those that lead to its p and dp/dt exactly.

    So the chain, which will only hear of the moments, agrees with the cell to rounding at every window's end.
    """
    at, side = work[POINT], cell[SIDE]
    cell[ROOT], cell[RATE] = at[W], at[R]
    for k in range(MOMENTS):
        cell[MEMORY + k] = at[MOMENT + k]
    p, rate = motion_in_series(cell[MEMORY:], series, markov, at[T])
    cell[MEMORY + 1] += (p - side * (gap_of(side, law.lower, law.upper) + at[W] * at[W])) / markov[1]
    p, rate = motion_in_series(cell[MEMORY:], series, markov, at[T])
    cell[MEMORY] += (rate - side * at[R]) / markov[1]


@kernel
def press_cell(  # noqa: C901 - a step control and its three ends are one loop
    cell: Vector,
    tau: float,
    limit: float,
    series: Vector,
    curvature: Vector,
    markov: Vector,
    law: CellLaw,
    tolerance: float,
    work: Table,
    log: Table,
) -> tuple[int, float]:
    """Advance a pressed cell until it leaves the stop or the window's time reaches ``limit``.

    Parameters
    ----------
    cell
        Its row, in and out; ``cell[SIDE]`` is back at 0 when the stop was left.
    tau, limit
        Time now and time to stop at, since the window began [s].
    series
        p(t) without the force of this cell since the window began, shape (SERIES_TERMS,).
    curvature
        Its second derivative, shape (CURVATURE_TERMS,).
    markov
        g_k of p, shape (MARKOV_TERMS,).
    law, tolerance, work
        Relative error allowed in a step, on w and r; memory from `cell_workspace`.
    log
        Rows of `WIDTH`, filled with the accepted steps below a first row of LOGGED and DEEPEST; none: no log.

    Returns
    -------
    LEFT, HELD, NOT_FINITE or STALLED, and the time reached.

    """
    side, step = cell[SIDE], cell[STEP]
    root_scale, rate_scale = cell[ROOT_SCALE], cell[RATE_SCALE]
    if tau >= limit:
        return HELD, tau
    _gather(work, cell, tau)
    point, trial, system = work[POINT], work[TRIAL], CellSystem(markov, law)
    tolerance = min(tolerance, max(CARE * tolerance, FINEST))
    near = NEAR * math.sqrt(tolerance)
    cell_rates(point, work[0], side, curvature, 0.0, system)
    for _ in range(MOST_STEPS):
        wish = step
        trial_step(work, step, side, curvature, 0.0, system)
        error = step_error(work, step, root_scale, rate_scale, tolerance)
        factor = step_factor(error)
        if not error <= 1.0:
            step *= min(factor, 1.0)
            if step < 1e-300:
                return NOT_FINITE, point[T]
            continue
        taken, code = step, -1
        if trial[W] <= 0.0:
            close = LANDING * root_scale
            taken = step_to_exit(work, step, side, curvature, 0.0, system, close, near * point[W])
            code = LEFT
        if trial[T] >= limit:
            taken = step_to_time(work, taken, T, limit, side, curvature, 0.0, system)
            code = HELD
        if trial[T] < point[T]:
            # Time runs backwards where w < 0: the step leapt over the exit and came back.
            step *= 0.5
            continue
        if len(log) > 0:
            _log_apex(log, work, taken, side, curvature, system)
        copy_row(point, trial)
        if code == LEFT:
            point[W] = 0.0
        if len(log) > 0:
            log_moment(log, point)
        if code >= 0:
            _scatter(work, cell, series, markov, law)
            cell[STEP] = wish
            if code == LEFT:
                cell[SIDE] = 0.0
            return code, point[T]
        cell_rates(point, work[0], side, curvature, 0.0, system)
        # A step that was cut by the limit says little about the next one's length.
        step = wish * factor if step == wish else max(wish, step * factor)
    _scatter(work, cell, series, markov, law)
    return STALLED, point[T]
