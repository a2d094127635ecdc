"""One step under a power law: the force at eight points, found by substitution, and where it leads. SI units.

The force at the points determines p there, and p the force: put in one after the other, the answers settle
like the terms of a cosine. How well one polynomial describes the force is seen at both ends of the step,
where F is known too; the end itself errs by the square of that, for Gauss's points forgive the first error.
"""

import math
from typing import NamedTuple

import numpy as np

from ..flight import AT_X, AT_Z, COSINE, P_RATE, SINE, WIDE, X_RATE, Z_RATE, FlightTables, P, drive_phasor
from ..kernels import Table, Vector, eight, eight_of_eight, eights, inlined, kernel, largest, store, total
from ..model import VX, VY, VZ, X, Y, Z
from ..slots import LEVEL, SCALES, SIDE, Parameters, PowerTerms
from ._flow import power_force, power_forces, stiffest_rate
from ._numbers import ALL_ROWS, FEED, FREE, GAIN, MOVE, POINTS
from ._tables import AT_END, AT_START, COURSE, COURSE_DEGREE, LEVELS, POINTS_AT, PowerTables

FIT = 1e4
"""Allowed misfit of the force's polynomial at the ends of a step, over the tolerance: as motion that it would
make, over the size of the motion. Between the ends a motion errs by a ten-thousandth of it, at the ends by
far less: after seconds the state by a tenth of the tolerance."""
CLOSE = 1e-2
CLOSEST = 1e-14
"""Substitution ends when the motion changes by this part of the tolerance, or of itself."""
MOST_SUBSTITUTIONS = 30
TRY_LONGER = 0.015
"""A step is followed by a longer one if its misfit was this part of what is allowed: an eighth-degree misfit
grows 32 times."""
FAR_TOO_LONG = 20.0
"""A misfit beyond this many times what is allowed is answered by half the length at once."""
WALL_TURN = 5.0
"""A step turns the stiffest spring on its way by this much at most, or it might pass a wall unseen [rad]."""
FADING = 0.98
"""How much of its past size a motion keeps from step to step."""
SMALLEST_PART = 1e-3
"""A displacement counts as at least this part of the largest one."""
NOTHING_MOVES = 1e-150
FIRST_LEVEL = 8
"""Of the first step of all: a sixteenth of the longest."""
SIZE_P, SIZE_X, SIZE_Z = SCALES, SCALES + 2, SCALES + 3
"""How large p, x, z have lately been, in the state."""
NO_COURSE = 0.0
"""Length of the last step where there is none."""


class PowerStepState(NamedTuple):
    """Where a run stands between two steps, and workspaces."""

    motion: Vector
    """The eight numbers of `vibench.sim.power_law`."""
    ahead: Vector
    """The same at the end of a step."""
    force: Vector
    """F at the points [N]."""
    place: Vector
    """p at the points [m]."""
    course: Vector
    """F's course in the last step, by powers of (s - 1)."""
    sizes: Vector
    """How large p, x, z have lately been [m]."""
    push: Vector
    """F where the run stands and at a step's end [N]; the length of the last step [s], 0 if there is none."""
    other: Table
    """Numbers of a step that ends where one must."""


PUSH_NOW, PUSH_AHEAD, LAST_LENGTH = range(3)


@kernel
def new_power_step() -> PowerStepState:
    """Make the memory of a run."""
    return PowerStepState(
        np.zeros(WIDE),
        np.zeros(WIDE),
        np.zeros(POINTS),
        np.zeros(POINTS),
        np.zeros(WIDE),
        np.zeros(3),
        np.zeros(3),
        np.zeros((ALL_ROWS, WIDE)),
    )


@inlined
def begin_power_step(step: PowerStepState, state: Vector, power: PowerTerms) -> None:
    """Stand at a state; the drive's phase is not its concern."""
    motion = step.motion
    motion[P], motion[P_RATE] = state[Y] - state[Z], state[VY] - state[VZ]
    motion[AT_X], motion[X_RATE] = state[X], state[VX]
    motion[AT_Z], motion[Z_RATE] = state[Z], state[VZ]
    step.push[PUSH_NOW] = power_force(motion[P], power)
    step.push[LAST_LENGTH] = 0.0
    step.sizes[0], step.sizes[1], step.sizes[2] = state[SIZE_P], state[SIZE_X], state[SIZE_Z]


@inlined
def write_motion(out: Vector, motion: Vector) -> None:
    """Write (x, y, z, vx, vy, vz)."""
    out[X], out[Z], out[Y] = motion[AT_X], motion[AT_Z], motion[AT_Z] + motion[P]
    out[VX], out[VZ], out[VY] = motion[X_RATE], motion[Z_RATE], motion[Z_RATE] + motion[P_RATE]


@inlined
def end_power_step(step: PowerStepState, state: Vector, level: int) -> None:
    """Leave a state behind from which `begin_power_step` goes on."""
    write_motion(state, step.motion)
    state[SIDE], state[LEVEL] = 1.0, level + 1.0
    state[SIZE_P], state[SIZE_X], state[SIZE_Z] = step.sizes[0], step.sizes[1], step.sizes[2]


