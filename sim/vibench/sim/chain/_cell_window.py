"""One cell through one window: flight, contact, flight, ... and nothing else of the chain. SI units."""

from ..collision import FRESH, LEAST_TOLERANCE, LONGEST, Collision, CollisionTables
from ..contact import (
    ARGUMENT,
    HELD,
    LEFT,
    LOGGED,
    NOT_FINITE,
    SLOWEST_TOUCH,
    R,
    W,
    foreseen_collision,
)
from ..flight import NEVER, SERIES_TERMS, first_contact, polynomial_at, touched_side
from ..kernels import Table, Vector, inlined, kernel_without_refcount
from ..model import Outcome
from ._cell_collision import collide_cell, is_hertz
from ._cell_contact import (
    PUSHED,
    SO_FAR,
    SUMMARY_ONLY,
    begin_pressing,
    log_moment,
    motion_in_series,
    press_cell,
)
from ._cell_flow import (
    CURVATURE,
    MEMORY,
    MOMENT,
    MOMENTS,
    POWER,
    RATE,
    ROOT,
    ROOT_SCALE,
    SIDE,
    CellLaw,
    T,
    acceleration_at,
    age_moments,
    fill_curvature,
    memory_force,
)
from ._cell_power import press_power

CROSSED = int(Outcome.REACHED_END)
CHATTERS = int(Outcome.TOO_MANY_IMPACTS)
LOST = int(Outcome.NOT_FINITE)
STUCK = int(Outcome.STALLED)

MOST_TOUCHES = 1000
"""In one window, which is a small part of the shortest period of the chain."""
LOG_ROWS = 512
CUT = -1
"""Instead of an `Outcome`: the window is to end at a touch, so that its collision is whole in the next."""
SOON = 1e-3
"""Part of a window at whose begin a touch may as well be."""
ROUNDED = 1e-14
"""Part of a window that is lost where its steps are added up."""
HAIR = 1e-12
"""Part of a window before whose end a touch is left to the next as it is."""
COUNT = 0
"""Place 0 of a list of touches: how many follow."""


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
        log[0, PUSHED] += abs(cell[MEMORY] - log[0, SO_FAR])
        log[0, SO_FAR] = cell[MEMORY]
    if len(log) > SUMMARY_ONLY:
        node = work[ARGUMENT]
        node[W], node[R], node[T] = 0.0, cell[RATE], tau
        for k in range(MOMENTS):
            node[MOMENT + k] = cell[MEMORY + k]
        log_moment(log, node)


@inlined
def _ends_too_late(
    series: Vector,
    touch: float,
    tau: float,
    until: float,
    markov: Vector,
    law: CellLaw,
    tolerance: float,
) -> bool:
    """Say whether a collision that begins now would be whole in a window of its own, but not in this one."""
    if tolerance < LEAST_TOLERANCE or not SOON * until < tau < until * (1.0 - HAIR):
        return False
    _, rate = polynomial_at(series, touch)
    speed = max(abs(rate), SLOWEST_TOUCH)
    _, root = foreseen_collision(0.0, speed, 0.0, law.contact_stiffness * markov[1])
    lasts = LONGEST * root * root / speed
    return until - tau <= lasts < until


@kernel_without_refcount
def cross_window(  # noqa: C901, PLR0912 - flight, touch and the three ways through a contact are one loop
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
    collision: Collision,
    collisions: CollisionTables,
    struck: Table,
    power: Table,
    cuts: int,
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
        Filled with the instants between which the motion is smooth; one row sums up, no rows keep nothing.
        DEEPEST is raised to the largest abs(p) in contact; under a power law, to a bound of abs(p).
    collision, collisions, struck
        As in `vibench.sim.chain.collide_cell`.
    power
        Memory of steps under a power law.
    cuts
        1: return CUT, with the time in place of the count of touches, for a collision that would not be
        whole before ``until``; what the cell's row then holds is to be forgotten.

    """
    tau, curvature = start, work[CURVATURE]
    fill_curvature(curvature, series)
    if len(log) > 0:
        log[0, LOGGED] = log[0, PUSHED] = log[0, SO_FAR] = 0.0
        _log_now(log, work, cell, tau)
    while tau < until:
        if law.kind == POWER:
            fill_later_series(later, series, cell, markov, tau)
            lasted = press_power(cell, tau, until, later, series, markov, law, tolerance, power, work, log)
            if not lasted > 0.0:
                return LOST
            tau = until if tau + lasted >= until * (1.0 - ROUNDED) else tau + lasted
            _log_now(log, work, cell, tau)
            continue
        if cell[SIDE] != 0.0:
            if is_hertz(law) and cell[ROOT] <= FRESH * cell[ROOT_SCALE]:
                fill_later_series(later, series, cell, markov, tau)
                lasted = collide_cell(
                    cell, tau, until - tau, later, series, markov, law, tolerance, collision, collisions,
                    struck, work, log,
                )  # fmt: skip
                if lasted > 0.0:
                    tau += lasted
                    _log_now(log, work, cell, tau)
                    continue
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
        if is_hertz(law) and cuts == 1 and _ends_too_late(later, touch, tau, until, markov, law, tolerance):
            touches[COUNT] = tau
            return CUT
        if int(touches[COUNT]) + 1 == len(touches):
            return CHATTERS
        touches[COUNT] += 1.0
        touches[int(touches[COUNT])] = tau
        p, rate = motion_in_series(cell[MEMORY:], series, markov, tau)
        side = touched_side(p, rate, law.lower, law.upper)
        acceleration = acceleration_at(curvature, tau) - memory_force(markov, cell[MEMORY:])
        begin_pressing(cell, side, p, rate, acceleration, markov, law, tolerance)
        if until - tau <= HAIR * until:
            age_moments(cell, until - tau)
            tau = until
        _log_now(log, work, cell, tau)
    return CROSSED if len(log) <= SUMMARY_ONLY or log[0, LOGGED] + 1 < len(log) else STUCK
