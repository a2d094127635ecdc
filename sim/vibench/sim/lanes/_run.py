"""A queue of motions followed in eight lanes: a lane that has finished takes the next one. SI units."""

import numpy as np

from ..collision import POLYNOMIALS, VARIABLES
from ..contact import contact_workspace
from ..flight import FORCE_TERMS, LARGEST_BOUND
from ..kernels import Complex, Counts, Table, Vector, below, eight, eights, fma, kernel, store
from ..slots import STATE_SIZE, Parameters
from ._collision import collide_lanes, contact_by_steps, leaves_clear
from ._flight import (
    LONG,
    bound_flights,
    count_of,
    factor_of,
    keep_due,
    look_closely,
    march_lanes,
    step_lanes,
    turn_lanes,
)
from ._rows import BOUND, COLUMN, DRIVE, LANES, LEFT, ONE_STEP, ORDERS, PAIR, RATE, ROWS, TERM, TERMS

ALL = (1 << LANES) - 1
NOBODY = -1
WAITING = 1
"""Lanes that may still march while the others wait for the next event: waiting is cheaper than an event in
half of the lanes."""
MOST_EVENTS = 10_000
"""In a drive period, on average: far beyond any motion of a specimen."""
FOLLOWED, IN_CONTACT, FAILED = range(3)
"""How a motion ends: in flight; in contact, by its state; not at all."""


@kernel
def run_lanes(  # noqa: C901, PLR0912, PLR0915 - the phases and their ends are one loop
    columns: Table,
    shapes: Complex,
    bases: Complex,
    onto: Complex,
    wanted: Counts,
    par: Parameters,
    tolerance: float,
    box: Vector,
    coefficients: Vector,
    states: Table,
    kept: Counts,
    impacts: Counts,
    ends: Vector,
    codes: Counts,
) -> None:
    """Follow motions, each to as many states once a drive period as are wanted of it.

    Parameters
    ----------
    columns
        What each motion comes with, shape (motions, COLUMN).
    shapes, bases
        As in `contact_by_steps`, of each motion; shapes (motions, TERMS, 6) and (motions,).
    onto, par, tolerance, box, coefficients
        Of the specimen, the same for all.
    wanted
        States once a drive period, shape (motions,).
    states, kept, impacts, ends, codes
        Filled: what is kept of each, shape (motions, most wanted, KEPT); how many; touches; the state of one
        that ends in contact, shape (motions, STATE_SIZE); and how each ends.

    """
    at, job_of, events = np.zeros((ROWS, LANES)), np.full(LANES, NOBODY), np.zeros(LANES, np.int64)
    series, one = np.zeros((ORDERS, LANES)), np.zeros(ORDERS)
    variables, values = np.zeros((VARIABLES, LANES)), np.zeros((POLYNOMIALS, LANES))
    state, force, work = np.zeros(STATE_SIZE), np.zeros(FORCE_TERMS), contact_workspace()
    lower, upper = par.lower, par.upper
    following, alive, moving, careful, over = 0, 0, 0, 0, ALL
    while True:
        if over != 0:
            alive, moving = alive & ~over, moving & ~over
            for lane in range(LANES):
                if (over >> lane) & 1 and following < len(columns):
                    for row in range(COLUMN):
                        at[row, lane] = columns[following, row]
                    job_of[lane], events[lane] = following, 0
                    alive, moving, careful = alive | (1 << lane), moving | (1 << lane), careful & ~(1 << lane)
                    following += 1
            if alive == 0:
                return
            bound_flights(at, over, lower, upper)
            over = 0
        waiting = WAITING if alive == ALL else 0
        if count_of(moving) > waiting:
            moving, careful, due = march_lanes(at, moving, careful, waiting)
            if due != 0:
                over = keep_due(at, due, job_of, kept, wanted, states)
                if over != 0:
                    continue
            if count_of(moving) > waiting:
                continue
        asked = alive & ~moving
        careful &= ~asked
        for lane in range(LANES):
            if (asked >> lane) & 1:
                job = job_of[lane]
                events[lane] += 1
                if events[lane] > MOST_EVENTS * wanted[job] or not at[BOUND, lane] < LARGEST_BOUND:
                    codes[job] = FAILED
                    over |= 1 << lane
        asked &= ~over
        touched = look_closely(at, series, one, asked, lower, upper)
        due = step_lanes(at, asked & ~touched)
        over |= keep_due(at, due, job_of, kept, wanted, states)
        moving |= asked & ~touched
        bound_flights(at, asked & ~touched, lower, upper)
        if touched != 0:
            turn_lanes(at, touched)
            due = touched & ~below(0.0, eight(at, LEFT))
            done = keep_due(at, due, job_of, kept, wanted, states)
            over |= done
            touched, final = touched & ~done, 0
            for lane in range(LANES):
                if (touched >> lane) & 1:
                    job = job_of[lane]
                    impacts[job] += 1
                    if kept[job] + 1 == wanted[job]:
                        final |= 1 << lane
            slow = collide_lanes(at, touched, final, box, coefficients, variables, values)
            for lane in range(LANES):
                if (slow >> lane) & 1:
                    job = job_of[lane]
                    left = contact_by_steps(
                        at,
                        lane,
                        (final >> lane) & 1,
                        state,
                        force,
                        work,
                        shapes[job],
                        onto,
                        bases[job],
                        par,
                        tolerance,
                    )
                    if left != 1:
                        over |= 1 << lane
                        codes[job] = IN_CONTACT if left == 0 else FAILED
                        for i in range(STATE_SIZE):
                            ends[job, i] = state[i]
            touched &= ~over
            due = touched & ~below(0.0, eight(at, LEFT))
            over |= keep_due(at, due, job_of, kept, wanted, states)
            touched &= ~over
            bound_flights(at, touched, lower, upper)
            away = leaves_clear(at, touched, lower + upper)
            due = step_lanes(at, away)
            over |= keep_due(at, due, job_of, kept, wanted, states)
            moving |= away