@inlined
def set_drive(motion: Vector, clock: Vector, tables: FlightTables) -> None:
    """Write the drive's phase as the clock has it."""
    phasor = drive_phasor(clock, 0.0, tables)
    motion[COSINE], motion[SINE] = phasor.real, phasor.imag


@inlined
def _widen(size: float, one: float, other: float) -> float:
    return max(FADING * size, abs(one), abs(other))


@inlined
def level_that_sees(
    level: int, motion: Vector, par: Parameters, power: PowerTerms, steps: PowerTables
) -> int:
    """Find the first level from ``level`` on whose step passes no wall unseen; LEVELS if there is none."""
    p, rate = motion[P], motion[P_RATE]
    outward = max(rate if p >= 0.0 else -rate, 0.0)
    while level < LEVELS:
        length = steps.lengths[level]
        if length * stiffest_rate(abs(p) + outward * length, par.k1, par.inverse_pair, power) <= WALL_TURN:
            break
        level += 1
    return level


@inlined
def _guess_force(step: PowerStepState, length: float) -> None:
    """Guess F in a step of ``length`` [s]: its course in the last one goes on."""
    course, last = step.course, step.push[LAST_LENGTH]
    if last == NO_COURSE:
        store(step.force, 0, eights(step.push[PUSH_NOW]))
        return
    s = (length / last) * eight(POINTS_AT, 0)
    value = eights(course[COURSE_DEGREE])
    for degree in range(COURSE_DEGREE - 1, -1, -1):
        value = value * s + course[degree]
    store(step.force, 0, value)


@inlined
def _keep_course(step: PowerStepState, length: float) -> None:
    """Remember how F went in the step just made."""
    end = step.push[PUSH_AHEAD] * eight(COURSE, POINTS)
    store(step.course, 0, end + eight_of_eight(COURSE, 0, step.force))
    step.push[LAST_LENGTH] = length


@inlined
def substitute(step: PowerStepState, numbers: Table, weight: float, close: float, power: PowerTerms) -> bool:
    """Find the force at the points of a step from its guess; false when it does not settle, or overflows.

    ``weight`` says how far a newton moves p over the step [m/N], ``close`` how far is nothing.
    """
    free = eight_of_eight(numbers, FREE, step.motion)
    force, place, settled = eight(step.force, 0), free, False
    for _ in range(MOST_SUBSTITUTIONS):
        place = free + eight_of_eight(numbers, GAIN, force)
        push = power_forces(place, power)
        change = weight * largest(push - force)
        force = push
        if not change > close:
            settled = change <= close
            break
    store(step.force, 0, force)
    store(step.place, 0, place)
    return settled


@inlined
def largest_unseen(step: PowerStepState) -> float:
    """Size against which errors count: of the smallest of the three displacements, up to the step's end."""
    motion, ahead, sizes = step.motion, step.ahead, step.sizes
    p = max(sizes[0], abs(motion[P]), abs(ahead[P]))
    x = max(sizes[1], abs(motion[AT_X]), abs(ahead[AT_X]))
    z = max(sizes[2], abs(motion[AT_Z]), abs(ahead[AT_Z]))
    size: float = max(min(p, x, z), SMALLEST_PART * max(p, x, z)) + NOTHING_MOVES
    return size


@inlined
def try_step(
    step: PowerStepState, numbers: Table, length: float, tolerance: float, par: Parameters, power: PowerTerms
) -> float:
    """Try a step and write where it leads to ``stride.ahead``; gives its misfit over what is allowed."""
    motion, ahead, force = step.motion, step.ahead, step.force
    weight = length * length * par.inverse_pair
    free = eight(motion, 0) + eight_of_eight(numbers, MOVE, motion)
    store(ahead, 0, free)
    close = largest_unseen(step) * max(CLOSE * tolerance, CLOSEST)
    _guess_force(step, length)
    if not substitute(step, numbers, weight, close, power):
        return math.inf
    push = eight(force, 0)
    store(ahead, 0, free + eight_of_eight(numbers, FEED, push))
    end = power_force(ahead[P], power)
    before = total(eight(AT_START, 0) * push) - step.push[PUSH_NOW]
    after = total(eight(AT_END, 0) * push) - end
    step.push[PUSH_AHEAD] = end
    misfit: float = weight * max(abs(before), abs(after)) / (FIT * tolerance * largest_unseen(step))
    return misfit


@inlined
def accept_step(step: PowerStepState, length: float) -> None:
    """Stand where the step just tried has led; the drive's phase is to be set."""
    motion, ahead, sizes = step.motion, step.ahead, step.sizes
    sizes[0] = _widen(sizes[0], motion[P], ahead[P])
    sizes[1] = _widen(sizes[1], motion[AT_X], ahead[AT_X])
    sizes[2] = _widen(sizes[2], motion[AT_Z], ahead[AT_Z])
    _keep_course(step, length)
    step.push[PUSH_NOW] = step.push[PUSH_AHEAD]
    store(motion, 0, eight(ahead, 0))


@inlined
def level_after(level: int, misfit: float) -> int:
    """Choose the level of the next step, or of another try."""
    if misfit > 1.0:
        return level + 1 if misfit < FAR_TOO_LONG else level + 2
    return level - 1 if misfit < TRY_LONGER and level > 0 else level
