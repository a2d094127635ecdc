"""One substep of an interval: one matrix product if clear of the stops, else resolved in full. SI units."""

import math
from typing import NamedTuple

import numpy as np

from ..contact import HELD, LEFT, contact_workspace
from ..flight import (
    CLEAR,
    FORCE_TERMS,
    LARGEST_BOUND,
    LIFTS_OFF,
    NEVER,
    OUT_OF_RANGE,
    SERIES_TERMS,
    TOUCHES,
    Cubic,
    fill_flight_series,
    first_contact,
    place_on_series,
    shifted,
)
from ..kernels import Table, Vector, kernel, kernel_without_refcount
from ..model import VX, VY, VZ, X, Y, Z
from ..rigid import closed_gap, is_resolved
from ..slots import CLOSED, SIDE, Parameters, PowerTerms
from ..sticking import hold_on_series, time_to_lift_off
from ._touch import advance_touching, contact_onset

MOST_PHASES_IN_A_SUBSTEP = 100_000
"""Flights and contacts: far beyond any motion of a specimen, chatter on rigid stops included. A search that
reaches it has lost its way."""
FAILED = -1
"""Returned instead of impacts when the state is not finite or a contact made no progress."""


class IntervalTables(NamedTuple):
    """Everything about specimen and interval that does not change from interval to interval."""

    par: Parameters
    power: PowerTerms | None
    """Of a power law; None for other laws, which a kernel tells by the type."""
    length: float
    """One piece of the interval [s]: short enough for the Taylor series of detection."""
    substeps: int
    transition: Table
    """Shape (6, 10): state and force coefficients before -> (x, y, z, vx, vy, vz) after one piece."""
    bound_per_root_energy: float
    """Largest abs(d2p/dt2) over sqrt(2 * energy) [m/s^2 / J^0.5]."""
    tolerance: float


@kernel_without_refcount
def acceleration_bound(state: Vector, force: Cubic, tables: IntervalTables) -> float:
    """Bound of abs(d2p/dt2) over one piece in flight, from the energy at its start [m/s^2].

    The energy grows no faster than d/dt sqrt(2E) = |f| / sqrt(m0); damping only takes from it.
    """
    par, h = tables.par, tables.length
    x, y, z, vx, vy, vz = state[0], state[1], state[2], state[3], state[4], state[5]
    kinetic = par.mass0 * vx * vx + par.mass1 * vy * vy + par.mass2 * vz * vz
    elastic = par.k0 * x * x + par.k2 * (z - x) * (z - x) + par.k1 * (y - z) * (y - z)
    push = abs(force.f0) + h * (abs(force.f1) + h * (abs(force.f2) + h * abs(force.f3)))
    return tables.bound_per_root_energy * (math.sqrt(kinetic + elastic) + h * push / math.sqrt(par.mass0))


@kernel_without_refcount
def advance_if_clear(state: Vector, force: Cubic, tables: IntervalTables) -> bool:
    """Carry a flight across one piece, or leave ``state`` alone when a touch cannot be excluded."""
    if state[SIDE] != 0.0:
        return False
    h, step = tables.length, tables.transition
    margin = acceleration_bound(state, force, tables) * h * h / 8.0
    low, high = margin - tables.par.lower, tables.par.upper - margin
    y = _advanced(step, 1, state, force)
    z = _advanced(step, 2, state, force)
    if not (low < state[Y] - state[Z] < high and low < y - z < high):
        return False
    x = _advanced(step, 0, state, force)
    vx = _advanced(step, 3, state, force)
    vy = _advanced(step, 4, state, force)
    vz = _advanced(step, 5, state, force)
    state[X], state[Y], state[Z], state[VX], state[VY], state[VZ] = x, y, z, vx, vy, vz
    return True


