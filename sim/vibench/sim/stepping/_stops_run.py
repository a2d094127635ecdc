"""A run between stops: flight, contact, flight, ... up to an instant. SI units.

Samples of a run at given instants, taken so that they change nothing of it. SI units.
"""

import math

import numpy as np

from ..collision import CollisionTables, collide, observe_collision, propagate_tangent_collision
from ..contact import (
    HELD,
    LEFT,
    LOG_COLUMNS,
    LOGGED,
    NOT_FINITE,
    advance_contact,
    gap_of,
    observe_contact,
    propagate_tangent_steps,
)
from ..flight import (
    CLEAR,
    LIFTS_OFF,
    OUT_OF_RANGE,
    TOUCHES,
    FlightTables,
    drive_phasor,
    fill_base_force,
    fly,
    observe_flight,
    place_on_phasors,
    propagate_phasors,
    propagate_tangent_flight,
    start_flight,
)
from ..kernels import (
    Complex,
    Table,
    Vector,
    advance_clock,
    copy_row,
    inlined,
    kernel,
    kernel_without_refcount,
    time_until,
)
from ..model import X, Y, Z
from ..rigid import is_resolved, propagate_tangent_impact
from ..slots import (
    CLOSED,
    IMPACTS,
    LOST,
    MODE,
    NEXT_SAMPLE,
    NOTHING,
    PEAK_P,
    REACHED_END,
    RESOLVED_STEP,
    SIDE,
    STEPS_LEFT,
    STUCK,
    TOO_LONG,
    TOO_MANY_IMPACTS,
    Parameters,
    Record,
)
from ..sticking import LETS_GO, HeldTables, closed_for, hold, lift_off, observe_rest
from ._touch import contact_onset
from ._workspace import Workspace


@kernel_without_refcount
def sample_flight(
    phasors: Complex, now: Complex, clock: Vector, length: float, tables: FlightTables, record: Record
) -> None:
    """Keep the samples that fall into a flight of ``length`` from clock time on."""
    counts = record.counts
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later > length:
            return
        propagate_phasors(now, phasors, later, clock, tables)
        place_on_phasors(record.samples[counts[NEXT_SAMPLE]], now, tables)
        counts[NEXT_SAMPLE] += 1


@kernel
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


STRETCH_TURN = 0.3
"""Longest stretch of a contact, as drive phase [rad]: the base force is a polynomial of degree 7 about
its middle, whose first term left out is 0.15^8/8! = 6e-12 of the force."""


@kernel_without_refcount
def advance_between_stops(  # noqa: C901, PLR0911, PLR0912, PLR0915 - the phases and their ends are one loop
    state: Vector,
    clock: Vector,
    until: float,
    tables: FlightTables,
    tolerance: float,
    record: Record,
    held: HeldTables | None,
    collisions: CollisionTables | None,
    tangent: Table | None,
    workspace: Workspace,
) -> int:
    """Advance ``state`` and ``clock`` to the instant ``until`` [s]; returns an `Outcome` code.

    ``held`` is how m1 moves on a stop that holds it or is a spring, None where stops yield otherwise;
    ``collisions`` are known of Hertz's stops alone.
    """
    phasors, landed, now = workspace.phasors, workspace.landed, workspace.now
    scratch, series = workspace.terms, workspace.series
    force, work, shadow, log, memory = (
        workspace.force,
        workspace.work,
        workspace.shadow,
        workspace.log,
        workspace.memory,
    )
    counts = record.counts
    # The drive's phasor where a stop has just been touched; zero where it is not known.
    strikes = complex(0.0, 0.0)
    while True:
        longest = time_until(clock, until)
        if longest <= 0.0:
            return REACHED_END
        if not math.isfinite(state[X] + state[Y] + state[Z]):
            return LOST
        left = counts[STEPS_LEFT]
        if left <= 0:
            return TOO_LONG
        if state[SIDE] == 0.0:
            start_flight(phasors, state, clock, tables)
            most = min(longest, left * tables.grid)
            ends, length = _fly_on(
                phasors, now, scratch, series, clock, most, tables, held, tables.par.restitution
            )
            if ends == OUT_OF_RANGE:
                return LOST
            propagate_phasors(landed, phasors, length, clock, tables)
            if record.observations[MODE] != NOTHING:
                observe_flight(
                    record.observations, phasors, landed, now, scratch, series, clock, length, tables
                )
            if tangent is not None and len(tangent) > 0:
                propagate_tangent_flight(tangent, length, now, scratch, tables)
            if counts[NEXT_SAMPLE] < len(record.samples):
                sample_flight(phasors, now, clock, length, tables, record)
            place_on_phasors(state, landed, tables)
            counts[STEPS_LEFT] -= 1 + int(length / tables.grid)
            if ends == CLEAR and length >= longest:
                clock[0], clock[1] = until, 0.0
                continue
            advance_clock(clock, length)
            strikes = landed[len(landed) - 1]
            if ends != TOUCHES:
                continue
            if counts[IMPACTS] == len(record.impact_times):
                return TOO_MANY_IMPACTS
            record.impact_times[counts[IMPACTS]] = clock[0]
            counts[IMPACTS] += 1
            copy_row(shadow, state)
            if held is not None:
                state[CLOSED] = closed_for(landed, tables)
            contact_onset(state, tables.par, tables.par.restitution, tolerance)
            if held is not None:
                _propagate_tangent_impact(tangent, shadow, state, tables.par, tables.par.restitution)
        elif held is not None:
            gap = gap_of(state[SIDE], tables.par.lower, tables.par.upper)
            most = min(longest, left * held.flight.grid)
            ends, length = _stay_held(state, gap, clock, most, record, held, tangent, workspace)
            if ends == OUT_OF_RANGE:
                return LOST
            counts[STEPS_LEFT] -= 1 + int(length / held.flight.grid)
            if ends != CLEAR:
                state[SIDE] = 0.0
            if ends == CLEAR and length >= longest:
                clock[0], clock[1] = until, 0.0
            else:
                advance_clock(clock, length)
        else:
            copy_row(shadow, state)
            counts[STEPS_LEFT] -= RESOLVED_STEP
            if collisions is not None:
                drive = drive_phasor(clock, 0.0, tables) if strikes == 0.0 else strikes
                length = collide(state, drive, longest, tolerance, tables, collisions, workspace.collision)
                strikes = complex(0.0, 0.0)
                if length > 0.0:
                    _observe_collision_in_full(
                        shadow, clock, length, tables, tolerance, record, collisions, tangent, workspace
                    )
                    advance_clock(clock, length)
                    continue
            middle = min(0.5 * longest, 0.5 * STRETCH_TURN / tables.omega)
            limit = min(longest, 2.0 * middle)
            fill_base_force(force, clock, middle, tables)
            code, length = advance_contact(state, 0.0, limit, force, middle, tables.par, tolerance, work, log)
            if len(log) > 0:
                counts[STEPS_LEFT] -= RESOLVED_STEP * int(log[0, LOGGED])
            if code == NOT_FINITE:
                return LOST
            if code not in (LEFT, HELD):
                return STUCK
            if record.observations[MODE] != NOTHING:
                observe_contact(record.observations, log, clock, tables)
            if tangent is not None and len(tangent) > 0:
                propagate_tangent_steps(tangent, log, tables.par, memory)
            if counts[NEXT_SAMPLE] < len(record.samples):
                sample_contact(shadow, clock, length, force, middle, tables, tolerance, work, record)
            if length >= longest:
                clock[0], clock[1] = until, 0.0
            else:
                advance_clock(clock, length)


