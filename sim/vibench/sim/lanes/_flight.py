"""Flight of eight motions side by side: marched on the grid, and looked at where a touch is not excluded.

The rules are those of `vibench.sim.flight`, lane by lane. SI units.
"""

import math

import numpy as np

from ..flight import LONGEST_TURN, NEVER, ROUNDING, TOUCH as CLOSED, first_contact
from ..kernels import (
    Counts,
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
    root,
    store,
)
from ._rows import (
    BOUND,
    CUBE,
    DRIVE,
    DRIVE_TERM,
    FOUR_STEPS,
    FREQUENCY,
    GRID,
    HIGH,
    HIGH_FOUR,
    JERK,
    KEPT,
    LANES,
    LEFT,
    LOW,
    LOW_FOUR,
    NEXT,
    ONE_STEP,
    ORDERS,
    PAIR,
    PERIOD,
    RATE,
    REACH,
    SERIES,
    SQUARE,
    TERM,
    TERMS,
    TOUCH,
)

FOUR = 4.0
NEWTON = 3
"""Corrections to a touch, from a guess of second order; what they leave is checked."""
COSINES = np.array([(-1.0) ** k / math.factorial(2 * k) for k in range(10)])
SINES = np.array([(-1.0) ** k / math.factorial(2 * k + 1) for k in range(10)])
SHRINKING = np.array([1.0 / math.factorial(k) for k in range(7)])
SHORT, LONG = 6, 10
"""Terms for angles up to 0.25 and up to 1."""


@inlined
def count_of(mask: int) -> int:
    """Count the lanes of a mask."""
    count = 0
    for lane in range(LANES):
        count += (mask >> lane) & 1
    return count


@kernel_without_refcount
def bound_flights(at: Table, lanes: int, lower: float, upper: float) -> None:
    """Write bounds of the flights of some lanes from now on.

    Of those alone: a motion is the same whatever lies beside it.
    """
    reach = bound = jerk = eights(0.0)
    for j in range(TERMS):
        re, im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
        size = root(fma(re, re, im * im))
        reach = reach + size
        bound = fma(size, eight(at, SQUARE + j), bound)
        jerk = fma(size, eight(at, CUBE + j), jerk)
    margin = bound * (eight(at, GRID) * eight(at, GRID)) * 0.125
    _store_some(at, REACH, lanes, reach)
    _store_some(at, BOUND, lanes, bound)
    _store_some(at, JERK, lanes, jerk)
    _store_some(at, LOW, lanes, margin - lower)
    _store_some(at, HIGH, lanes, upper - margin)
    _store_some(at, LOW_FOUR, lanes, FOUR * FOUR * margin - lower)
    _store_some(at, HIGH_FOUR, lanes, upper - FOUR * FOUR * margin)


@inlined
def _store_some(at: Table, row: int, lanes: int, values: SimdVector) -> None:
    store(at, row, choose(lanes, values, eight(at, row)))


@inlined
def sum_of_terms(at: Table, first: int) -> SimdVector:
    """Give p."""
    return (eight(at, first) + eight(at, first + 2)) + (eight(at, first + 4) + eight(at, first + 6))


