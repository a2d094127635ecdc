"""One interval of a drive that is a cubic polynomial on it, advanced exactly. SI units.

Build `interval_tables` once, make a state with `new_state`, then call `advance_interval` (from Python
or from another compiled kernel) once an interval, with the base displacement on it as
U(tau) = c0 + c1 tau + c2 tau^2 + c3 tau^3, tau from 0 to the interval's length.

In flight the motion is linear and its forcing polynomial, so one product with a matrix carries the
state across: no step error. Contact is excluded by a bound on the acceleration of p that follows from
the mechanical energy, and resolved by `sim.contact` when it cannot be excluded. A contact goes on
across the ends of intervals. Tables are never written to: threads may share them, each with a state
of its own.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from .accuracy import Accuracy
from .compiled import compiled
from .contact import HELD, LEFT, advance_contact, begin_contact, contact_workspace
from .contact_flow import FORCE_TERMS
from .detection import LONGEST_TURN, NEVER, SERIES_TERMS, first_contact
from .flight_series import fill_flight_series, place_on_series
from .modes import state_matrix
from .parameters import (
    SIDE,
    STATE_SIZE,
    VX,
    VY,
    VZ,
    Parameters,
    Table,
    Vector,
    X,
    Y,
    Z,
    parameters,
)
from .specimen import Specimen

CUBIC_TERMS = 4
MOST_IMPACTS_IN_A_PIECE = 1000
"""Far beyond any motion of a specimen; a search that reaches it has lost its way."""
FAILED = -1
"""What `advance_interval` returns when the state is not finite or a contact made no progress."""


class IntervalTables(NamedTuple):
    """Everything about specimen and interval that does not change from interval to interval."""

    par: Parameters
    length: float
    """One piece of the interval [s]: short enough for the Taylor series of detection."""
    pieces: int
    transition: Table
    """Shape (6, 10): state and force coefficients before -> (x, y, z, vx, vy, vz) after one piece."""
    bound_per_root_energy: float
    """Largest abs(d2p/dt2) over sqrt(2 * energy) [m/s^2 / J^0.5]."""
    tolerance: float
    no_times: Vector
    """Empty: for callers that do not keep impact times."""


def interval_tables(
    specimen: Specimen, interval_s: float, accuracy: Accuracy = Accuracy.STANDARD
) -> IntervalTables:
    """Prepare `advance_interval` for a specimen and a fixed length of interval.

    Raises ValueError when the interval is not positive and finite.
    """
    if not 0.0 < interval_s < math.inf:
        msg = f"Interval {interval_s} s is not allowed: it must be positive and finite."
        raise ValueError(msg)
    par = parameters(specimen)
    system, entry = state_matrix(specimen)
    fastest = float(np.max(np.abs(np.linalg.eigvals(system))))
    pieces = max(1, math.ceil(interval_s * fastest / LONGEST_TURN))
    length = interval_s / pieces
    return IntervalTables(
        par=par,
        length=length,
        pieces=pieces,
        transition=_transition(system, entry, length),
        bound_per_root_energy=_bound_per_root_energy(specimen, system),
        tolerance=accuracy.tolerance,
        no_times=np.zeros(0),
    )


def _transition(system: Table, entry: Vector, length: float) -> Table:
    """Exponential of flight and forcing together; the forcing's powers form a nilpotent block.

    Van Loan, Computing integrals involving the matrix exponential, IEEE Trans. Autom. Control 23 (1978).
    Time is counted in lengths and velocity in displacement per length, which balances the matrix.
    """
    units = np.concatenate([np.ones(3), np.full(3, 1.0 / length), np.ones(CUBIC_TERMS)])
    joint = np.zeros((6 + CUBIC_TERMS, 6 + CUBIC_TERMS))
    joint[:6, :6] = system
    joint[:6, 6] = entry
    for power in range(1, CUBIC_TERMS):
        # d/dt (f0 + f1 t + ...) : the coefficient in front becomes f1 + 2 f2 t + ...
        joint[5 + power, 6 + power] = power / length
    scaled = joint * length / units[:, None] * units[None, :]
    whole = expm(scaled) * units[:, None] / units[None, :]
    powers = np.concatenate([np.ones(6), length ** -np.arange(CUBIC_TERMS, dtype=np.float64)])
    return np.ascontiguousarray(whole[:6] / powers)


def _bound_per_root_energy(specimen: Specimen, system: Table) -> float:
    """Dual norm of the row that gives d2p/dt2, in the energy norm s^T diag(K, M) s."""
    row = system[VY] - system[VZ]
    energy = np.zeros((6, 6))
    energy[:3, :3], energy[3:, 3:] = specimen.stiffness_matrix, specimen.mass_matrix
    return math.sqrt(float(row @ np.linalg.solve(energy, row)))


def new_state(
    specimen: Specimen, motion: ArrayLike = (0.0,) * 6, accuracy: Accuracy = Accuracy.STANDARD
) -> Vector:
    """Make a state, shape (12,), from (x, y, z, vx, vy, vz) [m, m/s], absolute; at rest by default.

    A motion with abs(y - z) beyond the gap starts in contact.
    """
    state = np.zeros(STATE_SIZE)
    state[:6] = np.asarray(motion, dtype=np.float64)
    place_on_its_side(state, parameters(specimen), accuracy.tolerance)
    return state


@compiled
def place_on_its_side(state: Vector, par: Parameters, tolerance: float) -> None:
    """Decide from the displacements whether a state is in flight or in contact."""
    p = state[Y] - state[Z]
    state[SIDE] = 0.0
    if abs(p) > par.gap:
        begin_contact(state, math.copysign(1.0, p), par, tolerance)


@compiled
def advance_interval(state: Vector, base: Vector, tables: IntervalTables) -> int:
    """Advance ``state`` in place over one interval and count the impacts that begin in it.

    ``base`` holds c0 ... c3 of the base displacement [m, m/s, m/s^2, m/s^3], shape (4,). Returns the
    number of impacts, or FAILED (-1) when the state became meaningless; the state is then where it failed.
    """
    par = tables.par
    f0 = par.k0 * base[0] + par.c0 * base[1]
    f1 = par.k0 * base[1] + 2.0 * par.c0 * base[2]
    f2 = par.k0 * base[2] + 3.0 * par.c0 * base[3]
    f3 = par.k0 * base[3]
    impacts = 0
    for piece in range(tables.pieces):
        fresh = advance_piece(state, f0, f1, f2, f3, tables, tables.no_times, 0)
        if fresh < 0:
            return FAILED
        impacts += fresh
        if piece + 1 < tables.pieces:
            h = tables.length
            f0, f1, f2 = (
                f0 + h * (f1 + h * (f2 + h * f3)),
                f1 + h * (2.0 * f2 + 3.0 * h * f3),
                f2 + 3.0 * h * f3,
            )
    return impacts


@compiled
def base_reaction(state: Vector, displacement: float, velocity: float, tables: IntervalTables) -> float:
    """Force that the specimen puts on its base, k0 (x - U) + c0 (vx - dU/dt) [N]."""
    par = tables.par
    force: float = par.k0 * (state[X] - displacement) + par.c0 * (state[VX] - velocity)
    return force


@compiled
def acceleration_bound(
    state: Vector, f0: float, f1: float, f2: float, f3: float, tables: IntervalTables
) -> float:
    """Bound of abs(d2p/dt2) over one piece in flight, from the energy at its start [m/s^2].

    The energy grows no faster than d/dt sqrt(2E) = |f| / sqrt(m0); damping only takes from it.
    """
    par, h = tables.par, tables.length
    x, y, z, vx, vy, vz = state[0], state[1], state[2], state[3], state[4], state[5]
    kinetic = par.mass0 * vx * vx + par.mass1 * vy * vy + par.mass2 * vz * vz
    elastic = par.k0 * x * x + par.k2 * (z - x) * (z - x) + par.k1 * (y - z) * (y - z)
    push = abs(f0) + h * (abs(f1) + h * (abs(f2) + h * abs(f3)))
    return tables.bound_per_root_energy * (math.sqrt(kinetic + elastic) + h * push / math.sqrt(par.mass0))


@compiled
def advance_piece(
    state: Vector,
    f0: float,
    f1: float,
    f2: float,
    f3: float,
    tables: IntervalTables,
    times: Vector,
    kept: int,
) -> int:
    """Advance over one piece with base force f0 + f1 tau + f2 tau^2 + f3 tau^3 [N].

    Impact times (since the start of the piece) go to ``times[kept:]`` while there is room. Returns the
    impacts, or FAILED.
    """
    if state[SIDE] != 0.0:
        return _advance_near_stop(state, f0, f1, f2, f3, tables, times, kept)
    h, gap, step = tables.length, tables.par.gap, tables.transition
    bound = acceleration_bound(state, f0, f1, f2, f3, tables)
    clear = gap - bound * h * h / 8.0
    y = _carried(step, 1, state, f0, f1, f2, f3)
    z = _carried(step, 2, state, f0, f1, f2, f3)
    if abs(state[Y] - state[Z]) < clear and abs(y - z) < clear:
        x = _carried(step, 0, state, f0, f1, f2, f3)
        vx = _carried(step, 3, state, f0, f1, f2, f3)
        vy = _carried(step, 4, state, f0, f1, f2, f3)
        vz = _carried(step, 5, state, f0, f1, f2, f3)
        state[X], state[Y], state[Z], state[VX], state[VY], state[VZ] = x, y, z, vx, vy, vz
        return 0
    if not bound < math.inf:
        return FAILED
    return _advance_near_stop(state, f0, f1, f2, f3, tables, times, kept)


@compiled
def _carried(step: Table, i: int, s: Vector, f0: float, f1: float, f2: float, f3: float) -> float:
    """One row of the transition: a component of the state one piece later."""
    free: float = (step[i, 0] * s[0] + step[i, 1] * s[1] + step[i, 2] * s[2]) + (
        step[i, 3] * s[3] + step[i, 4] * s[4] + step[i, 5] * s[5]
    )
    forced: float = (step[i, 6] * f0 + step[i, 7] * f1) + (step[i, 8] * f2 + step[i, 9] * f3)
    return free + forced


@compiled
def _advance_near_stop(
    state: Vector,
    f0: float,
    f1: float,
    f2: float,
    f3: float,
    tables: IntervalTables,
    times: Vector,
    kept: int,
) -> int:
    """Advance over one piece through every touch and every contact in it."""
    par, h = tables.par, tables.length
    work = contact_workspace()
    series, path, force = np.empty((SERIES_TERMS, 6)), np.empty(SERIES_TERMS), np.zeros(FORCE_TERMS)
    force[0], force[1], force[2], force[3] = f0, f1, f2, f3
    tau, impacts = 0.0, 0
    while impacts < MOST_IMPACTS_IN_A_PIECE:
        if state[SIDE] != 0.0:
            code, tau = advance_contact(state, tau, h, force, 0.0, par, tables.tolerance, work)
            if code == HELD:
                return impacts
            if code != LEFT:
                return FAILED
        g0 = f0 + tau * (f1 + tau * (f2 + tau * f3))
        g1 = f1 + tau * (2.0 * f2 + 3.0 * tau * f3)
        g2 = f2 + 3.0 * tau * f3
        bound = acceleration_bound(state, g0, g1, g2, f3, tables)
        fill_flight_series(series, path, state, g0, g1, g2, f3, par)
        touch = first_contact(path, h - tau, par.gap, bound, abs(state[Y]) + abs(state[Z]))
        if touch == NEVER:
            place_on_series(state, series, h - tau)
            return impacts
        place_on_series(state, series, touch)
        tau += touch
        if kept + impacts < len(times):
            times[kept + impacts] = tau
        impacts += 1
        begin_contact(state, math.copysign(1.0, state[Y] - state[Z]), par, tables.tolerance)
    return FAILED
