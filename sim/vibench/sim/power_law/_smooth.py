"""Motion under a power law while the drive is given piece by piece: one adaptive method. SI units.

The unknowns are (p, dp/dt, x, z, vx, vz, t) in the places of a contact's; the step is the same Dormand and
Prince 8(5,3) in time itself. Every unknown is held to the tolerance of its own recent size, because any one
of them may be the small one (a light mass, a stiff link, a still start).

An overflowing stage, usual for p^29 and beyond when a step is tried too far, makes the error NaN, and the
step shrinks.
"""

import math

from ..contact import (
    CVX,
    CVZ,
    CX,
    CZ,
    HELD,
    NOT_FINITE,
    POINT,
    STALLED,
    TRIAL,
    R,
    T,
    W,
    blended_error,
    gather,
    squared_errors,
    step_factor,
    trial_step,
)
from ..kernels import Table, Vector, copy_row, kernel_without_refcount
from ..model import VX, VY, VZ, X, Y, Z
from ..slots import RATE, ROOT, SCALES, SIDE, STEP, Parameters
from ._flow import PowerSystem, power_rates, short_of_the_wall, stiffest_rate

MOTIONS = 6
"""The unknowns whose errors count; time has none."""
FORGETTING = 0.02
"""How fast a past size fades, over the lowest rate of the whole body on its spring."""
SMALLEST_PART = 1e-3
"""A displacement (velocity) counts as at least this part of the largest one."""
NOTHING_MOVES = 1e-150
"""Size of a motion that has none, so that an error over it is zero."""
FIRST_TURN = 0.01
"""First step, in radians of the fastest link without the power law."""
MOST_STEPS = 1_000_000
"""Steps in one call, which is a fraction of a period."""


@kernel_without_refcount
def begin_smooth(state: Vector) -> None:
    """Set up from the displacements and velocities of ``state``."""
    state[SIDE] = 1.0
    state[ROOT], state[RATE] = state[Y] - state[Z], state[VY] - state[VZ]
    state[STEP] = 0.0
    sizes = state[SCALES : SCALES + MOTIONS]
    sizes[W], sizes[R], sizes[CX] = abs(state[ROOT]), abs(state[RATE]), abs(state[X])
    sizes[CZ], sizes[CVX], sizes[CVZ] = abs(state[Z]), abs(state[VX]), abs(state[VZ])


@kernel_without_refcount
def _scatter(work: Table, state: Vector) -> None:
    at = work[POINT]
    state[ROOT], state[RATE] = at[W], at[R]
    state[X], state[Z], state[VX], state[VZ] = at[CX], at[CZ], at[CVX], at[CVZ]
    state[Y], state[VY] = at[CZ] + at[W], at[CVZ] + at[R]


@kernel_without_refcount
def _widen_sizes(sizes: Vector, at: Vector, fading: float, push: float, par: Parameters) -> None:
    """Bring the recent sizes up to date with the point reached."""
    for i in range(MOTIONS):
        sizes[i] = max(abs(at[i]), fading * sizes[i])
    sizes[CX] = max(sizes[CX], push / par.k0)
    sizes[CVX] = max(sizes[CVX], push / math.sqrt(par.k0 * par.mass0))
    far = SMALLEST_PART * max(sizes[W], sizes[CX], sizes[CZ]) + NOTHING_MOVES
    fast = SMALLEST_PART * max(sizes[R], sizes[CVX], sizes[CVZ]) + NOTHING_MOVES
    sizes[W], sizes[CX], sizes[CZ] = max(sizes[W], far), max(sizes[CX], far), max(sizes[CZ], far)
    sizes[R], sizes[CVX], sizes[CVZ] = max(sizes[R], fast), max(sizes[CVX], fast), max(sizes[CVZ], fast)


@kernel_without_refcount
def smooth_error(work: Table, step: float, sizes: Vector, tolerance: float) -> float:
    """Error of the step just tried, over what is allowed: root mean square of all six motions.

    Infinite when a stage ran away or overflowed.
    """
    fifth, third = 0.0, 0.0
    for i in range(MOTIONS):
        fifth_i, third_i = squared_errors(work, i, tolerance * sizes[i])
        fifth += fifth_i
        third += third_i
    return blended_error(fifth, third, float(MOTIONS), step)


@kernel_without_refcount
def _largest_push(force: Vector, half: float) -> float:
    """Bound of the base force on a stretch of twice ``half`` about its middle."""
    push, power = 0.0, 1.0
    for k in range(len(force)):
        push += abs(force[k]) * power
        power *= half
    return push


@kernel_without_refcount
def advance_smooth(
    state: Vector,
    tau: float,
    limit: float,
    force: Vector,
    middle: float,
    system: PowerSystem,
    tolerance: float,
    work: Table,
) -> tuple[int, float]:
    """Advance to the time ``limit``; arguments and codes as in `vibench.sim.contact.advance_contact`.

    Pieces of a sampled drive are a hundred times shorter than the steps of `vibench.sim.power_law`.

    Steps divide the time that is left evenly when it is short, so that none is cut to a stub.
    """
    par, power = system.par, system.power
    sizes, step = state[SCALES : SCALES + MOTIONS], state[STEP]
    gather(work, state, tau)
    if tau >= limit:
        return HELD, tau
    at = work[POINT]
    push = _largest_push(force, max(abs(limit - middle), abs(tau - middle)))
    lowest = FORGETTING * math.sqrt(par.k0 / (par.mass0 + par.mass1 + par.mass2))
    if step == 0.0:
        fastest = math.sqrt((par.k0 + par.k2) / par.mass0 + (par.k1 + par.k2) / par.reduced_mass)
        step = FIRST_TURN / fastest
        # What is let go has no speed yet by which to tell an error of it.
        sizes[R] = max(sizes[R], stiffest_rate(sizes[W], par.k1, par.inverse_pair, power) * sizes[W])
        sizes[CVX], sizes[CVZ] = max(sizes[CVX], fastest * sizes[CX]), max(sizes[CVZ], fastest * sizes[CZ])
    _widen_sizes(sizes, at, 1.0, push, par)
    power_rates(at, work[0], 1.0, force, middle, system)
    code = STALLED
    for _ in range(MOST_STEPS):
        step = short_of_the_wall(step, at, par.k1, par.inverse_pair, power)
        left = limit - at[T]
        steps = math.ceil(left / step)
        taken = left / steps if steps <= 2 else step
        trial_step(work, taken, 1.0, force, middle, system)
        error = smooth_error(work, taken, sizes, tolerance)
        factor = step_factor(error)
        if not error <= 1.0:
            step = taken * min(factor, 1.0)
            if at[T] + step == at[T]:
                return NOT_FINITE, at[T]
            continue
        copy_row(work[POINT], work[TRIAL])
        if steps == 1:
            at[T] = limit
        # A step that was cut by the limit says little about the next one's length.
        step = max(step, taken * factor) if taken < step and factor > 1.0 else taken * factor
        _widen_sizes(sizes, at, 1.0 / (1.0 + lowest * taken), push, par)
        power_rates(at, work[0], 1.0, force, middle, system)
        if at[T] >= limit:
            code = HELD
            break
    state[STEP] = step
    _scatter(work, state)
    return code, at[T]
