import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from benchmarks.independent_solution import independent_state, state_error
from tests.sim.as_written import free_state_matrix
from vibench.sim import Accuracy, Harmonic, RigidStops, gong2025, integrate

STILL = Harmonic(100.0, 0.0)
MOVING = np.array([0.0, 0.0, 0.0, 0.0, 0.2, -0.1])


def test_the_independent_solution_without_contact_is_the_matrix_exponential():
    specimen, drive = gong2025(contact="linear"), Harmonic(130.0, 20e-6, 0.3)
    omega = 2.0 * math.pi * drive.frequency_hz
    field = np.zeros((8, 8))
    field[:6, :6] = free_state_matrix(specimen)
    field[3, 6] = specimen.stiffnesses[0] / specimen.masses[0]
    field[3, 7] = specimen.dampings[0] * omega / specimen.masses[0]
    field[6, 7], field[7, 6] = omega, -omega
    base = drive.amplitude_m * np.array([math.sin(0.3), math.cos(0.3)])
    exact = expm(0.05 * field) @ np.concatenate([MOVING, base])
    assert state_error(independent_state(specimen, drive, 0.05, MOVING), exact[:6]) < 1e-11


@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "hunt_crossley:0.5", "power:3+7", "power:47"])
def test_the_engine_at_reference_accuracy_matches_the_independent_solution(contact):
    specimen, drive = gong2025(contact=contact), Harmonic(130.0, 20e-6, 0.3)
    state = independent_state(specimen, drive, 0.002, MOVING)
    engine = integrate(specimen, drive, 0.002, Accuracy.REFERENCE, MOVING).final_state
    assert state_error(engine, state) < 1e-8


def test_an_initial_state_beyond_the_gap_is_in_contact():
    specimen = gong2025()
    pressed = np.array([0.0, 47e-6, 0.0, 0.0, 0.0, 0.0])
    engine = integrate(specimen, STILL, 0.01, Accuracy.REFERENCE, pressed).final_state
    assert state_error(engine, independent_state(specimen, STILL, 0.01, pressed)) < 1e-8


def test_rigid_stops_are_refused_by_the_independent_solution():
    with pytest.raises(ValueError, match="Rigid stops have no finite contact force"):
        independent_state(replace(gong2025(), contact=RigidStops(0.8)), STILL, 0.01, MOVING)
