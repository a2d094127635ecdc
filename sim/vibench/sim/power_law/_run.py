"""A run under a power law, whose force acts at every p: one long step after another. SI units."""

import math

from ..flight import FlightTables
from ..kernels import Table, Vector, advance_clock, inlined, kernel, kernel_without_refcount, time_until
from ..model import X, Y, Z
from ..slots import (
    LEVEL,
    LOST,
    MODE,
    NEXT_SAMPLE,
    NOTHING,
    REACHED_END,
    RESOLVED_STEP,
    STEPS_LEFT,
    STUCK,
    TOO_LONG,
    PowerTerms,
    Record,
)
from ._numbers import fill_ends, fill_inner
from ._observer import PowerObserver, new_power_observer, observe_step, sample_step
from ._step import (
    FIRST_LEVEL,
    PowerStepState,
    accept_step,
    begin_power_step,
    end_power_step,
    level_after,
    level_that_sees,
    new_power_step,
    set_drive,
    try_step,
)
from ._tables import LEVELS, PowerTables
from ._variation import power_memory, propagate_tangent_power


@kernel
def advance_under_power(
    state: Vector,
    clock: Vector,
    until: float,
    tables: FlightTables,
    tolerance: float,
    record: Record,
    power: PowerTerms,
    steps: PowerTables,
    tangent: Table | None,
) -> int:
    """Advance ``state`` and ``clock`` to the instant ``until`` [s]; returns an `Outcome` code."""
    step, observer, memory = new_power_step(), new_power_observer(), power_memory()
    return _advance(
        state, clock, until, tables, tolerance, record, power, steps, tangent, step, observer, memory
    )


@kernel_without_refcount
def _advance(
    state: Vector,
    clock: Vector,
    until: float,
    tables: FlightTables,
    tolerance: float,
    record: Record,
    power: PowerTerms,
    steps: PowerTables,
    tangent: Table | None,
    step: PowerStepState,
    observer: PowerObserver,
    memory: Table,
) -> int:
    """Do so in the workspaces that are given."""
    level = int(state[LEVEL]) - 1 if state[LEVEL] > 0.0 else FIRST_LEVEL
    begin_power_step(step, state, power)
    set_drive(step.motion, clock, tables)
    code, left = REACHED_END, time_until(clock, until)
    while left > 0.0:
        if record.counts[STEPS_LEFT] <= 0:
            code = TOO_LONG
            break
        record.counts[STEPS_LEFT] -= RESOLVED_STEP
        level = level_that_sees(level, step.motion, tables.par, power, steps)
        if level >= LEVELS:
            code = STUCK if math.isfinite(state[X] + state[Y] + state[Z]) else LOST
            break
        length, numbers = steps.lengths[level], steps.levels[level]
        if left <= length:
            length, numbers = left, step.other
            fill_ends(numbers, length, steps.series)
        misfit = try_step(step, numbers, length, tolerance, tables.par, power)
        if not misfit <= 1.0:
            level = level_after(level, misfit)
            continue
        _observe(step, numbers, length, clock, record, power, steps, observer)
        if tangent is not None and len(tangent) > 0:
            propagate_tangent_power(tangent, step, numbers, power, memory)
        accept_step(step, length)
        if length < left:
            advance_clock(clock, length)
            level = level_after(level, misfit)
        else:
            clock[0], clock[1] = until, 0.0
        left = time_until(clock, until)
        set_drive(step.motion, clock, tables)
    end_power_step(step, state, level)
    return code


@inlined
def _observe(
    step: PowerStepState,
    numbers: Table,
    length: float,
    clock: Vector,
    record: Record,
    power: PowerTerms,
    steps: PowerTables,
    observer: PowerObserver,
) -> None:
    """Observe the step just tried, which begins at clock time."""
    if record.observations[MODE] != NOTHING:
        if numbers is step.other:
            fill_inner(numbers, length, steps.series)
        observe_step(record.observations, step, numbers, length, observer)
    if record.counts[NEXT_SAMPLE] < len(record.samples):
        sample_step(step, clock, length, power, steps, record, observer)
