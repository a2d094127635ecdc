"""A run under a drive given as cubics: interval after interval, with samples on the way. SI units."""

import math

import numpy as np

from ..flight import Cubic, base_force, shifted
from ..kernels import Table, Vector, advance_clock, copy_row, kernel, kernel_without_refcount, time_until
from ..slots import IMPACTS, LOST, NEXT_SAMPLE, REACHED_END, TOO_MANY_IMPACTS, Record
from ._substep import IntervalTables, advance_if_clear, advance_substep

ALMOST = 1.0 - 1e-12
"""An interval is whole although its length, cut into pieces and joined, rounds differently."""


@kernel_without_refcount
def advance_intervals(
    state: Vector,
    clock: Vector,
    pieces: Table,
    first_from: float,
    last_to: float,
    tables: IntervalTables,
    record: Record,
) -> int:
    """Advance over a row of intervals and return an `Outcome` code.

    Parameters
    ----------
    state, clock
        In and out.
    pieces
        c0 ... c3 of each interval, shape (intervals, 4).
    first_from, last_to
        Where the run begins in the first interval and ends in the last, since their starts [s].
    tables
        For the length of one interval.
    record
        Filled on the way.

    """
    whole = tables.length * tables.substeps
    # The force is a cubic in the time since the interval's start; each step shifts it to its own start.
    for index in range(len(pieces)):
        begin = first_from if index == 0 else 0.0
        end = last_to if index + 1 == len(pieces) else whole
        is_whole = begin == 0.0 and end >= whole * ALMOST
        steps = tables.substeps if is_whole else math.ceil((end - begin) / tables.length)
        for step in range(steps):
            length = tables.length if is_whole else (end - begin) / steps
            force = _base_force(pieces[index], begin + step * length, tables)
            code = _advance_step(state, clock, force, length, is_whole, tables, record)
            if code != REACHED_END:
                return code
    return REACHED_END


@kernel_without_refcount
def _advance_step(
    state: Vector,
    clock: Vector,
    force: Cubic,
    length: float,
    is_whole: bool,  # noqa: FBT001 - inside a compiled loop, where an enum costs a conversion
    tables: IntervalTables,
    record: Record,
) -> int:
    counts, times = record.counts, record.impact_times
    kept = counts[IMPACTS]
    _sample(state, clock, force, length, tables, record)
    fresh = 0
    if not (is_whole and advance_if_clear(state, force, tables)):
        fresh = advance_substep(state, force, length, tables, times[kept:])
    if fresh < 0:
        return LOST
    counts[IMPACTS] = min(kept + fresh, len(times))
    for touch in range(kept, counts[IMPACTS]):
        times[touch] += clock[0]
    if kept + fresh > len(times):
        return TOO_MANY_IMPACTS
    advance_clock(clock, length)
    return REACHED_END


@kernel_without_refcount
def _base_force(base: Vector, at: float, tables: IntervalTables) -> Cubic:
    """k0 U + c0 dU/dt as a cubic in the time since ``at``."""
    return shifted(base_force(base, tables.par), at)


@kernel
def _sample(
    state: Vector, clock: Vector, force: Cubic, length: float, tables: IntervalTables, record: Record
) -> None:
    """Keep the samples of the coming step, each by a short run of its own that leaves the motion alone."""
    counts = record.counts
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later >= length:
            return
        shadow = state.copy()
        if later > 0.0:
            advance_substep(shadow, force, later, tables, np.empty(0))
        copy_row(record.samples[counts[NEXT_SAMPLE]], shadow)
        counts[NEXT_SAMPLE] += 1
