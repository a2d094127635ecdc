"""Contact with a stop that yields: from touching it to leaving it, with controlled error. SI units."""

import math

import numpy as np

from ..kernels.arrays import Table, Vector
from ..kernels.compile import inlined, kernel, kernel_without_refcount
from ..kernels.row import copy_row
from ..model.state import VX, VY, VZ, X, Y, Z
from ..slots.parameters import PACE, RATE, RATE_SCALE, ROOT, ROOT_SCALE, SIDE, STEP, Parameters
from .end import step_to_exit, step_to_time
from .flow import (
    CVX,
    CVZ,
    CX,
    CZ,
    POINT,
    TRIAL,
    WIDTH,
    WORK_ROWS,
    R,
    T,
    W,
    contact_error,
    contact_rates,
    gap_of,
    trial_step,
)

LEFT, HELD, NOT_FINITE, STALLED = range(4)
"""How a call ends: the stop was left; the time limit came first; NaN; no progress."""

SLOWEST_TOUCH = 1e-12
"""A touch slower than this [m/s] enters at this rate: at exactly w = r = 0 the flow in s stands still."""
ROOT_FLOOR = 1e-6
"""Added to the error scale of w [m^0.5] (a penetration of 1 pm), so that it never vanishes."""
RATE_FLOOR = 1e-6
"""Added to the error scale of r [m/s]."""
SAFETY, SHRINK, GROW = 0.9, 0.2, 4.0
"""Step control: aim below the tolerance; the most a step may shrink and grow."""
MOST_STEPS = 100_000
"""Steps within one call; a contact takes about ten."""
LANDING = 1e-11
"""An exit is found when |w| is below this part of its scale."""
STANDARD_TOLERANCE = 3e-7
"""The tolerance for which steps are foreseen; they scale with its eighth root."""
DEEP = 1.05
"""Up to this part of the foreseen depth a contact is the collision that was foreseen."""
PRESSED = 0.7
"""First step of a contact that the other springs press, over its time scale."""
NEAR = 0.1
"""A hair before the exit, over the last w and the square root of the tolerance: what is left out there, the
third power of it, is far less than the tolerance."""


@kernel
def contact_workspace() -> Table:
    """Memory that one run (one thread) hands to every contact."""
    return np.zeros((WORK_ROWS, WIDTH))


@kernel_without_refcount
def begin_contact(state: Vector, side: float, par: Parameters, tolerance: float) -> None:
    """Enter contact from the flight state, at any penetration (zero when the stop is just touched).

    The first step resolves whichever is faster: the elastic collision (a half-wave in s of about
    5.1 w_max/v), or the other springs pressing a slow contact (w'' = -(a/2) w).
    """
    p = state[Y] - state[Z]
    gap = gap_of(side, par.lower, par.upper)
    root = math.sqrt(max(side * p - gap, 0.0))
    rate = side * (state[VY] - state[VZ])
    if root == 0.0:
        rate = max(rate, SLOWEST_TOUCH)
    speed, deepest = foreseen_collision(
        root, rate, par.linear_stiffness / par.reduced_mass, par.contact_stiffness / par.reduced_mass
    )
    pull = par.k2 * (state[Z] - state[X]) + par.c2 * (state[VZ] - state[VX])
    pressing = par.k1 * gap + par.c1 * rate
    press = abs(side * pull / par.mass2 - pressing / par.reduced_mass)
    state[SIDE] = side
    state[ROOT] = root
    state[RATE] = rate
    state[PACE] = deepest / speed
    state[ROOT_SCALE] = deepest + ROOT_FLOOR
    state[RATE_SCALE] = speed + RATE_FLOOR
    whole = min(deepest / speed, PRESSED / math.sqrt(0.5 * press + 1e-300))
    state[STEP] = step_scale(tolerance) * _foreseen(root / state[ROOT_SCALE], rate) * whole


@inlined
def foreseen_collision(root: float, rate: float, linear: float, hertz: float) -> tuple[float, float]:
    """Foresee a collision's largest speed [m/s] and w [m^0.5] from a point of it; stiffnesses over the mass.

    With the speed v: m v^2 / 2 = k1 d^2 / 2 + 2 k d^(5/2) / 5, each spring taken alone.
    """
    fifth = 0.8 * hertz
    speed = math.sqrt(rate * rate + fifth * root**5 + linear * root**4)
    return speed, min((speed * speed / fifth) ** 0.2, math.sqrt(speed / math.sqrt(linear)))


@kernel_without_refcount
def step_scale(tolerance: float) -> float:
    """Give the ratio of steps at a tolerance to those at the standard one: its eighth root."""
    return math.sqrt(math.sqrt(math.sqrt(tolerance / STANDARD_TOLERANCE)))