@kernel_without_refcount
def march_lanes(at: Table, moving: int, careful: int, enough: int) -> tuple[int, int, int]:
    """March until ``enough`` lanes or fewer are still clear of the stops, or a state is due in one.

    ``careful`` lanes have found four steps too many. Gives the lanes that still move, those that are
    careful, and those in which a state is due.
    """
    while True:
        p = sum_of_terms(at, TERM)
        four = below(eight(at, LOW_FOUR), p) & below(p, eight(at, HIGH_FOUR)) & ~careful
        clear = moving & below(eight(at, LOW), p) & below(p, eight(at, HIGH))
        for j in range(TERMS):
            re, im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
            by_re = choose(four, eight(at, FOUR_STEPS + 2 * j), eight(at, ONE_STEP + 2 * j))
            by_im = choose(four, eight(at, FOUR_STEPS + 2 * j + 1), eight(at, ONE_STEP + 2 * j + 1))
            store(at, NEXT + 2 * j, fma(re, by_re, -(im * by_im)))
            store(at, NEXT + 2 * j + 1, fma(re, by_im, im * by_re))
        p = sum_of_terms(at, NEXT)
        low = choose(four, eight(at, LOW_FOUR), eight(at, LOW))
        high = choose(four, eight(at, HIGH_FOUR), eight(at, HIGH))
        clear &= below(low, p) & below(p, high)
        for i in range(PAIR):
            store(at, TERM + i, choose(clear, eight(at, NEXT + i), eight(at, TERM + i)))
        grid = eight(at, GRID)
        left = eight(at, LEFT) - choose(clear, choose(four, FOUR * grid, grid), 0.0)
        store(at, LEFT, left)
        careful |= four & ~clear
        moving &= clear | four
        due = clear & ~below(0.0, left)
        if due != 0 or count_of(moving) <= enough:
            return moving, careful, due


@kernel_without_refcount
def keep_due(at: Table, due: int, job_of: Counts, kept: Counts, wanted: Counts, states: Table) -> int:
    """Keep the terms of lanes in which a state is due; gives the lanes that have all that are wanted."""
    over = 0
    for lane in range(LANES):
        if (due >> lane) & 1:
            job = job_of[lane]
            row = states[job, kept[job]]
            for i in range(KEPT - 1):
                row[i] = at[TERM + i, lane]
            row[KEPT - 1] = at[LEFT, lane]
            at[LEFT, lane] += at[PERIOD, lane]
            kept[job] += 1
            if kept[job] == wanted[job]:
                over |= 1 << lane
    return over


@kernel_without_refcount
def look_closely(at: Table, series: Table, one: Vector, asked: int, lower: float, upper: float) -> int:
    """Find the first touch of ``asked`` lanes within the next step; gives those that have one.

    ``series``, shape (ORDERS, LANES), and ``one``, shape (ORDERS,), are workspaces.
    """
    store(series, 0, sum_of_terms(at, TERM))
    for order in range(1, ORDERS):
        rows = SERIES + PAIR * (order - 1)
        value = eight(at, TERM) * eight(at, rows)
        value = fma(-eight(at, TERM + 1), eight(at, rows + 1), value)
        for j in range(1, TERMS):
            value = fma(eight(at, TERM + 2 * j), eight(at, rows + 2 * j), value)
            value = fma(-eight(at, TERM + 2 * j + 1), eight(at, rows + 2 * j + 1), value)
        store(series, order, value)
    bound, reach, grid = eight(at, BOUND), eight(at, REACH), eight(at, GRID)
    rises = below(0.0, eight(series, 1))
    side = choose(rises, 1.0, eights(-1.0))
    near = choose(rises, upper, eights(lower))
    speed, bend = side * eight(series, 1), 2.0 * side * eight(series, 2)
    slowest = bound * grid * LONGEST_TURN
    proved = below(slowest, speed) & below(slowest, fma(bend, grid, speed))
    closed = fma(reach, ROUNDING, CLOSED * min(lower, upper))
    beyond, _ = _at_time(series, grid)
    touches = below(near - side * beyond, closed)
    gap = near - side * eight(series, 0)
    later = 2.0 * gap / (speed + root(fma(speed, speed, 2.0 * bend * gap)))
    step = later
    for _ in range(NEWTON):
        later = choose(below(later, grid), later, grid)
        p, rate = _at_time(series, later)
        step = (near - side * p) / (side * rate)
        later = later + step
    later = choose(below(0.0, later), later, 0.0)
    later = choose(below(later, grid), later, grid)
    proved &= ~touches | below(bound * step * step, closed)
    at_once = below(gap, closed)
    store(at, TOUCH, choose(at_once, 0.0, later))
    touched = asked & proved & (touches | at_once)
    doubtful = asked & ~proved
    if doubtful != 0:
        for lane in range(LANES):
            if (doubtful >> lane) & 1:
                for order in range(ORDERS):
                    one[order] = series[order, lane]
                at[TOUCH, lane] = first_contact(
                    one, at[GRID, lane], lower, upper, at[BOUND, lane], at[REACH, lane]
                )
                if at[TOUCH, lane] != NEVER:
                    touched |= 1 << lane
    return touched


