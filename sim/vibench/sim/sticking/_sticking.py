"""Motion with m1 resting on a rigid stop: exact until the contact force reaches zero. SI units.

A rigid stop makes two bodies of three (`vibench.sim.model`). It lets go where the acceleration that presses
m1 on it (`vibench.sim.rigid.press_on`) falls to zero: found like a touch, by the same proof.
"""

import math

from ..contact import gap_of
from ..flight import (
    NEVER,
    SERIES_TERMS,
    Cubic,
    derivative_bound,
    first_contact,
    place_on_series,
)
from ..kernels import (
    Table,
    Vector,
    kernel_without_refcount,
)
from ..model import (
    VX,
    VY,
    VZ,
    X,
    Y,
    Z,
)
from ..slots import SIDE, Parameters


@kernel_without_refcount
def hold_on_series(
    series: Table, path: Vector, state: Vector, force: Cubic, length: float, par: Parameters
) -> float:
    """Advance a held motion under a cubic base force to where the stop lets go, or by ``length`` [s].

    Returns the time at which it lets go, or NEVER. Workspaces as in `vibench.sim.flight`.
    """
    side = state[SIDE]
    spring = par.k1 * gap_of(side, par.lower, par.upper) / par.reduced_mass
    _fill_held_series(series, path, state, force, par)
    reach = spring
    for k in range(2):
        reach += abs(path[k]) * length**k
    path[0] += spring
    bound = derivative_bound(path, length, 2)
    free = first_contact(path, length, math.inf, 0.0, bound, reach)
    place_on_series(state, series, length if free == NEVER else free)
    state[Y] = state[Z] + side * gap_of(side, par.lower, par.upper)
    return free


@kernel_without_refcount
def _fill_held_series(series: Table, path: Vector, state: Vector, force: Cubic, par: Parameters) -> None:
    """Taylor coefficients of the bound motion, and of minus the pull that presses m1 on its stop [m/s^2]."""
    for i in range(6):
        series[0, i] = state[i]
    weight, pair = -state[SIDE] / par.mass2, par.mass1 + par.mass2
    for k in range(SERIES_TERMS):
        x, z, vx, vz = series[k, X], series[k, Z], series[k, VX], series[k, VZ]
        pull = par.k2 * (z - x) + par.c2 * (vz - vx)
        path[k] = weight * pull
        if k + 1 < SERIES_TERMS:
            push = force[k] if k < 4 else 0.0
            share = 1.0 / (k + 1)
            series[k + 1, X] = share * vx
            series[k + 1, Y] = series[k + 1, Z] = share * vz
            series[k + 1, VX] = share * (pull + push - par.k0 * x - par.c0 * vx) / par.mass0
            series[k + 1, VY] = series[k + 1, VZ] = share * -pull / pair
