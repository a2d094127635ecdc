"""One interval of a drive that is a cubic polynomial on it, advanced exactly. SI units.

Build `interval_tables` once, make a state with `new_state`, then call `advance_interval` (from Python
or from another compiled kernel) once an interval, with the base displacement on it as
U(tau) = c0 + c1 tau + c2 tau^2 + c3 tau^3, tau from 0 to the interval's length.

In flight the motion is linear and its forcing polynomial, so one product with a matrix carries the
state across: no step error. Contact is excluded by a bound on the acceleration of p that follows from
the mechanical energy, and resolved by `vibench.sim.contact` when it cannot be excluded. A contact
goes on across the ends of intervals. Tables are never written to: threads may share them, each with a state
of its own.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from ..contact import begin_contact
from ..engine import refuse_inside_a_stop
from ..flight import LONGEST_TURN, base_force, shifted
from ..kernels import Table, Vector, kernel, kernel_without_refcount
from ..model import VX, VY, VZ, Accuracy, Specimen, X, Y, Z, state_matrix
from ..power_law import begin_smooth
from ..rigid import place_between_rigid_stops
from ..slots import SIDE, STATE_SIZE, Parameters, PowerTerms, parameters, power_terms
from ._substep import FAILED, IntervalTables, advance_if_clear, advance_substep

CUBIC_TERMS = 4


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
    substeps = max(1, math.ceil(interval_s * fastest / LONGEST_TURN))
    length = interval_s / substeps
    return IntervalTables(
        par=par,
        power=power_terms(specimen),
        length=length,
        substeps=substeps,
        transition=_transition(system, entry, length),
        bound_per_root_energy=_bound_per_root_energy(specimen, system),
        tolerance=accuracy.tolerance,
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
    """Make a state, shape (STATE_SIZE,), from (x, y, z, vx, vy, vz) [m, m/s], absolute; at rest by default.

    A motion with abs(y - z) beyond the gap starts in contact; one beyond a rigid stop is refused.

    Raises ValueError when the motion is not possible.
    """
    state = np.zeros(STATE_SIZE)
    state[:6] = np.asarray(motion, dtype=np.float64)
    par = parameters(specimen)
    refuse_inside_a_stop(state, specimen)
    place_on_its_side(state, par, power_terms(specimen), par.restitution, accuracy.tolerance)
    return state


@kernel_without_refcount
def place_on_its_side(
    state: Vector, par: Parameters, power: PowerTerms | None, restitution: float | None, tolerance: float
) -> None:
    """Decide from the displacements whether a state is in flight or in contact."""
    p = state[Y] - state[Z]
    state[SIDE] = 0.0
    if power is not None:
        begin_smooth(state)
    elif restitution is not None:
        place_between_rigid_stops(state, par, restitution, tolerance)
    elif p > par.upper or p < -par.lower:
        begin_contact(state, math.copysign(1.0, p), par, tolerance)


@kernel
def advance_interval(state: Vector, base: Vector, tables: IntervalTables) -> int:
    """Advance ``state`` in place over one interval and count the impacts that begin in it.

    ``base`` holds c0 ... c3 of the base displacement [m, m/s, m/s^2, m/s^3], shape (4,). Returns the
    number of impacts, or FAILED (-1) when the state became meaningless; the state is then where it failed.
    """
    force = base_force(base, tables.par)
    impacts = 0
    for substep in range(tables.substeps):
        if substep > 0:
            force = shifted(force, tables.length)
        if not advance_if_clear(state, force, tables):
            fresh = advance_substep(state, force, tables.length, tables, np.empty(0))
            if fresh < 0:
                return FAILED
            impacts += fresh
    return impacts


@kernel_without_refcount
def base_reaction(state: Vector, displacement: float, velocity: float, tables: IntervalTables) -> float:
    """Force that the specimen puts on its base, k0 (x - U) + c0 (vx - dU/dt) [N]."""
    par = tables.par
    force: float = par.k0 * (state[X] - displacement) + par.c0 * (state[VX] - velocity)
    return force
