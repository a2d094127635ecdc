"""What a rigid stop does to m1: it throws it back, or holds it. SI units.

An impact leaves places and the momentum of the pair alone and turns the speed of approach into
``restitution`` times itself (Newton). Pressed on the stop by the acceleration a, m1 hops: each hop lasts
``restitution`` times the one before, 2 v / a, and all of them together 2 v / (a (1 - restitution)), which is
finite: chatter, an infinity of impacts. They are followed one by one while they can be told from
rest, and the rest of the series is summed: m1 is then held.
"""

import math

from ..contact import gap_of
from ..flight import ROUNDING, TOUCH
from ..kernels import Vector, kernel_without_refcount
from ..model import VX, VY, VZ, X, Y, Z
from ..slots import CLOSED, SIDE, Parameters

RESOLVED = 4.0
"""Hops lower than this many times the gap that counts as closed cannot be told from rest."""

LARGEST_PART = 1e-3
"""... and of the room between the stops that gap may be this part."""


@kernel_without_refcount
def closed_gap(scale: float, par: Parameters) -> float:
    """How far from a stop m1 counts as touching it [m]; ``scale`` as in `vibench.sim.flight`."""
    closed: float = TOUCH * min(par.lower, par.upper) + ROUNDING * scale
    return closed


@kernel_without_refcount
def is_resolved(closed: float, par: Parameters) -> bool:
    """Whether m1 between its stops can be told from m1 on one of them: not where p is rounding."""
    return closed < LARGEST_PART * (par.lower + par.upper)


@kernel_without_refcount
def press_on(side: float, state: Vector, par: Parameters) -> float:
    """Acceleration with which m1 is pressed on the stop at its side, d2|p|/dt2 if the stop were not [m/s^2].

    Times the reduced mass it is the force between m1 and the stop that holds it.
    """
    pull = par.k2 * (state[Z] - state[X]) + par.c2 * (state[VZ] - state[VX])
    inner = par.k1 * gap_of(side, par.lower, par.upper) + par.c1 * (side * (state[VY] - state[VZ]))
    press: float = side * pull / par.mass2 - inner / par.reduced_mass
    return press


@kernel_without_refcount
def place_on_stop(state: Vector, side: float, rate: float, par: Parameters) -> None:
    """Put m1 exactly on a stop, with ``rate`` = d|p|/dt [m/s]; the pair keeps its centre and its momentum."""
    gap = side * gap_of(side, par.lower, par.upper)
    before, relative = state[Y] - state[Z], state[VY] - state[VZ]
    share = par.reduced_mass / par.mass2
    state[Z] -= share * (gap - before)
    state[VZ] -= share * (side * rate - relative)
    state[Y] = state[Z] + gap
    state[VY] = state[VZ] + side * rate


@kernel_without_refcount
def rebound(state: Vector, side: float, par: Parameters, restitution: float, tolerance: float) -> None:
    """Strike a rigid stop; ``state[SIDE]`` says whether m1 stays on it.

    The touch was called a hair before the gap had closed; the speed is what it will be when it has, so that
    a million impacts do not lose a million hairs.
    """
    short = gap_of(side, par.lower, par.upper) - side * (state[Y] - state[Z])
    approach = side * (state[VY] - state[VZ])
    speed = math.sqrt(max(approach * approach + 2.0 * press_on(side, state, par) * short, 0.0))
    place_on_stop(state, side, -restitution * speed, par)
    hold_if_pressed(state, side, par, restitution, tolerance)


@kernel_without_refcount
def hold_if_pressed(
    state: Vector, side: float, par: Parameters, restitution: float, tolerance: float
) -> None:
    """Hold m1, which stands on a stop or leaves it, if the impacts still to come are too small to follow.

    Those are left out whose hops cannot be told from rest, and those whose speeds add up to less than
    the tolerance times the speed of a fall through the gap: v / (1 - restitution) < tolerance sqrt(2 a gap).
    """
    rate = state[VY] - state[VZ]
    press = press_on(side, state, par)
    gap = gap_of(side, par.lower, par.upper)
    part = tolerance * (1.0 - restitution)
    too_low = RESOLVED * state[CLOSED] + part * part * gap
    if press >= 0.0 and rate * rate <= 2.0 * press * too_low:
        place_on_stop(state, side, 0.0, par)
        state[SIDE] = side


@kernel_without_refcount
def place_between_rigid_stops(state: Vector, par: Parameters, restitution: float, tolerance: float) -> None:
    """Decide whether a motion that is given starts held by a stop; one beyond a stop is put on it."""
    p = state[Y] - state[Z]
    side = math.copysign(1.0, p)
    short = gap_of(side, par.lower, par.upper) - side * p
    state[CLOSED] = closed_gap(abs(state[X]) + abs(state[Y]) + abs(state[Z]), par)
    if short <= state[CLOSED]:
        place_on_stop(state, side, side * (state[VY] - state[VZ]), par)
        hold_if_pressed(state, side, par, restitution, tolerance)
