"""Conversion of a specimen and a harmonic drive to structures of the native engine."""

import cmath
import math
from dataclasses import replace
from functools import cache
from threading import Lock

from ..specimen.contact_laws import Hertz, LinearGap, NoContact, PowerLaw, RigidStops
from ..specimen.drive import Harmonic
from ..specimen.modes import ModalForm, bound_motion, harmonic_motion, modal_form
from ..specimen.specimen import Complex, Specimen, Y, Z
from .library import Engine, Structure
from .shapes import (
    ABOUT_MIDDLE,
    AT_END,
    AT_START,
    COURSE,
    GAUSS_POINTS,
    GAUSS_WEIGHTS,
    HEIGHTS,
    INSTANT_SLOPES,
    INSTANT_WEIGHTS,
    INSTANTS,
    POINT_WEIGHTS,
    POINTS,
    POINTS_AT,
    POWER_SHARES,
    SHARES,
    collision_shapes,
)

NO_STOPS, HERTZ, YIELDING, SPRINGS, RIGID, POWERS = range(6)
"""Numeric code of each contact law, as in the enum `Law` of native/structures.hpp."""


def scene_of(engine: Engine, specimen: Specimen, drive: Harmonic) -> Structure:
    """Return the `Scene` of native/structures.hpp for a specimen driven harmonically.

    Raises ValueError when two modes coincide.
    """
    scene = engine.new("Scene")
    omega = 2.0 * math.pi * drive.frequency_hz
    fill_specimen(scene["specimen"], specimen)
    fill_drive(scene["drive"], drive, specimen)
    _fill_free(scene["flight"], specimen, omega, drive.amplitude_m)
    match specimen.contact:
        case RigidStops():
            _fill_rigid(scene["held"], specimen, omega, drive.amplitude_m)
        case LinearGap(stiffness=stop):
            _fill_springs(scene, specimen, stop, omega, drive.amplitude_m)
        case PowerLaw() as law:
            fill_power(engine, scene, law)
        case Hertz():
            scene["collisions"] = collision_structure(engine).ctypes.data
    return scene


def fill_power(engine: Engine, scene: Structure, law: PowerLaw) -> None:
    """Fill the power-law part of the engine's `Scene` or `CubicScene`."""
    _fill_power(scene["power"], law)
    scene["power_shapes"] = power_structure(engine).ctypes.data


def fill_cell(target: Structure, cell: Specimen, next_stiffness: float, next_damping: float) -> None:
    """Fill a `CellKind` with the data of a cell and the k0, c0 of the next cell [N/m], [N s/m]."""
    fill_specimen(target["specimen"], cell)
    match cell.contact:
        case LinearGap():
            # In a chain, integrate contacts with linear stops in time steps; there is no exact solution.
            target["specimen"]["law"] = YIELDING
        case PowerLaw() as law:
            _fill_power(target["power"], law)
    target["next_stiffness"], target["next_damping"] = next_stiffness, next_damping


def fill_drive(target: Structure, drive: Harmonic, first: Specimen) -> None:
    """Fill a `Drive` with frequency, phase and the force on the m0 that is coupled to the base."""
    _, force = harmonic_motion(first, 2.0 * math.pi * drive.frequency_hz, drive.amplitude_m)
    target["frequency"] = drive.frequency_hz
    target["start"] = cmath.exp(1j * drive.phase_rad)
    target["force"] = force


def power_structure(engine: Engine) -> Structure:
    """Return the engine's `PowerShapes`: the tables for time steps under power laws."""
    with _ONE_THREAD:
        return _power_structure(engine)


def collision_structure(engine: Engine) -> Structure:
    """Return the engine's `CollisionShapes`: the tables for Hertz collisions."""
    with _ONE_THREAD:
        return _collision_structure(engine)


# The tables of a run point to these structures, so they must never be freed. Without the lock, two threads
# could each create a structure at the first call, and the cache would free one of the two.
_ONE_THREAD = Lock()


