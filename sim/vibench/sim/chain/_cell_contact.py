"""A cell while its force acts: from touching a stop to leaving it, with controlled error. SI units.

The same step control, landings and ends as `vibench.sim.contact`, for the unknowns of
`vibench.sim.chain`.
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
    MOST_CORRECTIONS,
    MOST_STEPS,
    NOT_FINITE,
    RATE_FLOOR,
    ROOT_FLOOR,
    SLOWEST_TOUCH,
    STALLED,
    R,
    W,
    step_error,
    step_factor,
)
from ..flight import polynomial_at
from ..kernels import Table, Vector, inlined, kernel, kernel_without_refcount
from ._cell_flow import (
    MEMORY,
    MOMENT,
    MOMENTS,
    POINT,
    POWER,
    RATE,
    RATE_SCALE,
    ROOT,
    ROOT_SCALE,
    SIDE,
    SPARE,
    STEP,
    TRIAL,
    WIDTH,
    WORK_ROWS,
    CellLaw,
    T,
    stop_rates,
    stop_step,
)
from ._cell_power import power_cell_rates, power_cell_step, short_of_the_wall

FIRST_STEP_TOLERANCE = 1e-6
"""The tolerance for which a contact's first step is tuned; it scales with the eighth root."""


@kernel
def cell_workspace() -> Table:
    """Memory that one run (one thread) hands to every contact."""
    return np.zeros((WORK_ROWS, WIDTH))


@kernel_without_refcount
def gap_on(side: float, law: CellLaw) -> float:
    """Clearance of the stop on one side [m]."""
    return law.upper if side > 0.0 else law.lower


@kernel_without_refcount
def motion_in_series(cell: Vector, series: Vector, markov: Vector, tau: float) -> tuple[float, float]:
    """Displacement and velocity ``tau`` after the window began: the series less what the force has done."""
    value, slope = polynomial_at(series, tau)
    for k in range(1, MOMENTS):
        value -= markov[k] * cell[MEMORY + k]
        slope -= markov[k] * cell[MEMORY + k - 1]
    slope -= markov[MOMENTS] * cell[MEMORY + MOMENTS - 1]
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
    root = math.sqrt(max(side * p - gap_on(side, law), 0.0))
    rate *= side
    if root == 0.0:
        rate = max(rate, SLOWEST_TOUCH)
    hertz = 0.8 * law.contact_stiffness * markov[1]
    linear = law.linear_stiffness * markov[1]
    speed = math.sqrt(rate * rate + hertz * root**5 + linear * root**4)
    deepest = min((speed * speed / hertz) ** 0.2, math.sqrt(speed / math.sqrt(linear)))
    tuned = min(1.0, (tolerance / FIRST_STEP_TOLERANCE) ** 0.125)
    cell[SIDE], cell[ROOT], cell[RATE] = side, root, rate
    cell[ROOT_SCALE], cell[RATE_SCALE] = deepest + ROOT_FLOOR, speed + RATE_FLOOR
    cell[STEP] = tuned * min(4.8 * deepest / speed / 5.0, 0.7 / math.sqrt(0.5 * abs(acceleration) + 1e-300))


@inlined
def _begin_step(work: Table, side: float, curvature: Vector, markov: Vector, law: CellLaw) -> None:
    """Write the rates at the accepted point."""
    if law.kind == POWER:
        power_cell_rates(work[POINT], work[0], curvature, markov, law.power)
    else:
        stop_rates(work[POINT], work[0], side, curvature, markov, law)


@inlined
def _try_step(work: Table, step: float, side: float, curvature: Vector, markov: Vector, law: CellLaw) -> None:
    if law.kind == POWER:
        power_cell_step(work, step, curvature, markov, law.power)
    else:
        stop_step(work, step, side, curvature, markov, law)


