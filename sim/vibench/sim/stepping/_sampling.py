"""Samples of a run at given instants, taken so that they change nothing of it. SI units."""

import numpy as np

from ..contact import LOG_COLUMNS, advance_contact
from ..flight import FlightTables, place_on_phasors, turn_phasors
from ..kernels import Complex, Table, Vector, compiled, copy_row, lean, time_until
from ..slots import NEXT_SAMPLE, SIDE, Record


@lean
def sample_flight(
    phasors: Complex, now: Complex, clock: Vector, length: float, tables: FlightTables, record: Record
) -> None:
    """Keep the samples that fall into a flight of ``length`` from clock time on."""
    counts = record.counts
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later > length:
            return
        turn_phasors(now, phasors, later, clock, tables)
        place_on_phasors(record.samples[counts[NEXT_SAMPLE]], now, tables)
        counts[NEXT_SAMPLE] += 1


@compiled
def sample_contact(
    shadow: Vector,
    clock: Vector,
    length: float,
    force: Vector,
    middle: float,
    tables: FlightTables,
    tolerance: float,
    work: Table,
    record: Record,
) -> None:
    """Keep the samples that fall into a stretch of contact, by a second run that lands on each of them."""
    counts, reached = record.counts, 0.0
    none = np.zeros((0, LOG_COLUMNS))
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later > length:
            return
        if shadow[SIDE] != 0.0 and later > reached:
            _, reached = advance_contact(
                shadow, reached, later, force, middle, tables.par, tolerance, work, none
            )
        copy_row(record.samples[counts[NEXT_SAMPLE]], shadow)
        counts[NEXT_SAMPLE] += 1