@cache
def _power_structure(engine: Engine) -> Structure:
    shapes = engine.new("PowerShapes")
    shapes["points"], shapes["weights"] = POINTS_AT, GAUSS_WEIGHTS
    shapes["shares"] = POWER_SHARES[:, :, :GAUSS_POINTS]
    shapes["ends"] = POWER_SHARES[:, :, GAUSS_POINTS]
    shapes["at_start"], shapes["at_end"], shapes["course"] = AT_START, AT_END, COURSE
    shapes["point_weights"], shapes["instants"] = POINT_WEIGHTS, INSTANTS
    shapes["instant_weights"], shapes["instant_slopes"] = INSTANT_WEIGHTS, INSTANT_SLOPES
    return shapes


@cache
def _collision_structure(engine: Engine) -> Structure:
    solved = engine.new("CollisionShapes")
    solved["shares"] = SHARES[:, :, :POINTS]
    solved["ends"] = SHARES[:, :, POINTS].T
    solved["weights"] = SHARES[0, :, POINTS]
    solved["heights"] = HEIGHTS
    solved["about_middle"] = ABOUT_MIDDLE
    solved["shapes"], solved["durations"] = collision_shapes()
    return solved


def fill_specimen(target: Structure, specimen: Specimen) -> None:
    """Fill the engine's `Specimen` (native/structures.hpp) from a specimen."""
    for name, values in (("m", specimen.masses), ("k", specimen.stiffnesses), ("c", specimen.dampings)):
        for index, value in enumerate(values):
            target[f"{name}{index}"] = value
    target["lower_gap"], target["upper_gap"] = specimen.gaps_m
    stops = specimen.contact.stops
    target["linear_stiffness"] = stops.linear_stiffness
    target["contact_stiffness"] = stops.contact_stiffness
    target["loss"] = stops.loss
    match specimen.contact:
        case NoContact():
            target["law"] = NO_STOPS
            target["lower_gap"] = target["upper_gap"] = math.inf
        case Hertz():
            target["law"] = HERTZ
        case LinearGap():
            target["law"] = SPRINGS
        case RigidStops(restitution=restitution):
            target["law"], target["restitution"] = RIGID, restitution
        case PowerLaw():
            target["law"] = POWERS
        case _:
            target["law"] = YIELDING


def _fill_power(target: Structure, law: PowerLaw) -> None:
    count = len(law.terms)
    target["reference"], target["terms"] = law.reference, count
    target["exponents"][:count] = [exponent for exponent, _ in law.terms]
    target["forces"][:count] = [force for _, force in law.terms]


def _fill_free(target: Structure, specimen: Specimen, omega: float, amplitude_m: float) -> None:
    steady, _ = harmonic_motion(specimen, omega, amplitude_m)
    _fill_motion(target, modal_form(specimen), steady)


def _fill_rigid(target: Structure, specimen: Specimen, omega: float, amplitude_m: float) -> None:
    """Fill the modal data of the motion while m1 sticks to a rigid stop; the stop can only push m1."""
    bound = bound_motion(specimen, omega, amplitude_m)
    _fill_motion(target["motion"], bound.modes, bound.steady)
    m1, m2 = specimen.masses[1:]
    target["pulls"][: len(bound.pulls)] = bound.pulls / m2
    target["let_go"], target["rests"] = specimen.stiffnesses[1] * (1.0 / m1 + 1.0 / m2), 1.0


def _fill_springs(
    scene: Structure, specimen: Specimen, stop: float, omega: float, amplitude_m: float
) -> None:
    """Fill the modal data of contact with a linear stop: a spring parallel to k1, shifted equilibrium."""
    k0, k1, k2 = specimen.stiffnesses
    pressed = replace(specimen, stiffnesses=(k0, k1 + stop, k2), contact=NoContact())
    held = scene["held"]
    try:
        _fill_free(held["motion"], pressed, omega, amplitude_m)
    except ValueError:
        # Two modes in contact coincide, so there is no exact solution: integrate contacts in time steps.
        scene["specimen"]["law"] = YIELDING
        return
    steady = held["motion"]["steady"]
    count = int(held["motion"]["modes"])
    held["pulls"][:count] = (held["motion"]["shapes"][:, Y] - held["motion"]["shapes"][:, Z])[:count]
    held["pulls"][count] = steady[Y] - steady[Z]
    held["let_go"], held["rests"] = k1 / (k1 + stop), stop / (k1 + stop)


def _fill_motion(target: Structure, modes: ModalForm, steady: Complex) -> None:
    target["modes"] = count = len(modes.rates)
    for name, values in modes._asdict().items():
        target[name][:count] = values
    target["steady"] = steady