@kernel_without_refcount
def _land(
    work: Table,
    longest: float,
    column: int,
    goal: float,
    close: float,
    side: float,
    curvature: Vector,
    markov: Vector,
    law: CellLaw,
) -> float:
    """Shorten the trial step, which is past it, until W falls or T rises to ``goal``; gives the step."""
    low, high, step = 0.0, longest, longest
    for _ in range(MOST_CORRECTIONS):
        off = work[TRIAL, column] - goal
        if column == W:
            slope = 0.5 * work[TRIAL, R]
            is_early, is_regular = off > 0.0, slope < 0.0
        else:
            slope = 1.0 if law.kind == POWER else work[TRIAL, W]
            is_early, is_regular = off < 0.0, slope > 0.0
        if abs(off) <= close:
            break
        if is_early:
            low = step
        else:
            high = step
        step = step - off / slope if is_regular else low
        if not low < step < high:
            step = 0.5 * (low + high)
            if not low < step < high:
                break
        _try_step(work, step, side, curvature, markov, law)
    return step


@inlined
def copy_row(to: Vector, source: Vector) -> None:
    """Copy a point of the motion."""
    for k in range(WIDTH):
        to[k] = source[k]


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
    return abs(w) if law.kind == POWER else gap_on(side, law) + w * w


@kernel_without_refcount
def _log_apex(
    log: Table, work: Table, step: float, side: float, curvature: Vector, markov: Vector, law: CellLaw
) -> None:
    """Note the largest abs(p) of the step just taken; where r turns, step to r = 0 exactly."""
    log[0, DEEPEST] = max(log[0, DEEPEST], _far(work[TRIAL, W], side, law))
    before, after = work[POINT, R], work[TRIAL, R]
    if before * after >= 0.0:
        return
    copy_row(work[SPARE], work[TRIAL])
    low, high = 0.0, step
    for _ in range(APEX_SECANTS):
        part = low + (high - low) * before / (before - after)
        _try_step(work, part, side, curvature, markov, law)
        log[0, DEEPEST] = max(log[0, DEEPEST], _far(work[TRIAL, W], side, law))
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
    if law.kind == POWER:
        return
    p, rate = motion_in_series(cell, series, markov, at[T])
    cell[MEMORY + 1] += (p - side * (gap_on(side, law) + at[W] * at[W])) / markov[1]
    p, rate = motion_in_series(cell, series, markov, at[T])
    cell[MEMORY] += (rate - side * at[R]) / markov[1]


@kernel
def press_cell(  # noqa: C901, PLR0912 - a step control and its three ends are one loop
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
    point, trial = work[POINT], work[TRIAL]
    close = 4.0 * np.finfo(np.float64).eps * limit
    _begin_step(work, side, curvature, markov, law)
    for _ in range(MOST_STEPS):
        wish = step
        if law.kind == POWER:
            step = min(short_of_the_wall(step, point, markov, law), limit - point[T])
        _try_step(work, step, side, curvature, markov, law)
        error = step_error(work, step, root_scale, rate_scale, tolerance)
        factor = step_factor(error)
        if not error <= 1.0:
            step *= min(factor, 1.0)
            if step < 1e-300:
                return NOT_FINITE, point[T]
            continue
        taken, code = step, -1
        if law.kind != POWER and trial[W] <= 0.0:
            taken = _land(work, step, W, 0.0, LANDING * root_scale, side, curvature, markov, law)
            code = LEFT
        if trial[T] >= limit - close:
            taken = _land(work, taken, T, limit, close, side, curvature, markov, law)
            trial[T] = limit
            code = HELD
        if trial[T] < point[T]:
            # Time runs backwards where w < 0: the step leapt over the exit and came back.
            step *= 0.5
            continue
        if len(log) > 0:
            _log_apex(log, work, taken, side, curvature, markov, law)
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
        _begin_step(work, side, curvature, markov, law)
        # A step that was cut by the limit says little about the next one's length.
        step = wish * factor if step == wish else max(wish, step * factor)
    _scatter(work, cell, series, markov, law)
    return STALLED, point[T]
