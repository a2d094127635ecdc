"""What a contact, or a power law, makes of a small change of the state. SI units.

The change obeys the linearised equations along the motion, dy/ds = (dt/ds) J(state) y, in physical time and
physical coordinates (p, dp/dt, x, z, vx, vz). It is advanced by the step of the motion itself, from the
motion's own twelve stages: as exact as the motion.

The matrix that corrects a change where the motion switches (saltation) is the identity for these laws: the
force of a stop that yields starts from zero, so that the rates are continuous (Leine and Nijmeijer, Dynamics
and Bifurcations of Non-smooth Mechanical Systems, Springer 2004, section 7.3).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from .compiled import compiled
from .contact import LOG_STAGE_T, LOG_STAGE_W, LOG_STEP, LOGGED
from .contact_flow import FORCE_TERMS, POINT, STAGES, TRIAL, WIDTH, WORK_ROWS, motion_rates, trial_step
from .contact_law import MOST_TERMS
from .parameters import POWER, VX, VY, VZ, Parameters, PowerTerms, Table, Vector, X, Y, Z
from .power_flow import whole_power
from .tangent import keep_in_range

PACE, STIFFNESS, DAMPING = range(3)
"""Columns of a step's slopes, one row a stage: dt/ds, and the derivatives of what presses m1 and m2 together,
k1 p + c1 dp/dt + F, by p [N/m] and by dp/dt [N s/m]."""


class TangentSystem(NamedTuple):
    """The linearised equations over one step."""

    par: Parameters
    slopes: Table
    """Shape (STAGES, 3)."""
    stage: NDArray[np.int64]
    """Shape (1,): the stage that comes next, counted by who writes the rates."""


@compiled
def tangent_rates(at: Vector, rates: Vector, system: TangentSystem) -> None:
    """Write d/ds of a change (p, dp/dt, x, z, vx, vz) at the coming stage."""
    par, slopes = system.par, system.slopes[system.stage[0]]
    system.stage[0] += 1
    pace, p, rate, vx, vz = slopes[PACE], at[0], at[1], at[4], at[5]
    pressing = slopes[STIFFNESS] * p + slopes[DAMPING] * rate
    pull = par.k2 * (at[3] - at[2]) + par.c2 * (vz - vx)
    rates[0] = pace * rate
    rates[1] = pace * (pull / par.mass2 - pressing / par.reduced_mass)
    rates[2] = pace * vx
    rates[3] = pace * vz
    rates[4] = pace * ((pull - par.k0 * at[2] - par.c0 * vx) / par.mass0)
    rates[5] = pace * ((pressing - pull) / par.mass2)
    rates[6] = 0.0
    rates[7] = 0.0


@overload(motion_rates)
def _choose_tangent_rates(
    at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: TangentSystem
) -> Callable[..., None] | None:
    # numba calls this with types, not values, and wants the names of what it returns.
    del at, rates, side, force, middle
    if getattr(system, "instance_class", None) is not TangentSystem:
        return None

    # fmt: off
    def chosen(
        at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: TangentSystem  # noqa: ARG001 - as above
    ) -> None:
        # fmt: on
        tangent_rates(at, rates, system)

    return chosen


@compiled
def power_stiffness(p: float, power: PowerTerms) -> float:
    """Slope of a power law, dF/dp [N/m]; infinite or NaN where it overflows."""
    u = p * power.inverse_reference
    square, grown, exponent, slope = u * u, 1.0, 1, 0.0
    for place in range(MOST_TERMS):
        if power.halves[place] > 0:
            grown *= whole_power(square, power.halves[place])
            exponent += 2 * power.halves[place]
            slope += exponent * power.forces[place] * grown
    result: float = slope * power.inverse_reference
    return result


@compiled
def _fill_slopes(slopes: Table, row: Vector, par: Parameters, power: PowerTerms) -> None:
    """Linearise the force at the stages that a row of a log holds."""
    for stage in range(STAGES):
        pace = row[LOG_STAGE_T + stage]
        slopes[stage, PACE] = pace
        if par.law == POWER:
            slopes[stage, STIFFNESS] = par.k1 + power_stiffness(row[LOG_STAGE_W + stage], power)
            slopes[stage, DAMPING] = par.c1
        else:
            # dt/ds is w, dw/ds is r/2, and the force is w^2 (linear + contact w) (1 + loss r).
            w, r = pace, 2.0 * row[LOG_STAGE_W + stage]
            stiff = par.linear_stiffness + 1.5 * par.contact_stiffness * w
            lossy = w * w * (par.linear_stiffness + par.contact_stiffness * w) * par.loss
            slopes[stage, STIFFNESS] = par.k1 + stiff * (1.0 + par.loss * r)
            slopes[stage, DAMPING] = par.c1 + lossy


@compiled
def carry_through_steps(tangent: Table, log: Table, par: Parameters, power: PowerTerms) -> None:
    """Carry every change over the steps of a wide log."""
    work, unforced = np.zeros((WORK_ROWS, WIDTH)), np.zeros(FORCE_TERMS)
    slopes, stage = np.empty((STAGES, 3)), np.zeros(1, np.int64)
    system = TangentSystem(par, slopes, stage)
    at = work[POINT]
    for change in tangent:
        change[Y] -= change[Z]
        change[VY] -= change[VZ]
    for logged in range(1, int(log[0, LOGGED])):
        _fill_slopes(slopes, log[logged], par, power)
        for change in tangent:
            at[0], at[1], at[2], at[3] = change[Y], change[VY], change[X], change[Z]
            at[4], at[5] = change[VX], change[VZ]
            stage[0] = 0
            tangent_rates(at, work[0], system)
            trial_step(work, log[logged, LOG_STEP], 1.0, unforced, 0.0, system)
            end = work[TRIAL]
            change[Y], change[VY], change[X], change[Z] = end[0], end[1], end[2], end[3]
            change[VX], change[VZ] = end[4], end[5]
    for change in tangent:
        change[Y] += change[Z]
        change[VY] += change[VZ]
        keep_in_range(change)
