"""All that a run under a harmonic drive knows beforehand, whatever the law. SI units."""

import math
from typing import NamedTuple

import numpy as np

from ..collision import CollisionTables, collision_tables
from ..flight import FlightTables, flight_tables
from ..model import Harmonic, PowerLaw, RigidStops, Specimen, bound_motion, harmonic_motion
from ..power_law import PowerTables, power_tables
from ..slots import PowerTerms, power_terms
from ..sticking import HeldTables, held_tables


class HarmonicTables(NamedTuple):
    """A specimen under a harmonic drive; what its law has no use for is None, and so left out of a kernel."""

    flight: FlightTables
    power: PowerTerms | None
    """Of a power law."""
    steps: PowerTables | None
    """Of long steps under a power law."""
    held: HeldTables | None
    """Of rigid stops."""
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
        held=held_tables(flight, bound_motion(specimen, omega, drive.amplitude_m)) if is_rigid else None,
        collisions=collision_tables(specimen, omega, force, rates),
    )
