"""Collisions of eight motions at once, by polynomials; one that these do not hold, by steps. SI units."""

import math

import numpy as np

from ..collision import (
    COUNTS,
    DERIVATIVES,
    LENGTH,
    MIDDLE,
    MOMENTS,
    PRODUCTS,
    PUSHES,
    VARIABLES,
)
from ..contact import HELD, LEFT as LEAVES, advance_contact, begin_contact
from ..flight import FORCE_TERMS, touched_side
from ..kernels import (
    Complex,
    SimdVector,
    Table,
    Vector,
    below,
    choose,
    eight,
    eights,
    fma,
    inlined,
    kernel_without_refcount,
    magnitude,
    polynomials,
    root,
    store,
)
from ..model import VY, VZ, Y, Z
from ..slots import SIDE, Parameters
from ._flight import SHORT, factor_of, pass_time
from ._rows import (
    DRIVE,
    DRIVE_TERM,
    FREQUENCY,
    GRID,
    JERK,
    KICK,
    LEFT,
    PAIR,
    RATE,
    SERIES,
    TERM,
    TERMS,
)

NEWTON = 3
"""Corrections to the fifth root, from a guess within some per cent."""
HIGHEST = 8
"""Derivative of p that is taken at a touch: a collision is short beside the fastest mode."""
STRETCH_TURN = 0.3
"""Longest stretch of a contact, as drive phase [rad]; as in native/contact.hpp."""
FACTORIALS = np.array([float(math.factorial(k)) for k in range(HIGHEST + 1)])
AWAY = np.array([MIDDLE**k / math.factorial(k) for k in range(HIGHEST + 1)])

evaluate = polynomials(PRODUCTS, COUNTS)


@kernel_without_refcount
def collide_lanes(
    at: Table, lanes: int, final: int, box: Vector, coefficients: Vector, variables: Table, values: Table
) -> int:
    """Carry lanes that touch a stop to the end of their collision; gives those that it could not.

    ``final`` lanes are to stop at the next state that is due, also within a collision. ``box`` holds what
    `vibench.sim.lanes` makes of a fit; ``variables`` and ``values`` are workspaces of VARIABLES and
    POLYNOMIALS rows.
    """
    rate = eights(0.0)
    for j in range(TERMS):
        rate = fma(eight(at, TERM + 2 * j), eight(at, RATE + 2 * j), rate)
        rate = fma(-eight(at, TERM + 2 * j + 1), eight(at, RATE + 2 * j + 1), rate)
    side = choose(below(0.0, rate), 1.0, eights(-1.0))
    speed = magnitude(rate)
    fourth = root(root(speed))
    fifth = fma(fma(fma(fourth, box[0], box[1]), fourth, box[2]), fourth, box[3])
    for _ in range(NEWTON):
        square = fifth * fifth
        fifth = fifth * fma(-0.2 * (speed * square), square * fifth, 1.2)
    unit = box[4] * fifth
    inside = lanes & below(0.0, speed)
    _fill_variables(variables, at, side / speed, unit)
    store(variables, VARIABLES - 1, unit - box[5])
    for k in range(VARIABLES):
        place = eight(variables, k) * box[6 + k]
        store(variables, k, place)
        inside &= below(magnitude(place), 1.0)
    evaluate(variables, coefficients, values)
    length = unit * eight(values, LENGTH)
    inside &= ~(final & below(eight(at, LEFT), length))
    half, push = 0.5 * length, side * speed
    _kick_modes(at, inside, half, unit, push, values)
    pass_time(at, inside, length)
    return lanes & ~inside


@inlined
def _fill_variables(variables: Table, at: Table, scale: SimdVector, unit: SimdVector) -> None:
    """Write the acceleration at the middle of a collision and its derivatives, in units of the collision.

    ``scale`` is side over speed: what the rate of p is multiplied with to be 1.
    """
    for k in range(DERIVATIVES):
        store(variables, k, eights(0.0))
    for order in range(2, HIGHEST + 1):
        rows = SERIES + PAIR * (order - 1)
        value = eights(0.0)
        for j in range(TERMS):
            value = fma(eight(at, TERM + 2 * j), eight(at, rows + 2 * j), value)
            value = fma(-eight(at, TERM + 2 * j + 1), eight(at, rows + 2 * j + 1), value)
        scale = scale * unit
        value = value * scale * FACTORIALS[order]
        for k in range(min(order - 1, DERIVATIVES)):
            store(variables, k, fma(value, AWAY[order - 2 - k], eight(variables, k)))