@kernel
def states_of_terms(states: Table, kept: Counts, columns: Table, shapes: Complex, followed: Table) -> None:
    """Write the states that were due, shape (motions, most, 6), from terms a moment later."""
    at, out = np.zeros((DRIVE, LANES)), np.zeros((6, LANES))
    for job in range(len(states)):
        for row in range(RATE, RATE + PAIR):
            for lane in range(LANES):
                at[row, lane] = columns[job, row]
        for first in range(0, kept[job], LANES):
            count = min(LANES, kept[job] - first)
            for lane in range(count):
                for row in range(PAIR):
                    at[TERM + row, lane] = states[job, first + lane, row]
                at[ONE_STEP, lane] = states[job, first + lane, PAIR]
            _place_on_terms(out, at, shapes[job])
            for lane in range(count):
                for i in range(6):
                    followed[job, first + lane, i] = out[i, lane]


@kernel
def _place_on_terms(out: Table, at: Table, shapes: Complex) -> None:
    """Write the states, shape (6, LANES), of terms that are to be turned by the times in row ONE_STEP."""
    later = eight(at, ONE_STEP)
    for j in range(TERMS):
        by_re, by_im = factor_of(at, j, later, LONG)
        re, im = eight(at, TERM + 2 * j), eight(at, TERM + 2 * j + 1)
        store(at, TERM + 2 * j, fma(re, by_re, -(im * by_im)))
        store(at, TERM + 2 * j + 1, fma(re, by_im, im * by_re))
    for i in range(6):
        value = eights(0.0)
        for j in range(TERMS):
            value = fma(eight(at, TERM + 2 * j), shapes[j, i].real, value)
            value = fma(eight(at, TERM + 2 * j + 1), -shapes[j, i].imag, value)
        store(out, i, value)
