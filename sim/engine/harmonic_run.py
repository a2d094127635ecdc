"""A run under a harmonic drive: flight, contact, flight, ... up to an instant. SI units.

One kernel advances a state and a clock in place, and on the way fills what it is given: samples, impact
times, a tally. None of them changes a single step, so what is observed never changes the motion.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined
from ..growth.tangent_contact import carry_through_steps, tangent_workspace
from ..growth.tangent_flight import carry_through_flight
from ..growth.tangent_impact import carry_through_impact
from ..modes import Complex
from ..outcome import Outcome
from .clock import advance_clock, time_until
from .contact import (
    HELD,
    LEFT,
    LOG_COLUMNS,
    NOT_FINITE,
    STAGES_ONLY,
    WIDE_LOG_COLUMNS,
    contact_workspace,
    gap_of,
)
from .contact_flow import FORCE_TERMS
from .departure import closed_for, departure
from .detection import SERIES_TERMS
from .flight import (
    CLEAR,
    DEPARTS,
    OUT_OF_RANGE,
    FlightTables,
    drive_phasor,
    fly,
    place_on_phasors,
    take_off,
    turn_phasors,
)
from .parameters import CLOSED, POWER, RIGID, SIDE, Table, Vector, X, Y, Z
from .rigid_stop import is_resolved
from .smooth import smooth_turn
from .smooth_tally import tally_smooth
from .stick import held_tables, hold, place_held, tally_held
from .tally import MODE, NOTHING, tally_contact, tally_flight
from .touch import advance_touching, strike

REACHED_END = int(Outcome.REACHED_END)
TOO_MANY_IMPACTS = int(Outcome.TOO_MANY_IMPACTS)
LOST = int(Outcome.NOT_FINITE)
STUCK = int(Outcome.STALLED)

STRETCH_TURN = 0.3
"""Longest stretch of a contact, as drive phase [rad]: the base force is a polynomial of degree 7 about
its middle, whose first term left out is 0.15^8/8! = 6e-12 of the force."""
LOG_ROWS = 256
NEXT_SAMPLE, IMPACTS = 0, 1
"""Places of `Record.counts`."""


class Record(NamedTuple):
    """What a run fills on its way."""

    start: float
    """Time of sample 0 [s]."""
    sample_rate: float
    samples: Table
    """Shape (n, 6); n = 0 keeps none."""
    impact_times: Vector
    """Shape (most impacts,) [s]; a run ends when it is full."""
    counts: NDArray[np.int64]
    """Samples and impacts so far."""
    tally: Vector
    tangent: Table
    """Small changes of the state that are carried along, as `sim.growth.tangent` says, shape (m,
    TANGENT_SIZE); m = 0 carries none."""


@compiled
def advance_harmonic(  # noqa: C901, PLR0911, PLR0912, PLR0915 - the phases and their ends are one loop
    state: Vector, clock: Vector, until: float, tables: FlightTables, tolerance: float, record: Record
) -> int:
    """Advance ``state`` and ``clock`` to the instant ``until`` [s]; returns an `Outcome` code."""
    terms = len(tables.rates)
    phasors, now = np.zeros(terms, np.complex128), np.zeros(terms, np.complex128)
    workspace = np.zeros(terms, np.complex128)
    series, force, work = np.zeros(SERIES_TERMS), np.zeros(FORCE_TERMS), contact_workspace()
    shadow = np.zeros(len(state))
    log, memory, has_tangent = _log_for(record), tangent_workspace(), len(record.tangent) > 0
    counts = record.counts
    turn = smooth_turn(tolerance) if tables.par.law == POWER else STRETCH_TURN
    while True:
        longest = time_until(clock, until)
        if longest <= 0.0:
            return REACHED_END
        if not math.isfinite(state[X] + state[Y] + state[Z]):
            return LOST
        if state[SIDE] == 0.0:
            take_off(phasors, state, clock, tables)
            ends, length = _fly_on(phasors, now, workspace, series, clock, longest, tables)
            if ends == OUT_OF_RANGE:
                return LOST
            if record.tally[MODE] != NOTHING:
                tally_flight(record.tally, phasors, now, workspace, series, clock, length, tables)
            if has_tangent:
                carry_through_flight(record.tangent, length, tables)
            if counts[NEXT_SAMPLE] < len(record.samples):
                _sample_flight(phasors, now, clock, length, tables, record)
            turn_phasors(now, phasors, length, clock, tables)
            place_on_phasors(state, now, tables)
            if ends == CLEAR:
                clock[0], clock[1] = until, 0.0
                continue
            advance_clock(clock, length)
            if ends == DEPARTS:
                continue
            if counts[IMPACTS] == len(record.impact_times):
                return TOO_MANY_IMPACTS
            record.impact_times[counts[IMPACTS]] = clock[0]
            counts[IMPACTS] += 1
            shadow[:] = state
            if tables.par.law == RIGID:
                state[CLOSED] = closed_for(now, tables)
            strike(state, tables.par, tolerance)
            if has_tangent and tables.par.law == RIGID:
                carry_through_impact(record.tangent, shadow, state, tables.par)
        elif tables.par.law == RIGID:
            ends, length = _stay_held(state, clock, longest, series, tables, record)
            if ends == OUT_OF_RANGE:
                return LOST
            if ends == CLEAR:
                clock[0], clock[1] = until, 0.0
            else:
                advance_clock(clock, length)
                state[SIDE] = 0.0
        else:
            middle = min(0.5 * longest, 0.5 * turn / tables.omega)
            limit = min(longest, 2.0 * middle)
            _fill_base_force(force, clock, middle, tables)
            shadow[:] = state
            code, length = advance_touching(
                state, 0.0, limit, force, middle, tables.par, tables.power, tolerance, work, log
            )
            if code == NOT_FINITE:
                return LOST
            if code not in (LEFT, HELD):
                return STUCK
            if record.tally[MODE] != NOTHING and tables.par.law == POWER:
                tally_smooth(record.tally, log, clock, tables)
            elif record.tally[MODE] != NOTHING:
                tally_contact(record.tally, log, clock, tables)
            if has_tangent:
                carry_through_steps(record.tangent, log, tables.par, tables.power, memory)
            if counts[NEXT_SAMPLE] < len(record.samples):
                _sample_contact(shadow, clock, length, force, middle, tables, tolerance, work, record)
            if length >= longest:
                clock[0], clock[1] = until, 0.0
            else:
                advance_clock(clock, length)


@compiled
def _log_for(record: Record) -> Table:
    """Make the log of contacts that the tally or the tangent needs."""
    if len(record.tangent) > 0:
        wide = np.zeros((LOG_ROWS, WIDE_LOG_COLUMNS))
        wide[0, STAGES_ONLY] = 1.0 if record.tally[MODE] == NOTHING else 0.0
        return wide
    return np.zeros((LOG_ROWS if record.tally[MODE] != NOTHING else 0, LOG_COLUMNS))


@inlined
def _fly_on(
    phasors: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    longest: float,
    tables: FlightTables,
) -> tuple[int, float]:
    """Find how long a flight lasts, as `sim.engine.flight.fly`; off a rigid stop it first departs."""
    if tables.par.law == RIGID:
        if not is_resolved(closed_for(phasors, tables), tables.par):
            return OUT_OF_RANGE, 0.0
        leaves = departure(phasors, terms, series, tables)
        if leaves > 0.0:
            return (DEPARTS, leaves) if leaves < longest else (CLEAR, longest)
    return fly(phasors, now, terms, series, clock, longest, tables)


@compiled
def _stay_held(
    state: Vector, clock: Vector, longest: float, series: Vector, tables: FlightTables, record: Record
) -> tuple[int, float]:
    """Advance while a rigid stop holds m1, to where it lets go or by ``longest``."""
    held = held_tables(tables)
    terms, side, first = len(held.rates), state[SIDE], record.counts[NEXT_SAMPLE]
    phasors, now = np.zeros(terms, np.complex128), np.zeros(terms, np.complex128)
    workspace = np.zeros(terms, np.complex128)
    take_off(phasors, state, clock, held)
    ends, length = hold(side, phasors, now, workspace, series, clock, longest, held)
    if ends == OUT_OF_RANGE:
        return ends, length
    tally_flight(record.tally, phasors, now, workspace, series, clock, length, held)
    tally_held(record.tally, side, clock, length, held)
    if len(record.tangent) > 0:
        carry_through_flight(record.tangent, length, held)
    _sample_flight(phasors, now, clock, length, held, record)
    for row in range(first, record.counts[NEXT_SAMPLE]):
        record.samples[row, Y] += side * gap_of(side, held.par)
    turn_phasors(now, phasors, length, clock, held)
    place_held(state, side, now, held)
    return ends, length


@inlined
def _fill_base_force(force: Vector, clock: Vector, middle: float, tables: FlightTables) -> None:
    """Taylor coefficients of the base force about clock time plus ``middle``."""
    term = tables.force * drive_phasor(clock, middle, tables)
    for k in range(FORCE_TERMS):
        force[k] = term.real
        term *= complex(0.0, tables.omega / (k + 1.0))


@compiled
def _sample_flight(
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
def _sample_contact(
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
            _, reached = advance_touching(
                shadow, reached, later, force, middle, tables.par, tables.power, tolerance, work, none
            )
        record.samples[counts[NEXT_SAMPLE]] = shadow[:6]
        counts[NEXT_SAMPLE] += 1