@inlined
def _kick_modes(
    at: Table, lanes: int, half: SimdVector, unit: SimdVector, push: SimdVector, values: Table
) -> None:
    """Let modes fly half of a collision, take its push about the middle, and fly the other half."""
    for j in range(DRIVE_TERM):
        by_re, by_im = factor_of(at, j, half, SHORT)
        turn_re, turn_im = eight(at, RATE + 2 * j) * unit, eight(at, RATE + 2 * j + 1) * unit
        re, im = (1.0 / (MOMENTS - 1)) * eight(values, PUSHES + MOMENTS - 1), eights(0.0)
        for m in range(MOMENTS - 2, -1, -1):
            re, im = (
                fma(re, turn_re, fma(-im, turn_im, eight(values, PUSHES + m))),
                fma(re, turn_im, im * turn_re),
            )
            if m > 1:
                re, im = (1.0 / m) * re, (1.0 / m) * im
        kick_re, kick_im = push * eight(at, KICK + 2 * j), push * eight(at, KICK + 2 * j + 1)
        was_re, was_im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
        # Half the way, the push about the middle, and the other half.
        middle_re = fma(was_re, by_re, -(was_im * by_im)) + fma(re, kick_re, -(im * kick_im))
        middle_im = fma(was_re, by_im, was_im * by_re) + fma(re, kick_im, im * kick_re)
        store(at, TERM + 2 * j, choose(lanes, fma(middle_re, by_re, -(middle_im * by_im)), was_re))
        store(at, TERM + 2 * j + 1, choose(lanes, fma(middle_re, by_im, middle_im * by_re), was_im))


@kernel_without_refcount
def leaves_clear(at: Table, lanes: int, room: float) -> int:
    """Give those lanes of which the first step away from the stop that was just left is surely clear."""
    rate = bend = eights(0.0)
    for j in range(TERMS):
        re, im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
        rate = fma(re, eight(at, RATE + 2 * j), rate)
        rate = fma(-im, eight(at, RATE + 2 * j + 1), rate)
        bend = fma(re, eight(at, SERIES + PAIR + 2 * j), bend)
        bend = fma(-im, eight(at, SERIES + PAIR + 2 * j + 1), bend)
    speed = magnitude(rate)
    # The series holds half the acceleration.
    half = choose(below(0.0, rate), bend, -bend)
    grid = eight(at, GRID)
    jerk = eight(at, JERK) * (grid * grid) * (1.0 / 6.0)
    end = fma(half, grid, speed)
    farthest = fma(magnitude(half), grid, speed + jerk) * grid
    return lanes & below(jerk, end) & below(farthest, room)


@inlined
def drive_angle(at: Table, lane: int) -> float:
    """Give the drive's phase beyond that once a drive period [rad]."""
    angle: float = -2.0 * math.pi * at[FREQUENCY, lane] * at[LEFT, lane]
    return angle


@kernel_without_refcount
def contact_by_steps(
    at: Table,
    lane: int,
    is_final: int,
    state: Vector,
    force: Vector,
    work: Table,
    shapes: Complex,
    onto: Complex,
    base: complex,
    par: Parameters,
    tolerance: float,
) -> int:
    """Carry one lane through a contact by steps; in the last period to the state that is due, at most.

    ``shapes``, shape (TERMS, 6), is the motion of a unit of each term, ``onto``, shape (3, 6), what a state
    adds to the terms of the modes, ``base`` the base force once a drive period. Gives 1 where the contact is
    over, 0 where the state that is due was reached within it, and -1 where it was lost.
    """
    _fill_state(state, at, lane, shapes)
    side = touched_side(state[Y] - state[Z], state[VY] - state[VZ], par.lower, par.upper)
    begin_contact(state, side, par, tolerance)
    omega = 2.0 * math.pi * at[FREQUENCY, lane]
    while state[SIDE] != 0.0:
        middle = 0.5 * STRETCH_TURN / omega
        if is_final:
            middle = min(middle, 0.5 * at[LEFT, lane])
        angle = drive_angle(at, lane) + omega * middle
        term = base * complex(math.cos(angle), math.sin(angle))
        for k in range(FORCE_TERMS):
            force[k] = term.real
            term *= complex(0.0, omega / (k + 1.0))
        code, length = advance_contact(state, 0.0, 2.0 * middle, force, middle, par, tolerance, work)
        if code not in (LEAVES, HELD):
            return -1
        at[LEFT, lane] -= length
        if is_final and state[SIDE] != 0.0 and at[LEFT, lane] <= 0.0:
            return 0
    _take_off(at, lane, state, shapes, onto)
    return 1


@kernel_without_refcount
def _fill_state(state: Vector, at: Table, lane: int, shapes: Complex) -> None:
    """Write the state of a lane in flight."""
    for i in range(len(state)):
        state[i] = 0.0
    for i in range(6):
        for j in range(TERMS):
            shape = shapes[j, i]
            state[i] += at[TERM + 2 * j, lane] * shape.real - at[TERM + 2 * j + 1, lane] * shape.imag


@kernel_without_refcount
def _take_off(at: Table, lane: int, state: Vector, shapes: Complex, onto: Complex) -> None:
    """Write the terms of a lane from its state, of which only what is free is left."""
    angle = drive_angle(at, lane)
    drive = complex(at[DRIVE, lane], at[DRIVE + 1, lane]) * complex(math.cos(angle), math.sin(angle))
    at[TERM + 2 * DRIVE_TERM, lane], at[TERM + 2 * DRIVE_TERM + 1, lane] = drive.real, drive.imag
    for i in range(6):
        shape = shapes[DRIVE_TERM, i]
        state[i] -= drive.real * shape.real - drive.imag * shape.imag
    for j in range(DRIVE_TERM):
        value = complex(0.0, 0.0)
        for i in range(6):
            value += onto[j, i] * state[i]
        at[TERM + 2 * j, lane], at[TERM + 2 * j + 1, lane] = value.real, value.imag
