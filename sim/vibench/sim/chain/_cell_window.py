"""One cell through one window: flight, contact, flight, ... and nothing else of the chain. SI units."""

from ..contact import ARGUMENT, DEEPEST, HELD, LEFT, LOGGED, NOT_FINITE, R, W
from ..flight import NEVER, SERIES_TERMS, first_contact, touched_side
from ..kernels import Table, Vector, kernel_without_refcount
from ..model import Outcome
from ._cell_contact import begin_pressing, log_moment, motion_in_series, press_cell
from ._cell_flow import (
    CURVATURE,
    MEMORY,
    MOMENT,
    MOMENTS,
    RATE,
    SIDE,
    CellLaw,
    T,
    acceleration_at,
    fill_curvature,
    memory_force,
)

CROSSED = int(Outcome.REACHED_END)
CHATTERS = int(Outcome.TOO_MANY_IMPACTS)
LOST = int(Outcome.NOT_FINITE)
STUCK = int(Outcome.STALLED)

MOST_TOUCHES = 1000
"""In one window, which is a small part of the shortest period of the chain."""
LOG_ROWS = 512
COUNT = 0
"""Place 0 of a list of touches: how many follow."""


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
def fill_later_series(later: Vector, series: Vector, cell: Vector, markov: Vector, tau: float) -> None:
    """Write p as a polynomial in the time since ``tau``, without a force from then on."""
    for k in range(SERIES_TERMS):
        later[k] = series[k]
    if tau > 0.0:
        for low in range(SERIES_TERMS - 1):
            for k in range(SERIES_TERMS - 2, low - 1, -1):
                later[k] += tau * later[k + 1]
    inverse_factorial = 1.0
    for n in range(MOMENTS + 1):
        if n > 0:
            inverse_factorial /= n
        done = 0.0
        # The n-th derivative of I_k+1 is I_k+1-n.
        for k in range(max(n, 1), min(MOMENTS + n, MOMENTS + 1)):
            done += markov[k] * cell[MEMORY + k - n]
        later[n] -= inverse_factorial * done


@kernel_without_refcount
def curvature_bound(series: Vector, length: float) -> float:
    """Bound of the second derivative of a polynomial on [0, length]."""
    bound = 0.0
    for k in range(SERIES_TERMS - 1, 1, -1):
        bound = bound * length + k * (k - 1.0) * abs(series[k])
    return bound


@kernel_without_refcount
def _log_now(log: Table, work: Table, cell: Vector, tau: float) -> None:
    if len(log) > 0:
        node = work[ARGUMENT]
        node[W], node[R], node[T] = 0.0, cell[RATE], tau
        for k in range(MOMENTS):
            node[MOMENT + k] = cell[MEMORY + k]
        log_moment(log, node)


@kernel_without_refcount
def cross_window(
    cell: Vector,
    start: float,
    until: float,
    series: Vector,
    markov: Vector,
    reach: float,
    law: CellLaw,
    tolerance: float,
    later: Vector,
    work: Table,
    touches: Vector,
    log: Table,
) -> int:
    """Advance a cell from ``start`` to ``until``, both since the window began; returns an `Outcome` code.

    Parameters
    ----------
    cell
        Its row, in and out; its moments count from the window's beginning.
    series, markov
        As in `vibench.sim.chain.press_cell`.
    reach
        Size of the terms that p was summed from [m]: its rounding decides what is a touch.
    later, work
        Memory: shape (SERIES_TERMS,), and from `cell_workspace`.
    touches
        Their times are added, shape (MOST_TOUCHES + 1,).
    log
        Filled with the instants between which the motion is smooth; no rows keep nothing.

    """
    tau, curvature = start, work[CURVATURE]
    fill_curvature(curvature, series)
    if len(log) > 0:
        log[0, LOGGED] = log[0, DEEPEST] = 0.0
        _log_now(log, work, cell, tau)
    while tau < until:
        if cell[SIDE] != 0.0:
            code, tau = press_cell(cell, tau, until, series, curvature, markov, law, tolerance, work, log)
            if code == NOT_FINITE:
                return LOST
            if code not in (LEFT, HELD):
                return STUCK
            continue
        fill_later_series(later, series, cell, markov, tau)
        bound = curvature_bound(later, until - tau)
        touch = first_contact(later, until - tau, law.lower, law.upper, bound, reach)
        if touch == NEVER:
            age_moments(cell, until - tau)
            tau = until
            _log_now(log, work, cell, tau)
            break
        age_moments(cell, touch)
        tau += touch
        if int(touches[COUNT]) + 1 == len(touches):
            return CHATTERS
        touches[COUNT] += 1.0
        touches[int(touches[COUNT])] = tau
        p, rate = motion_in_series(cell[MEMORY:], series, markov, tau)
        side = touched_side(p, rate, law.lower, law.upper)
        acceleration = acceleration_at(curvature, tau) - memory_force(markov, cell[MEMORY:])
        begin_pressing(cell, side, p, rate, acceleration, markov, law, tolerance)
        _log_now(log, work, cell, tau)
    return CROSSED if len(log) == 0 or log[0, LOGGED] + 1 < len(log) else STUCK
