"""The last step of a contact, cut to where it must end: at the exit, or at an instant. SI units."""

import numpy as np

from ..kernels.arrays import Table, Vector
from ..kernels.compile import kernel_without_refcount
from .flow import POINT, SPARE, TRIAL, R, System, W, motion_rates, places_of, trial_step

MOST_CORRECTIONS = 100
"""Bracketed Newton always ends by bisection before this."""
GUESSES = 4
"""Newton steps on a quintic: from a straight line to rounding, nearly always."""


@kernel_without_refcount
def step_to_exit(
    work: Table,
    longest: float,
    side: float,
    force: Vector,
    middle: float,
    system: System,
    close: float,
    near: float,
) -> float:
    """Shorten the trial step until it ends at w = 0; ``work[TRIAL]`` is past it. Gives the step taken."""
    low, high, step = 0.0, longest, longest
    guess = _where_root_ends(work, longest, side, force, middle, system)
    if 0.0 < guess < longest:
        step = guess
        trial_step(work, step, side, force, middle, system)
    for _ in range(MOST_CORRECTIONS):
        w, slope = work[TRIAL, W], 0.5 * work[TRIAL, R]
        if abs(w) <= close:
            break
        if abs(w) <= near and slope < 0.0:
            _slip_to_exit(work, side, force, middle, system)
            break
        if w > 0.0:
            low = step
        else:
            high = step
        step = step - w / slope if slope < 0.0 else low
        if not low < step < high:
            step = 0.5 * (low + high)
            if not low < step < high:
                break
        trial_step(work, step, side, force, middle, system)
    return step


@kernel_without_refcount
def _where_root_ends(
    work: Table, longest: float, side: float, force: Vector, middle: float, system: System
) -> float:
    """Guess the step to w = 0 within the trial step, by the quintic through both its ends."""
    motion_rates(work[TRIAL], work[SPARE], side, force, middle, system)
    h = longest
    w0, slope0, bend0 = work[POINT, W], h * work[0, W], 0.5 * h * h * work[0, R]
    w1, slope1, bend1 = work[TRIAL, W], h * work[SPARE, W], 0.5 * h * h * work[SPARE, R]
    rise, turn, change = w1 - w0 - slope0 - 0.5 * bend0, slope1 - slope0 - bend0, bend1 - bend0
    third = 10.0 * rise - 4.0 * turn + 0.5 * change
    fourth = -15.0 * rise + 7.0 * turn - change
    fifth = 6.0 * rise - 3.0 * turn + 0.5 * change
    part = w0 / (w0 - w1)
    for _ in range(GUESSES):
        upper = third + part * (fourth + part * fifth)
        w = w0 + part * (slope0 + part * (0.5 * bend0 + part * upper))
        slope = slope0 + part * (bend0 + part * (3.0 * third + part * (4.0 * fourth + part * 5.0 * fifth)))
        part -= w / slope
    step: float = part * h
    return step


@kernel_without_refcount
def _slip_to_exit(work: Table, side: float, force: Vector, middle: float, system: System) -> None:
    """Go the last hair to w = 0 without a step: all rates but that of w are in proportion to w itself.

    Their mean over the hair is half of what they are at its start; what is left out is of its third order.
    """
    motion_rates(work[TRIAL], work[SPARE], side, force, middle, system)
    hair = -work[TRIAL, W] / work[SPARE, W]
    for i in range(places_of(system)):
        work[TRIAL, i] += 0.5 * hair * work[SPARE, i]
    work[TRIAL, W] = 0.0


@kernel_without_refcount
def step_to_time(
    work: Table,
    longest: float,
    time: int,
    limit: float,
    side: float,
    force: Vector,
    middle: float,
    system: System,
) -> float:
    """Shorten the trial step until its place ``time``, with the rate w, is at the limit, past which it goes.

    Gives the step taken.
    """
    low, high, step = 0.0, longest, longest
    # A few units in the last place of the stretch: closer than that, time itself has no digits.
    close = 4.0 * np.finfo(np.float64).eps * (abs(limit) + abs(work[POINT, time]))
    for _ in range(MOST_CORRECTIONS):
        late, slope = work[TRIAL, time] - limit, work[TRIAL, W]
        if abs(late) <= close:
            break
        if late < 0.0:
            low = step
        else:
            high = step
        step = step - late / slope if slope > 0.0 else low
        if not low < step < high:
            step = 0.5 * (low + high)
            if not low < step < high:
                break
        trial_step(work, step, side, force, middle, system)
    work[TRIAL, time] = limit
    return step