@inlined
def _foreseen(depth: float, rate: float) -> float:
    """Foresee the longest step that will do, over the collision's time scale, at a depth over the largest.

    Contacts are all alike: the errors of the last step know nothing of the turn ahead, where steps must be
    half as long. Measured on Hertz collisions of any speed (5.1 long in all) as what a third of the tolerance
    allows; on linear stops it is a little less than that.
    """
    if rate > 0.0:
        return max(1.02 - 0.95 * depth, 0.46)
    if depth > 0.93:
        return 0.48
    return 0.6 if depth > 0.65 else 0.9


@kernel_without_refcount
def gather(work: Table, state: Vector, tau: float) -> None:
    """Write the unknowns from the state vector to ``work[POINT]``."""
    at = work[POINT]
    at[W], at[R], at[CX], at[CZ] = state[ROOT], state[RATE], state[X], state[Z]
    at[CVX], at[CVZ], at[T], at[WIDTH - 1] = state[VX], state[VZ], tau, 0.0


@kernel_without_refcount
def _scatter(work: Table, state: Vector, par: Parameters) -> None:
    at, side = work[POINT], state[SIDE]
    state[ROOT], state[RATE] = at[W], at[R]
    state[X], state[Z], state[VX], state[VZ] = at[CX], at[CZ], at[CVX], at[CVZ]
    state[Y] = at[CZ] + side * (gap_of(side, par.lower, par.upper) + at[W] * at[W])
    state[VY] = at[CVZ] + side * at[R]


@kernel_without_refcount
def step_factor(error: float) -> float:
    """Next step over this one. The eighth root as three square roots; an error of NaN shrinks."""
    if not error < 1e300:
        return SHRINK
    if error <= 1e-12:
        return GROW
    return min(GROW, max(SHRINK, SAFETY / math.sqrt(math.sqrt(math.sqrt(error)))))


@kernel_without_refcount
def advance_contact(  # noqa: C901 - a step control and its three ends are one loop
    state: Vector,
    tau: float,
    limit: float,
    force: Vector,
    middle: float,
    par: Parameters,
    tolerance: float,
    work: Table,
) -> tuple[int, float]:
    """Advance a contact until m1 leaves the stop or the time reaches ``limit``, whichever is first.

    Parameters
    ----------
    state
        In and out; ``state[SIDE]`` is back at 0 when the stop was left.
    tau, limit
        Time now and time to stop at [s], on the clock of ``force``.
    force, middle
        k0 U + c0 dU/dt as coefficients in powers of (tau - middle), shape (8,).
    tolerance
        Relative error allowed in a step, on w and r.
    work
        From `contact_workspace`.

    Returns
    -------
    LEFT, HELD, NOT_FINITE or STALLED, and the time reached.

    """
    side, step = state[SIDE], state[STEP]
    root_scale, rate_scale = state[ROOT_SCALE], state[RATE_SCALE]
    longest = state[PACE] * step_scale(tolerance)
    near = NEAR * math.sqrt(tolerance)
    gather(work, state, tau)
    if tau >= limit:
        return HELD, tau
    contact_rates(work[POINT], work[0], side, force, middle, par)
    for _ in range(MOST_STEPS):
        trial_step(work, step, side, force, middle, par)
        error = contact_error(work, step, root_scale, rate_scale, tolerance)
        factor = step_factor(error)
        if not error <= 1.0:
            step *= min(factor, 1.0)
            if step < 1e-300:
                return NOT_FINITE, work[POINT, T]
            continue
        taken, code = step, -1
        if work[TRIAL, W] <= 0.0:
            taken = step_to_exit(
                work, step, side, force, middle, par, LANDING * root_scale, near * work[POINT, W]
            )
            code = LEFT
        if work[TRIAL, T] >= limit:
            taken = step_to_time(work, taken, T, limit, side, force, middle, par)
            code = HELD
        if work[TRIAL, T] < work[POINT, T]:
            # Time runs backwards where w < 0: the step leapt over the exit and came back.
            step *= 0.5
            continue
        copy_row(work[POINT], work[TRIAL])
        if code == LEFT:
            work[POINT, W] = 0.0
        if code >= 0:
            _scatter(work, state, par)
            state[STEP] = step
            if code == LEFT:
                state[SIDE] = 0.0
            return code, work[POINT, T]
        contact_rates(work[POINT], work[0], side, force, middle, par)
        step *= factor
        depth = work[POINT, W] / root_scale
        if depth < DEEP:
            step = min(step, longest * _foreseen(depth, work[POINT, R]))
    _scatter(work, state, par)
    return STALLED, work[POINT, T]