@kernel_without_refcount
def _advanced(step: Table, i: int, s: Vector, force: Cubic) -> float:
    """One row of the transition: a component of the state one piece later."""
    free: float = (step[i, 0] * s[0] + step[i, 1] * s[1] + step[i, 2] * s[2]) + (
        step[i, 3] * s[3] + step[i, 4] * s[4] + step[i, 5] * s[5]
    )
    forced: float = (step[i, 6] * force.f0 + step[i, 7] * force.f1) + (
        step[i, 8] * force.f2 + step[i, 9] * force.f3
    )
    return free + forced


@kernel
def advance_substep(state: Vector, force: Cubic, length: float, tables: IntervalTables, times: Vector) -> int:
    """Advance over ``length`` [s], at most a piece, through every touch and every contact in it.

    Impact times (since the start of the piece) go to ``times`` while there is room. Returns the
    impacts, or FAILED.
    """
    work, series, path = contact_workspace(), np.empty((SERIES_TERMS, 6)), np.empty(SERIES_TERMS)
    tau, impacts = 0.0, 0
    for _ in range(MOST_PHASES_IN_A_SUBSTEP):
        if state[SIDE] != 0.0:
            code, tau = _stay_on_stop(
                state, force, tau, length, tables, tables.par.restitution, work, series, path
            )
            if code == HELD:
                return impacts
            if code != LEFT:
                return FAILED
        ends, tau = _fly_substep(state, force, tau, length, tables, tables.par.restitution, series, path)
        if ends == CLEAR:
            return impacts
        if ends == OUT_OF_RANGE:
            return FAILED
        if ends == TOUCHES:
            if impacts < len(times):
                times[impacts] = tau
            impacts += 1
            contact_onset(state, tables.par, tables.par.restitution, tables.tolerance)
    return FAILED


@kernel
def _stay_on_stop(
    state: Vector,
    force: Cubic,
    tau: float,
    length: float,
    tables: IntervalTables,
    restitution: float | None,
    work: Table,
    series: Table,
    path: Vector,
) -> tuple[int, float]:
    """Advance from ``tau`` while a stop pushes; codes of `vibench.sim.contact`, and the time reached."""
    if restitution is not None:
        lets_go = hold_on_series(series, path, state, shifted(force, tau), length - tau, tables.par)
        if lets_go == NEVER:
            return HELD, length
        state[SIDE] = 0.0
        return LEFT, tau + lets_go
    pushing = np.zeros(FORCE_TERMS)
    pushing[0], pushing[1], pushing[2], pushing[3] = force.f0, force.f1, force.f2, force.f3
    return advance_touching(
        state, tau, length, pushing, 0.0, tables.par, tables.power, tables.tolerance, work
    )


@kernel_without_refcount
def _fly_substep(
    state: Vector,
    force: Cubic,
    tau: float,
    length: float,
    tables: IntervalTables,
    restitution: float | None,
    series: Table,
    path: Vector,
) -> tuple[int, float]:
    """Advance a flight from ``tau`` to its first touch or to ``length``; codes of `vibench.sim.flight`."""
    par, rest, left = tables.par, shifted(force, tau), length - tau
    bound = acceleration_bound(state, rest, tables)
    if not bound < LARGEST_BOUND:
        return OUT_OF_RANGE, tau
    fill_flight_series(series, path, state, rest, par)
    scale = abs(state[Y]) + abs(state[Z])
    if restitution is not None:
        state[CLOSED] = closed_gap(scale, par)
        if not is_resolved(state[CLOSED], par):
            return OUT_OF_RANGE, tau
        leaves = time_to_lift_off(path, left, state[CLOSED], par)
        if leaves > 0.0:
            place_on_series(state, series, leaves)
            return (LIFTS_OFF, tau + leaves) if leaves < left else (CLEAR, length)
    touch = first_contact(path, left, par.lower, par.upper, bound, scale)
    place_on_series(state, series, left if touch == NEVER else touch)
    return (CLEAR, length) if touch == NEVER else (TOUCHES, tau + touch)
