"""What an impact on a rigid stop makes of a small change of the state: Mueller's correction. SI units.

A changed motion strikes a little earlier or later, by dt = -n dx / v for a change dx and the speed of
approach v. With R the derivative of the impact at its own instant and f the rates before and after, what is
left at one time is

    dx+ = R dx- + (f+ - R f-) n dx- / v

(Mueller, Chaos, Solitons and Fractals 5 (1995) 1671; Leine and Nijmeijer, Dynamics and Bifurcations of
Non-smooth Mechanical Systems, Springer 2004, section 7.3). For one mass at one stop this is dx+ = -rho dx-,
dv+ = -rho dv- + (rho a- + a+) dx- / v-. At a grazing impact, v = 0, no derivative exists.
"""

import math

from ..contact import SLOWEST_TOUCH
from ..kernels import Table, Vector, kernel_without_refcount
from ..model import VX, VY, VZ, X, Y, Z
from ..slots import SIDE, Parameters, keep_in_range


@kernel_without_refcount
def _free_pull(state: Vector, par: Parameters) -> float:
    """Force that m0 puts on m2 [N]."""
    pull: float = par.k2 * (state[Z] - state[X]) + par.c2 * (state[VZ] - state[VX])
    return pull


@kernel_without_refcount
def _free_inner(state: Vector, par: Parameters) -> float:
    """Force of the spring and damper between m1 and m2 [N]."""
    inner: float = par.k1 * (state[Y] - state[Z]) + par.c1 * (state[VY] - state[VZ])
    return inner


@kernel_without_refcount
def propagate_tangent_impact(
    tangent: Table, before: Vector, after: Vector, par: Parameters, restitution: float
) -> None:
    """Carry every change through an impact from the state ``before`` to the state ``after``."""
    share1, share2 = par.reduced_mass / par.mass1, par.reduced_mass / par.mass2
    approach = before[VY] - before[VZ]
    approach = math.copysign(max(abs(approach), SLOWEST_TOUCH), approach)
    turned = 1.0 + restitution
    jump_y, jump_z = after[VY] - before[VY], after[VZ] - before[VZ]
    pull, pull_after = _free_pull(before, par), _free_pull(after, par)
    inner, inner_after = _free_inner(before, par), _free_inner(after, par)
    bend = pull / par.mass2 - inner / par.reduced_mass
    # f+ - R f-, velocity rows; the drive is the same on both sides and drops out.
    late_x = (pull_after - pull) / par.mass0
    late_y = (inner - inner_after) / par.mass1 + share1 * turned * bend
    late_z = (inner_after - inner - pull_after + pull) / par.mass2 - share2 * turned * bend
    for change in tangent:
        late = (change[Y] - change[Z]) / approach
        rate = change[VY] - change[VZ]
        change[Y] += jump_y * late
        change[Z] += jump_z * late
        change[VX] += late_x * late
        change[VY] += late_y * late - share1 * turned * rate
        change[VZ] += late_z * late + share2 * turned * rate
        if after[SIDE] != 0.0:
            _hold(change, par)
        keep_in_range(change)


@kernel_without_refcount
def _hold(change: Vector, par: Parameters) -> None:
    """Join m1 and m2, whose centre goes on: on a stop that holds m1 no change of p is left."""
    share = par.reduced_mass / par.mass2
    change[Z] += share * (change[Y] - change[Z])
    change[VZ] += share * (change[VY] - change[VZ])
    change[Y], change[VY] = change[Z], change[VZ]
