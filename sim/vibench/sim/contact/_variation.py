"""What a contact makes of a small change of the state. SI units.

The change obeys the linearised equations along the motion, dy/ds = (dt/ds) J(state) y, in physical time and
physical coordinates (p, dp/dt, x, z, vx, vz). It is advanced by the step of the motion itself, from the
motion's own twelve stages: as exact as the motion.

The matrix that corrects a change where the motion switches (saltation) is the identity for these laws: the
force of a stop that yields starts from zero, so that the rates are continuous (Leine and Nijmeijer, Dynamics
and Bifurcations of Non-smooth Mechanical Systems, Springer 2004, section 7.3).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..flight import FORCE_TERMS
from ..kernels import Table, Vector, inlined, kernel, kernel_without_refcount
from ..model import VX, VY, VZ, X, Y, Z
from ..slots import Parameters, keep_in_range
from ._contact import LOG_STAGE_T, LOG_STAGE_W, LOG_STEP, LOGGED
from ._flow import POINT, STAGES, TRIAL, WIDTH, WORK_ROWS, rates_of, trial_step

STEP_TIME, PRESS_P, PRESS_RATE = range(3)
"""Columns of a step's slopes, one row a stage: dt/ds, and the derivatives of what presses m1 and m2 together,
k1 p + c1 dp/dt + F, by p [N/m] and by dp/dt [N s/m]."""


class Links(NamedTuple):
    """Springs and dampers over masses, for a kernel that must not divide."""

    pull_spring: float
    pull_damper: float
    base_spring: float
    base_damper: float
    light0: float
    """1 / m0 [1/kg]."""
    light2: float
    light_pair: float
    """1/m1 + 1/m2 [1/kg]."""


class TangentSystem(NamedTuple):
    """The linearised equations over one step."""

    links: Links
    slopes: Table
    """Shape (STAGES, 3)."""
    stage: NDArray[np.int64]
    """Shape (1,): the stage that comes next, counted by who writes the rates."""


@rates_of(TangentSystem)
@inlined
def tangent_rates(
    at: Vector,
    rates: Vector,
    side: float,  # noqa: ARG001 - of the motion, not of a change
    force: Vector,  # noqa: ARG001
    middle: float,  # noqa: ARG001
    system: TangentSystem,
) -> None:
    """Write d/ds of a change (p, dp/dt, x, z, vx, vz) at the coming stage."""
    links, stage = system.links, system.stage[0]
    system.stage[0] = stage + 1
    pace = system.slopes[stage, STEP_TIME]
    rate, vx, vz = pace * at[1], pace * at[4], pace * at[5]
    pressing = pace * system.slopes[stage, PRESS_P] * at[0] + system.slopes[stage, PRESS_RATE] * rate
    pull = pace * links.pull_spring * (at[3] - at[2]) + links.pull_damper * (vz - vx)
    rates[0] = rate
    rates[1] = links.light2 * pull - links.light_pair * pressing
    rates[2] = vx
    rates[3] = vz
    rates[4] = links.light0 * (pull - (pace * links.base_spring * at[2] + links.base_damper * vx))
    rates[5] = links.light2 * (pressing - pull)
    rates[6] = 0.0
    rates[7] = 0.0


@kernel_without_refcount
def _fill_slopes(slopes: Table, row: Vector, par: Parameters) -> None:
    """Linearise the force at the stages that a row of a log holds."""
    for stage in range(STAGES):
        # dt/ds is w, dw/ds is r/2, and the force is w^2 (linear + contact w) (1 + loss r).
        w, r = row[LOG_STAGE_T + stage], 2.0 * row[LOG_STAGE_W + stage]
        stiff = par.linear_stiffness + 1.5 * par.contact_stiffness * w
        lossy = w * w * (par.linear_stiffness + par.contact_stiffness * w) * par.loss
        slopes[stage, STEP_TIME] = w
        slopes[stage, PRESS_P] = par.k1 + stiff * (1.0 + par.loss * r)
        slopes[stage, PRESS_RATE] = par.c1 + lossy


def tangent_workspace() -> Table:
    """Memory that one run hands to every contact."""
    return np.zeros((WORK_ROWS + STAGES, WIDTH))


@kernel
def propagate_tangent_steps(tangent: Table, log: Table, par: Parameters, memory: Table) -> None:
    """Carry every change over the steps of a wide log."""
    work, slopes, unforced = memory[:WORK_ROWS], memory[WORK_ROWS:], log[0, :FORCE_TERMS]
    stage = np.zeros(1, np.int64)
    links = Links(par.k2, par.c2, par.k0, par.c0, 1.0 / par.mass0, 1.0 / par.mass2, 1.0 / par.reduced_mass)
    system = TangentSystem(links, slopes, stage)
    at, end = work[POINT], work[TRIAL]
    for change in tangent:
        change[Y] -= change[Z]
        change[VY] -= change[VZ]
    for logged in range(1, int(log[0, LOGGED])):
        _fill_slopes(slopes, log[logged], par)
        for change in tangent:
            at[0], at[1], at[2], at[3] = change[Y], change[VY], change[X], change[Z]
            at[4], at[5] = change[VX], change[VZ]
            stage[0] = 0
            tangent_rates(at, work[0], 1.0, unforced, 0.0, system)
            trial_step(work, log[logged, LOG_STEP], 1.0, unforced, 0.0, system)
            change[Y], change[VY], change[X], change[Z] = end[0], end[1], end[2], end[3]
            change[VX], change[VZ] = end[4], end[5]
    for change in tangent:
        change[Y] += change[Z]
        change[VY] += change[VZ]
        keep_in_range(change)
