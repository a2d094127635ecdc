"""A run under a power law, whose force acts at every p: one stretch after another. SI units."""

import math

import numpy as np

from ..compiled import compiled
from ..growth.tangent_contact import carry_through_steps, tangent_workspace
from .clock import advance_clock, time_until
from .contact import HELD, LEFT, LOG_COLUMNS, NOT_FINITE, contact_workspace, log_for
from .contact_flow import FORCE_TERMS
from .flight import FlightTables, fill_base_force
from .parameters import PowerTerms, Table, Vector, X, Y, Z
from .power_flow import PowerSystem
from .record import LOST, NEXT_SAMPLE, REACHED_END, STUCK, Record
from .row import copy_row
from .smooth import advance_smooth, smooth_turn
from .smooth_tally import tally_smooth
from .tally import MODE, NOTHING


@compiled
def advance_under_power(
    state: Vector,
    clock: Vector,
    until: float,
    tables: FlightTables,
    tolerance: float,
    record: Record,
    power: PowerTerms,
    tangent: Table | None,
) -> int:
    """Advance ``state`` and ``clock`` to the instant ``until`` [s]; returns an `Outcome` code."""
    force, work, shadow = np.zeros(FORCE_TERMS), contact_workspace(), np.zeros(len(state))
    log, memory = log_for(record.tally, tangent), tangent_workspace()
    turn, system = smooth_turn(tolerance), PowerSystem(tables.par, power)
    while True:
        longest = time_until(clock, until)
        if longest <= 0.0:
            return REACHED_END
        if not math.isfinite(state[X] + state[Y] + state[Z]):
            return LOST
        middle = min(0.5 * longest, 0.5 * turn / tables.omega)
        limit = min(longest, 2.0 * middle)
        fill_base_force(force, clock, middle, tables)
        copy_row(shadow, state)
        code, length = advance_smooth(state, 0.0, limit, force, middle, system, tolerance, work, log)
        if code == NOT_FINITE:
            return LOST
        if code not in (LEFT, HELD):
            return STUCK
        if record.tally[MODE] != NOTHING:
            tally_smooth(record.tally, log, clock, tables)
        if tangent is not None and len(tangent) > 0:
            carry_through_steps(tangent, log, tables.par, power, memory)
        if record.counts[NEXT_SAMPLE] < len(record.samples):
            _sample_stretch(shadow, clock, length, force, middle, system, tolerance, work, record)
        if length >= longest:
            clock[0], clock[1] = until, 0.0
        else:
            advance_clock(clock, length)


@compiled
def _sample_stretch(
    shadow: Vector,
    clock: Vector,
    length: float,
    force: Vector,
    middle: float,
    system: PowerSystem,
    tolerance: float,
    work: Table,
    record: Record,
) -> None:
    """Keep the samples that fall into a stretch, by a second run that lands on each of them."""
    counts, reached = record.counts, 0.0
    none = np.zeros((0, LOG_COLUMNS))
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later > length:
            return
        if later > reached:
            _, reached = advance_smooth(shadow, reached, later, force, middle, system, tolerance, work, none)
        copy_row(record.samples[counts[NEXT_SAMPLE]], shadow)
        counts[NEXT_SAMPLE] += 1
