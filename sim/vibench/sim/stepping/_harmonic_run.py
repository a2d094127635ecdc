"""A run under a harmonic drive, up to an instant, under whatever law. SI units.

A state and a clock are advanced in place, and on the way what is given is filled: samples, impact times, a
tally. None of them changes a single step, so what is observed never changes the motion.

What a run needs is chosen by types, before anything is compiled: most of `HarmonicTables`, and
`Record.tangent`, are None where there is nothing of the kind, and a kernel for Hertz's stops then holds no
power law, no rigid stop and no tangent. To compile all of them took twice as long as a first run may.
"""

import math
from typing import NamedTuple

import numpy as np

from ..collision import CollisionTables, collision_tables
from ..flight import FlightTables, flight_tables
from ..kernels import Table, Vector, kernel_without_refcount
from ..model import Harmonic, PowerLaw, RigidStops, Specimen, bound_motion, harmonic_motion
from ..power_law import PowerTables, advance_under_power, power_tables
from ..slots import PowerTerms, Record, power_terms
from ..sticking import HeldTables, held_tables, pressed_tables
from ._stops_run import advance_between_stops
from ._workspace import Workspace, workspace_for


class HarmonicTables(NamedTuple):
    """A specimen under a harmonic drive; what its law has no use for is None, and so left out of a kernel."""

    flight: FlightTables
    power: PowerTerms | None
    """Of a power law."""
    steps: PowerTables | None
    """Of long steps under a power law."""
    held: HeldTables | None
    """Of rigid stops, and of stops that are springs."""
    collisions: CollisionTables | None
    """Of Hertz's stops."""


def harmonic_tables(specimen: Specimen, drive: Harmonic) -> HarmonicTables:
    """Prepare runs of a specimen under a harmonic drive."""
    omega = 2.0 * math.pi * drive.frequency_hz
    _, force = harmonic_motion(specimen, omega, drive.amplitude_m)
    flight = flight_tables(specimen, drive)
    rates = np.abs(flight.rates[:-1])
    is_rigid = isinstance(specimen.contact, RigidStops)
    is_power = isinstance(specimen.contact, PowerLaw)
    return HarmonicTables(
        flight=flight,
        power=power_terms(specimen),
        steps=power_tables(specimen, omega, force, rates) if is_power else None,
        held=held_tables(flight, bound_motion(specimen, omega, drive.amplitude_m), specimen)
        if is_rigid
        else pressed_tables(specimen, drive),
        collisions=collision_tables(specimen, omega, force, rates),
    )


def advance_harmonic(
    state: Vector, clock: Vector, until: float, tables: HarmonicTables, tolerance: float, record: Record
) -> int:
    """Advance ``state`` and ``clock`` to the instant ``until`` [s]; returns an `Outcome` code."""
    flight, power, steps, held, collisions = tables
    tangent = record.tangent
    if power is not None and steps is not None:
        return advance_under_power(state, clock, until, flight, tolerance, record, power, steps, tangent)
    workspace = workspace_for(len(flight.rates), record.observations, tangent)
    return advance_between_stops(
        state, clock, until, flight, tolerance, record, held, collisions, tangent, workspace
    )


@kernel_without_refcount
def advance_by_law(
    state: Vector,
    clock: Vector,
    until: float,
    tables: FlightTables,
    tolerance: float,
    record: Record,
    power: PowerTerms | None,
    steps: PowerTables | None,
    held: HeldTables | None,
    collisions: CollisionTables | None,
    tangent: Table | None,
    workspace: Workspace,
) -> int:
    """Do the same within a kernel; what may be None is given once more.

    numba leaves out a branch on an argument that is None, but not one on an attribute.
    """
    if power is not None and steps is not None:
        return advance_under_power(state, clock, until, tables, tolerance, record, power, steps, tangent)
    return advance_between_stops(
        state, clock, until, tables, tolerance, record, held, collisions, tangent, workspace
    )