@inlined
def _fly_on(
    phasors: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    longest: float,
    tables: FlightTables,
    held: HeldTables | None,
    restitution: float | None,
) -> tuple[int, float]:
    """Find how long a flight lasts, as `vibench.sim.flight.fly`; off a rigid stop it first departs."""
    if held is not None and restitution is not None:
        if not is_resolved(closed_for(phasors, tables), tables.par):
            return OUT_OF_RANGE, 0.0
        leaves = lift_off(phasors, terms, series, tables)
        if leaves > 0.0:
            return (LIFTS_OFF, leaves) if leaves < longest else (CLEAR, longest)
    return fly(phasors, now, terms, series, clock, longest, tables)


@inlined
def _observe_collision_in_full(
    shadow: Vector,
    clock: Vector,
    length: float,
    tables: FlightTables,
    tolerance: float,
    record: Record,
    collisions: CollisionTables,
    tangent: Table | None,
    workspace: Workspace,
) -> None:
    """Observe a collision that began in the state ``shadow`` at clock time."""
    par, collision = tables.par, workspace.collision
    if record.observations[MODE] != NOTHING:
        gap = gap_of(shadow[SIDE], par.lower, par.upper)
        observe_collision(record.observations, collision, length, gap, tables.omega, collisions)
    if tangent is not None and len(tangent) > 0:
        propagate_tangent_collision(tangent, collision, length, par, collisions, workspace.equations)
    if record.counts[NEXT_SAMPLE] < len(record.samples):
        fill_base_force(workspace.force, clock, 0.5 * length, tables)
        sample_contact(
            shadow, clock, length, workspace.force, 0.5 * length, tables, tolerance, workspace.work, record
        )


@kernel_without_refcount
def _propagate_tangent_impact(
    tangent: Table | None, before: Vector, after: Vector, par: Parameters, restitution: float | None
) -> None:
    if tangent is not None and restitution is not None:
        propagate_tangent_impact(tangent, before, after, par, restitution)


@inlined
def _stay_held(
    state: Vector,
    gap: float,
    clock: Vector,
    longest: float,
    record: Record,
    held: HeldTables,
    tangent: Table | None,
    workspace: Workspace,
) -> tuple[int, float]:
    """Advance while m1 is on a stop at ``gap``, to where that lets go or by ``longest``."""
    flight, observations = held.flight, record.observations
    terms, side, first = len(flight.rates), state[SIDE], record.counts[NEXT_SAMPLE]
    phasors, now = workspace.phasors[:terms], workspace.now[:terms]
    landed, scratch, series = workspace.landed[:terms], workspace.terms[:terms], workspace.series
    rests = held.rests * gap
    state[Y] -= side * rests
    start_flight(phasors, state, clock, flight)
    ends, length = hold(side, held.let_go * gap, phasors, now, scratch, series, clock, longest, held)
    if ends == OUT_OF_RANGE:
        return ends, length
    propagate_phasors(landed, phasors, length, clock, flight)
    if observations[MODE] != NOTHING:
        # The phasors know nothing of the constant part of p, which has the sign of the rest.
        observations[PEAK_P] = max(observations[PEAK_P], gap) - rests
        observe_flight(observations, phasors, landed, now, scratch, series, clock, length, flight)
        observations[PEAK_P] += rests
        observe_rest(observations, side * rests, clock, length, flight)
    if tangent is not None and len(tangent) > 0:
        propagate_tangent_flight(tangent, length, now, scratch, flight)
    if first < len(record.samples):
        sample_flight(phasors, now, clock, length, flight, record)
        for row in range(first, record.counts[NEXT_SAMPLE]):
            record.samples[row, Y] += side * rests
    place_on_phasors(state, landed, flight)
    state[Y] = state[Z] + side * gap if ends == LETS_GO else state[Y] + side * rests
    return ends, length
