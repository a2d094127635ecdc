"""The paper's equations in textbook form, for general solvers and independent checks. SI units.

This module shares nothing with the engine: it uses no modes, no special unknowns in contact, and no
polynomial instead of a sine.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..specimen.drive import Harmonic
from ..specimen.no_contact import NoContact
from ..specimen.power_law import PowerLaw
from ..specimen.rigid_stops import RigidStops
from ..specimen.specimen import Specimen
from ..specimen.state import Floats


class Place(IntEnum):
    """Position of m1 relative to the stops."""

    ON_LOWER = -1
    FLIGHT = 0
    ON_UPPER = 1
    ANYWHERE = 2
    """Determined by p."""


class Law(NamedTuple):
    """A law as numbers: (k d^exponent + beside d) (1 + loss dd/dt) at the depth d; powers of p at every p."""

    lower: float
    upper: float
    """Clearances; infinite where there is no stop."""
    stiffness: float = 0.0
    exponent: float = 1.0
    loss: float = 0.0
    reference: float = 1.0
    terms: tuple[tuple[int, float], ...] = ()
    """Exponent and force at the reference [N] of each term."""
    beside: float = 0.0
    """Stiffness of a linear spring parallel to the stop [N/m]."""


def law_of(specimen: Specimen) -> Law:
    """Return a specimen's contact law as numbers."""
    lower, upper = specimen.gaps_m
    match specimen.contact:
        case NoContact():
            return Law(np.inf, np.inf)
        case PowerLaw(reference=reference, terms=terms):
            return Law(np.inf, np.inf, reference=reference, terms=terms)
        case RigidStops():
            raise ValueError("Rigid stops have no finite contact force: give another law, such as hertz.")
        case law:
            return Law(lower, upper, *law.stops.term, law.stops.loss, beside=law.stops.spring_beside)


def numbers_of(specimen: Specimen, drive: Harmonic) -> Floats:
    """Return masses, stiffnesses, dampings, and drive amplitude, angular frequency and phase, shape (12,)."""
    of_drive = (drive.amplitude_m, 2.0 * np.pi * drive.frequency_hz, drive.phase_rad)
    return np.array([*specimen.masses, *specimen.stiffnesses, *specimen.dampings, *of_drive])


def _stop_force(depth: Floats, rate: Floats, law: Law) -> Floats:
    return (law.stiffness * depth**law.exponent + law.beside * depth) * (1.0 + law.loss * rate)


def rates(time_s: float | Floats, state: Floats, place: Place, law: Law, numbers: Floats) -> Floats:
    """Return d/dt of x, y, z, vx, vy, vz. On a stop the force is zero below depth 0; in flight there is none.

    ``state`` has shape (6,), or (6, ..., n) for n motions, each with its time and its column of ``numbers``.
    """
    m0, m1, m2, k0, k1, k2, c0, c1, c2, amplitude, omega, phase = numbers
    x, y, z, vx, vy, vz = state
    angle = omega * time_s + phase
    base, base_rate = amplitude * np.sin(angle), amplitude * omega * np.cos(angle)
    p, rate = y - z, vy - vz
    inner = k1 * p + c1 * rate
    # A trial step of an implicit method may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        if place is not Place.FLIGHT and law.stiffness > 0.0:
            inner = inner + _stop_force(np.maximum(p - law.upper, 0.0), rate, law)
            inner = inner - _stop_force(np.maximum(-p - law.lower, 0.0), -rate, law)
        for power, force in law.terms:
            inner = inner + force * (p / law.reference) ** power
        outer = k2 * (z - x) + c2 * (vz - vx)
        ahead = (outer + k0 * (base - x) + c0 * (base_rate - vx)) / m0
        return np.array([vx, vy, vz, ahead, -inner / m1, (inner - outer) / m2])
