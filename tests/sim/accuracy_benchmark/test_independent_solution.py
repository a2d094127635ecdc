import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from benchmarks.independent_solution import (
    Place,
    independent_state,
    law_of,
    numbers_of,
    rates_at,
    state_error,
)
from vibench.sim import Accuracy, Harmonic, Hertz, RigidStops, gong2025, integrate

STILL = Harmonic(100.0, 0.0)
MOVING = np.array([0.0, 0.0, 0.0, 0.0, 0.2, -0.1])


def energy(specimen, state):
    """Kinetic, elastic, and in Hertz's stops 2/5 k d^(5/2) [J]."""
    place, speed = state[:3], state[3:]
    deep = max(abs(state[1] - state[2]) - specimen.gap_m, 0.0)
    linear = 0.5 * speed @ specimen.mass_matrix @ speed + 0.5 * place @ specimen.stiffness_matrix @ place
    return linear + 0.4 * specimen.contact.stiffness * deep**2.5


def test_without_contact_it_is_the_matrix_exponential():
    specimen, drive = gong2025(contact="linear"), Harmonic(130.0, 20e-6, 0.3)
    omega = 2.0 * math.pi * drive.frequency_hz
    unit = np.linalg.inv(specimen.mass_matrix)
    field = np.zeros((8, 8))
    field[:3, 3:6] = np.eye(3)
    field[3:6, :3] = -unit @ specimen.stiffness_matrix
    field[3:6, 3:6] = -unit @ specimen.damping_matrix
    field[3, 6] = specimen.stiffnesses[0] / specimen.masses[0]
    field[3, 7] = specimen.dampings[0] * omega / specimen.masses[0]
    field[6, 7], field[7, 6] = omega, -omega
    base = drive.amplitude_m * np.array([math.sin(0.3), math.cos(0.3)])
    exact = expm(0.05 * field) @ np.concatenate([MOVING, base])
    assert state_error(independent_state(specimen, drive, 0.05, MOVING), exact[:6]) < 1e-11


def test_it_keeps_the_energy_of_an_undamped_specimen_through_many_impacts():
    specimen = gong2025(damping_time_s=0.0)
    end = independent_state(specimen, STILL, 0.02, MOVING)
    assert integrate(specimen, STILL, 0.02, initial_state=MOVING).impacts.count > 5
    assert energy(specimen, end) == pytest.approx(energy(specimen, MOVING), rel=1e-11)


def test_it_comes_back_when_time_is_turned_round():
    specimen = gong2025(damping_time_s=0.0, gap_m=(30e-6, 60e-6))
    there = independent_state(specimen, STILL, 0.01, MOVING)
    back = independent_state(specimen, STILL, 0.01, there * np.repeat([1.0, -1.0], 3))
    assert state_error(back * np.repeat([1.0, -1.0], 3), MOVING) < 1e-9


@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "hunt_crossley:0.5", "power:3+7", "power:47"])
def test_the_engine_at_reference_agrees_with_it(contact):
    specimen, drive = gong2025(contact=contact), Harmonic(130.0, 20e-6, 0.3)
    state = independent_state(specimen, drive, 0.002, MOVING)
    engine = integrate(specimen, drive, 0.002, Accuracy.REFERENCE, MOVING).final_state
    assert state_error(engine, state) < 1e-8


def test_a_tighter_tolerance_moves_it_by_no_more_than_it_claims():
    specimen, drive = gong2025(), Harmonic(130.0, 20e-6)
    usual = independent_state(specimen, drive, 0.002, MOVING)
    assert state_error(usual, independent_state(specimen, drive, 0.002, MOVING, 2.5e-14)) < 1e-11


def test_a_start_within_a_stop_is_a_start_in_contact():
    specimen = gong2025()
    pressed = np.array([0.0, 47e-6, 0.0, 0.0, 0.0, 0.0])
    engine = integrate(specimen, STILL, 0.01, Accuracy.REFERENCE, pressed).final_state
    assert state_error(engine, independent_state(specimen, STILL, 0.01, pressed)) < 1e-8


def test_its_force_is_the_law_as_written():
    specimen = replace(gong2025(), contact=Hertz(4e9))
    at = np.array([0.0, 49e-6, 0.0, 0.0, 0.0, 0.0])
    push = 4e9 * (4e-6) ** 1.5 + specimen.stiffnesses[1] * 49e-6
    rates = rates_at(Place.ANYWHERE, law_of(specimen), numbers_of(specimen, STILL))
    assert rates(0.0, at)[4] == pytest.approx(-push / specimen.masses[1])
    assert rates(0.0, -at)[4] == pytest.approx(push / specimen.masses[1])


def test_rigid_stops_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match=r"Rigid stops .* give a law that yields"):
        independent_state(replace(gong2025(), contact=RigidStops(0.8)), STILL, 0.01, MOVING)
