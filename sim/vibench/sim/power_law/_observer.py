"""What is observed of a step under a power law: its peaks, its lines, and samples. SI units.

The motion is known at ten instants of a step, with its rates: a polynomial of degree 19 through them is exact
to rounding. A sample is the end of another, shorter step from where the step began.
"""

from typing import NamedTuple

import numpy as np

from ..flight import AT_X, COSINE, P_RATE, SINE, WIDE, X_RATE, P
from ..kernels import Table, Vector, eight, eight_of_eight, kernel, kernel_without_refcount, store, time_until
from ..slots import (
    LINE_P_IM,
    LINE_P_RE,
    LINE_X_IM,
    LINE_X_RE,
    MODE,
    NEXT_SAMPLE,
    PEAK_P,
    PEAK_X,
    PEAKS_AND_LINES,
    PowerTerms,
    Record,
)
from ._flow import power_forces
from ._numbers import ALL_ROWS, FEED, FREE, GAIN, INNER, MOVE, POINTS, fill_ends
from ._step import PowerStepState, write_motion
from ._tables import INSTANT_SLOPES, INSTANT_WEIGHTS, INSTANTS, POINT_WEIGHTS, WEIGHTS, PowerTables

SECANTS = 6
"""To where the motion turns: what is missing then changes no peak."""


class PowerObserver(NamedTuple):
    """Workspaces of the observer of steps."""

    course: Table
    """The motion at the instants of a step, shape (instants, WIDE)."""
    force: Vector
    motion: Vector
    """Where a shorter step ends."""
    numbers: Table
    """Of that step."""


@kernel
def new_power_observer() -> PowerObserver:
    """Make them."""
    return PowerObserver(
        np.zeros((len(INSTANTS), WIDE)),
        np.zeros(POINTS),
        np.zeros(WIDE),
        np.zeros((ALL_ROWS, WIDE)),
    )


@kernel_without_refcount
def observe_step(
    observations: Vector, step: PowerStepState, numbers: Table, length: float, observer: PowerObserver
) -> None:
    """Add a step that was tried and found good: its peaks, and its lines by Gauss's sums."""
    course = observer.course
    motion, force = eight(step.motion, 0), eight(step.force, 0)
    store(course, 0, motion)
    store(course, POINTS + 1, eight(step.ahead, 0))
    for i in range(POINTS):
        first = INNER + 2 * WIDE * i
        free = eight_of_eight(numbers, first, motion)
        store(course, i + 1, free + eight_of_eight(numbers, first + WIDE, force))
    observations[PEAK_X] = _peak(observations[PEAK_X], course, AT_X, X_RATE, length)
    observations[PEAK_P] = _peak(observations[PEAK_P], course, P, P_RATE, length)
    if observations[MODE] != PEAKS_AND_LINES:
        return
    for i in range(POINTS):
        at, weight = course[i + 1], WEIGHTS[i] * length
        observations[LINE_X_RE] += weight * at[AT_X] * at[COSINE]
        observations[LINE_X_IM] -= weight * at[AT_X] * at[SINE]
        observations[LINE_P_RE] += weight * at[P] * at[COSINE]
        observations[LINE_P_IM] -= weight * at[P] * at[SINE]


@kernel_without_refcount
def _peak(best: float, course: Table, value: int, rate: int, length: float) -> float:
    """Largest magnitude over a step, or ``best`` if that is larger."""
    for i in range(len(INSTANTS)):
        best = max(best, abs(course[i, value]))
    for i in range(len(INSTANTS) - 1):
        start, end = course[i], course[i + 1]
        apart = (INSTANTS[i + 1] - INSTANTS[i]) * length
        if start[rate] * end[rate] >= 0.0:
            continue
        # Where it turns once, it stays below the tangents of both ends.
        if min(abs(start[value]) + apart * abs(start[rate]), abs(end[value]) + apart * abs(end[rate])) > best:
            best = max(best, _turning_value(course, i, value, rate, length))
    return best


@kernel_without_refcount
def _turning_value(course: Table, first: int, value: int, rate: int, length: float) -> float:
    """Largest magnitude between an instant and the next, where the rate changes its sign."""
    low, high = INSTANTS[first], INSTANTS[first + 1]
    rate_low, rate_high, at = course[first, rate], course[first + 1, rate], low
    for _ in range(SECANTS):
        at = low - rate_low * (high - low) / (rate_high - rate_low)
        now = _within(course, at, rate)
        if now * rate_low > 0.0:
            low, rate_low = at, now
        else:
            high, rate_high = at, now
    return abs(_within_exactly(course, at, value, rate, length))


@kernel_without_refcount
def _within(course: Table, at: float, place: int) -> float:
    """Give a number of the motion within a step as the polynomial through the instants."""
    total, norm = 0.0, 0.0
    for i in range(len(INSTANTS)):
        if at == INSTANTS[i]:
            found: float = course[i, place]
            return found
        part = INSTANT_WEIGHTS[i] / (at - INSTANTS[i])
        norm += part
        total += part * course[i, place]
    return total / norm


@kernel_without_refcount
def _within_exactly(course: Table, at: float, value: int, rate: int, length: float) -> float:
    """Do the same with the rates known as well (Hermite's polynomial)."""
    total, norm = 0.0, 0.0
    for i in range(len(INSTANTS)):
        off = at - INSTANTS[i]
        if off == 0.0:
            found: float = course[i, value]
            return found
        part = INSTANT_WEIGHTS[i] / off
        norm += part
        slope = length * course[i, rate] - 2.0 * INSTANT_SLOPES[i] * course[i, value]
        total += part * part * (course[i, value] + off * slope)
    return total / (norm * norm)


@kernel_without_refcount
def sample_step(
    step: PowerStepState,
    clock: Vector,
    length: float,
    power: PowerTerms,
    steps: PowerTables,
    record: Record,
    observer: PowerObserver,
) -> None:
    """Keep the samples that fall into the step just tried, which begins at clock time."""
    counts, numbers = record.counts, observer.numbers
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later > length:
            return
        if later <= 0.0:
            write_motion(record.samples[counts[NEXT_SAMPLE]], step.motion)
        else:
            fill_ends(numbers, later, steps.series)
            _move_within(step, later / length, power, observer)
            write_motion(record.samples[counts[NEXT_SAMPLE]], observer.motion)
        counts[NEXT_SAMPLE] += 1


@kernel_without_refcount
def _move_within(step: PowerStepState, ratio: float, power: PowerTerms, observer: PowerObserver) -> None:
    """Make the part of a step that the watcher has numbers for; the force is known but for one refinement."""
    guess, motion, numbers = observer.force, eight(step.motion, 0), observer.numbers
    for i in range(POINTS):
        at, value, norm = ratio * INSTANTS[i + 1], 0.0, 0.0
        for k in range(POINTS):
            off = at - INSTANTS[k + 1]
            if off == 0.0:
                value, norm = step.force[k], 1.0
                break
            part = POINT_WEIGHTS[k] / off
            norm += part
            value += part * step.force[k]
        guess[i] = value / norm
    free = eight_of_eight(numbers, FREE, motion)
    force = power_forces(free + eight_of_eight(numbers, GAIN, guess), power)
    moved = motion + eight_of_eight(numbers, MOVE, motion)
    store(observer.motion, 0, moved + eight_of_eight(numbers, FEED, force))
