import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.sim.as_written import free_state_matrix
from vibench.sim import Accuracy, Harmonic, PowerSpring, gong2025, integrate, spring_of, structure_of
from vibench.sim.periodic.balance_branch import BalanceOptions, Guess, balance
from vibench.sim.periodic.floquet import Motion, crossings, multipliers, transition
from vibench.sim.periodic.harmonic_balance import LinearStructure, phasors_of
from vibench.sim.periodic.restoring_force import LINEAR, GapSpring

ONE = np.array([[1.0]])


def oscillator(damping=0.05, stiffness=1.0):
    return LinearStructure(ONE, damping * ONE, stiffness * ONE, np.ones(1), np.ones(1), np.zeros(1))


def test_floquet_multipliers_without_a_spring_match_the_modes():
    specimen = gong2025()
    motion = Motion(130.0, np.array([1]), np.array([1e-6 + 0j]))
    found = multipliers(transition(structure_of(specimen), LINEAR, motion))
    expected = np.exp(np.linalg.eigvals(free_state_matrix(specimen)) / 130.0)
    for value in expected:
        assert np.abs(found - value).min() < 1e-8


@pytest.mark.parametrize(
    "spring",
    [PowerSpring(0.5, ((3, 0.4),)), GapSpring(30.0, 1.0, 0.6, 0.6), GapSpring(30.0, 1.5, 0.6, math.inf)],
)
def test_the_evolution_of_perturbations_matches_an_independent_integrator(spring):
    structure = oscillator()
    motion = Motion(0.2, np.array([1, 3]), np.array([1.0 - 0.2j, 0.1j]))

    def rates(time, flat):
        turn = np.array([2.0 * math.pi * 0.2 * time])
        stiff = 1.0 + spring.stiffness(motion.p(turn), motion.rate(turn))[0]
        system = np.array([[0.0, 1.0], [-stiff, -0.05]])
        return (system @ flat.reshape(2, 2)).ravel()

    # Integrate between beginnings and ends of contacts, where the stiffness jumps.
    edges = [0.0, *crossings(spring, motion, 2.0 * math.pi), 2.0 * math.pi]
    state = np.eye(2).ravel()
    for start, stop in pairwise(edges):
        span = (start / (2.0 * math.pi * 0.2), stop / (2.0 * math.pi * 0.2))
        state = solve_ivp(rates, span, state, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(transition(structure, spring, motion), state.reshape(2, 2), atol=5e-6)


def test_the_volume_spanned_by_perturbations_shrinks_only_by_damping():
    # Liouville: det = exp(-tr(M^-1 C) T), independent of the contact.
    specimen = gong2025(damping_time_s=3e-5)
    motion = Motion(130.0, np.array([1, 3]), np.array([50e-6 + 0j, 5e-6j]))
    monodromy = transition(structure_of(specimen), spring_of(specimen), motion)
    assert np.log(np.linalg.det(monodromy)) == pytest.approx(-390.081 / 130.0, rel=1e-6)


def test_the_floquet_multipliers_of_an_impacting_orbit_match_the_exact_flow():
    specimen, drive = gong2025(damping_time_s=3e-5), Harmonic(100.0, 5e-6)
    start = integrate(specimen, drive, 3.0, Accuracy.REFERENCE).final_state
    units = np.array([1e-10] * 3 + [1e-7] * 3)

    def one_period(state, rate=None):
        return integrate(
            specimen, drive, 0.01, Accuracy.REFERENCE, state, sample_rate_hz=rate, start_time_s=3.0
        )

    columns = [
        (one_period(start + u * e).final_state - one_period(start - u * e).final_state) / (2.0 * u)
        for u, e in zip(units, np.eye(6), strict=True)
    ]
    exact = multipliers(np.array(columns).T)
    states = one_period(start, 819_200.0).states[:-1]
    lines = phasors_of(states[:, 1] - states[:, 2])
    options = BalanceOptions(fewest=801, most=801)
    guess = Guess(np.arange(1000), lines[:1000])
    found = balance(structure_of(specimen), spring_of(specimen), 100.0, 5e-6, options, guess)
    motion = Motion(100.0, found.harmonics, found.relative)
    values = multipliers(transition(structure_of(specimen), spring_of(specimen), motion))
    for value in exact:
        assert np.abs(values - value).min() < 5e-4
