"""What is observed of a whole collision: its peaks and its lines. SI units."""

from ..contact import hermite_peak
from ..engine import POINTS, TERMS
from ..flight import AT_X, COSINE, SINE, X_RATE
from ..kernels import (
    SimdVector,
    Vector,
    eight_of_eight,
    eight_of_sixteen,
    inlined,
    kernel_without_refcount,
    largest,
    sixteen,
    sixteen_of_sixteen,
    store,
    total,
)
from ..slots import LINE_P_IM, LINE_P_RE, LINE_X_IM, LINE_X_RE, MODE, PEAK_P, PEAK_X, PEAKS_AND_LINES
from ._collision import ACROSS, ACROSS_RATE, DEEPER_BY, DEPTHS, FORCE, UNIT, Collision
from ._sums import at_heights, pushed
from ._tables import CollisionTables, top_of

FIRST_OF_FORCE = 2
"""A force reaches x by way of m2 and a damper: two integrals later."""
LAST_OF_FORCE = 5
ABOVE_POINTS = 1.03
"""The largest depth is at most this many times the largest one at the points."""


@inlined
def observe_collision(
    observations: Vector,
    collision: Collision,
    duration: float,
    gap: float,
    omega: float,
    collisions: CollisionTables,
) -> None:
    """Add a collision that lasted for ``duration``; what is odd in the side has both signs squared away."""
    motion, after = collision.motion, collision.after
    store(collision.course, 0, eight_of_eight(collisions.onto_x, 0, motion))
    observations[PEAK_X] = max(observations[PEAK_X], abs(motion[AT_X]), abs(after[AT_X]))
    if motion[X_RATE] * after[X_RATE] < 0.0:
        observations[PEAK_X] = _turning_peak(observations[PEAK_X], collision, duration, collisions)
    if observations[MODE] == PEAKS_AND_LINES:
        _add_lines(observations, collision, duration, gap, omega, collisions)
    # The course of x is needed no more.
    observations[PEAK_P] = deepest_of(observations[PEAK_P], collision, gap, collisions)


@inlined
def deepest_of(best: float, collision: Collision, gap: float, collisions: CollisionTables) -> float:
    """Largest abs(p) of a collision, or ``best`` if that is larger; the course of p or x is written over."""
    unit, depths = collision.deepest[UNIT] * collision.deepest[DEEPER_BY], collision.workspace[DEPTHS]
    if gap + unit * ABOVE_POINTS * largest(sixteen(depths, 0)) > best:
        store(collision.course, 0, eight_of_sixteen(collisions.about_middle, 0, depths))
        best = max(best, gap + unit * top_of(collision.course))
    return best


@inlined
def _add_lines(
    observations: Vector,
    collision: Collision,
    duration: float,
    gap: float,
    omega: float,
    collisions: CollisionTables,
) -> None:
    """Add the integrals of x and p against the drive, by Gauss's sums in phi."""
    _fill_across(collision, duration, collisions)
    workspace, drive = collision.workspace, collision.motion
    angle, weight = (
        omega * duration * sixteen(collisions.heights, 0),
        duration * sixteen(collisions.weights, 0),
    )
    square = angle * angle
    cosine, sine = weight * cosine_of(square), weight * (angle * sine_over(square))
    along = drive[COSINE] * cosine - drive[SINE] * sine
    across = drive[COSINE] * sine + drive[SINE] * cosine
    x, p = sixteen(workspace, ACROSS), gap + collision.deepest[UNIT] * sixteen(workspace, DEPTHS)
    observations[LINE_X_RE] += total(x * along)
    observations[LINE_X_IM] -= total(x * across)
    observations[LINE_P_RE] += total(p * along)
    observations[LINE_P_IM] -= total(p * across)


@inlined
def cosine_of(square: SimdVector) -> SimdVector:
    """Cosine of angles below `vibench.sim.collision.LONGEST_TURN`, from their squares: to 3e-11."""
    return 1.0 + square * (
        -1.0 / 2.0 + square * (1.0 / 24.0 + square * (-1.0 / 720.0 + square * (1.0 / 40320.0)))
    )


@inlined
def sine_over(square: SimdVector) -> SimdVector:
    """Sine over the angle, likewise."""
    return 1.0 + square * (
        -1.0 / 6.0 + square * (1.0 / 120.0 + square * (-1.0 / 5040.0 + square * (1.0 / 362880.0)))
    )


@inlined
def _fill_across(collision: Collision, duration: float, collisions: CollisionTables) -> None:
    """Write x at the points."""
    workspace, turn = collision.workspace, collisions.fastest * duration
    free = collision.motion[AT_X] + at_heights(collision.course, turn * sixteen(collisions.heights, 0))
    store(
        workspace,
        ACROSS,
        free + pushed(workspace[FORCE], FIRST_OF_FORCE, LAST_OF_FORCE, AT_X, duration, collisions),
    )


@inlined
def _fill_across_rate(collision: Collision, duration: float, collisions: CollisionTables) -> None:
    """Write vx at the points."""
    workspace, turn, course = collision.workspace, collisions.fastest * duration, collision.course
    turns, factor = turn * sixteen(collisions.heights, 0), turn
    rate = 0.0 * turns
    for term in range(TERMS - 1, 0, -1):
        rate = rate * turns + term * collisions.fastest * course[term]
    for term in range(FIRST_OF_FORCE, LAST_OF_FORCE):
        factor *= turn
        onto = sixteen_of_sixteen(collisions.shares[term - 1], 0, workspace[FORCE])
        rate += term * factor * collisions.struck[term, AT_X] * onto
    store(workspace, ACROSS_RATE, rate)


@kernel_without_refcount
def _turning_peak(best: float, collision: Collision, duration: float, collisions: CollisionTables) -> float:
    """Largest magnitude of x in a collision in which it turns."""
    workspace, motion, after = collision.workspace, collision.motion, collision.after
    _fill_across(collision, duration, collisions)
    _fill_across_rate(collision, duration, collisions)
    before, x, rate = 0.0, motion[AT_X], motion[X_RATE]
    for i in range(POINTS):
        step = duration * (collisions.heights[i] - before)
        best = hermite_peak(best, x, rate, workspace[ACROSS, i], workspace[ACROSS_RATE, i], step)
        before, x, rate = collisions.heights[i], workspace[ACROSS, i], workspace[ACROSS_RATE, i]
    return hermite_peak(best, x, rate, after[AT_X], after[X_RATE], duration * (1.0 - before))