@inlined
def _at_time(series: Table, later: SimdVector) -> tuple[SimdVector, SimdVector]:
    """Give p and its rate on the series."""
    value, rate = eight(series, ORDERS - 1), eights(0.0)
    for order in range(ORDERS - 2, -1, -1):
        rate = fma(rate, later, value)
        value = fma(value, later, eight(series, order))
    return value, rate


@inlined
def cosine_and_sine(angle: SimdVector, terms: int) -> tuple[SimdVector, SimdVector]:
    """Give both, by so many terms of their series."""
    square = angle * angle
    cosine, sine = eights(COSINES[terms - 1]), eights(SINES[terms - 1])
    for k in range(terms - 2, -1, -1):
        cosine = fma(cosine, square, COSINES[k])
        sine = fma(sine, square, SINES[k])
    return cosine, sine * angle


@inlined
def factor_of(at: Table, j: int, later: SimdVector, terms: int) -> tuple[SimdVector, SimdVector]:
    """Give what a mode is multiplied with in a time, by so many terms of cosine and sine."""
    shrinks = eight(at, RATE + 2 * j) * later
    size = eights(SHRINKING[6])
    for k in range(5, -1, -1):
        size = fma(size, shrinks, SHRINKING[k])
    cosine, sine = cosine_and_sine(eight(at, RATE + 2 * j + 1) * later, terms)
    return size * cosine, size * sine


@inlined
def pass_time(at: Table, lanes: int, later: SimdVector) -> None:
    """Let time pass, and put the drive's term where it is then: its rounding never adds up."""
    left = eight(at, LEFT) - choose(lanes, later, 0.0)
    store(at, LEFT, left)
    # Half a turn on, an angle within half a turn: its quarter's fourth power.
    angle = (0.5 - left * eight(at, FREQUENCY)) * (0.5 * math.pi)
    cosine, sine = cosine_and_sine(angle, LONG)
    cosine, sine = fma(cosine, cosine, -(sine * sine)), 2.0 * (cosine * sine)
    cosine, sine = fma(sine, sine, -(cosine * cosine)), -2.0 * (cosine * sine)
    re, im = eight(at, DRIVE), eight(at, DRIVE + 1)
    place = TERM + 2 * DRIVE_TERM
    store(at, place, choose(lanes, fma(re, cosine, -(im * sine)), eight(at, place)))
    store(at, place + 1, choose(lanes, fma(re, sine, im * cosine), eight(at, place + 1)))


@kernel_without_refcount
def turn_lanes(at: Table, lanes: int) -> None:
    """Let some lanes fly to their touch."""
    later = choose(lanes, eight(at, TOUCH), 0.0)
    for j in range(DRIVE_TERM):
        by_re, by_im = factor_of(at, j, later, SHORT)
        re, im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
        store(at, TERM + 2 * j, choose(lanes, fma(re, by_re, -(im * by_im)), re))
        store(at, TERM + 2 * j + 1, choose(lanes, fma(re, by_im, im * by_re), im))
    pass_time(at, lanes, later)


@kernel_without_refcount
def step_lanes(at: Table, lanes: int) -> int:
    """Let some lanes fly a step; gives those in which a state is due."""
    for j in range(TERMS):
        re, im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
        by_re, by_im = eight(at, ONE_STEP + 2 * j), eight(at, ONE_STEP + 2 * j + 1)
        store(at, TERM + 2 * j, choose(lanes, fma(re, by_re, -(im * by_im)), re))
        store(at, TERM + 2 * j + 1, choose(lanes, fma(re, by_im, im * by_re), im))
    left = eight(at, LEFT) - choose(lanes, eight(at, GRID), 0.0)
    store(at, LEFT, left)
    return lanes & ~below(0.0, left)
