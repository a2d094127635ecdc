import math

import numpy as np
import pytest

from vibench.sim import (
    Accuracy,
    Harmonic,
    PowerSpring,
    base_transmissibility,
    first_order_states,
    gong2025,
    integrate,
    spring_of,
    structure_of,
)
from vibench.sim.periodic.balance_branch import BalanceOptions, Guess, balance
from vibench.sim.periodic.harmonic_balance import (
    BalanceEnd,
    BalanceProblem,
    HarmonicSet,
    LinearStructure,
    harmonics_up_to,
    phasors_of,
    waveform,
)
from vibench.sim.periodic.restoring_force import LINEAR, GapSpring

FIT_LENGTH, FIT_FORCE = 46e-6, 4.891e9 * 1e-6**1.5
SETTLED_S = 3.0
SAMPLES = 16384


@pytest.fixture(scope="module", params=[(100.0, 5e-6), (130.0, 20e-6)])
def exact_orbit(request):
    """A periodic motion with impacts by integration: specimen, drive, harmonics of x and p."""
    frequency, amplitude = request.param
    specimen, drive = gong2025(damping_time_s=3e-5), Harmonic(frequency, amplitude)
    settled = integrate(specimen, drive, SETTLED_S, Accuracy.REFERENCE)
    period = integrate(
        specimen,
        drive,
        1.0 / frequency,
        Accuracy.REFERENCE,
        settled.final_state,
        sample_rate_hz=SAMPLES * frequency,
        start_time_s=SETTLED_S,
    )
    assert np.abs(period.final_state - settled.final_state).max() < 1e-12
    x, p = period.states[:-1, 0], period.states[:-1, 1] - period.states[:-1, 2]
    return specimen, drive, phasors_of(x), phasors_of(p)


def balance_of(orbit, highest):
    specimen, drive, _, p = orbit
    options = BalanceOptions(fewest=highest, most=highest)
    start = Guess(np.arange(2000), p[:2000])
    return balance(
        structure_of(specimen), spring_of(specimen), drive.frequency_hz, drive.amplitude_m, options, start
    )


@pytest.mark.parametrize(("highest", "error"), [(101, 3e-4), (201, 2e-5), (401, 3e-6)])
def test_harmonic_balance_with_contact_converges_to_the_exact_orbit(exact_orbit, highest, error):
    _, drive, x, p = exact_orbit
    found = balance_of(exact_orbit, highest)
    assert found.outcome is not BalanceEnd.NO_SOLUTION
    assert found.response_ii[0] == pytest.approx(abs(x[1]) / drive.amplitude_m, rel=error)
    # The estimated error is within a factor of 10 below and 100 above the true error.
    true_error = abs(found.response_ii[3] * drive.amplitude_m / abs(p[1]) - 1.0)
    assert 0.1 * true_error < found.left_out < 100.0 * true_error


def test_the_largest_displacement_matches_the_exact_orbit(exact_orbit):
    _, drive, _, p = exact_orbit
    found = balance_of(exact_orbit, 401)
    largest = np.abs(waveform(p, np.arange(len(p)), SAMPLES)).max()
    assert found.response_i[3] == pytest.approx(largest / drive.amplitude_m, rel=1e-5)


def test_a_balance_with_too_few_harmonics_is_reported(exact_orbit):
    few = balance_of(exact_orbit, 21)
    assert few.outcome is BalanceEnd.NO_SOLUTION
    more = balance_of(exact_orbit, 101)
    assert more.outcome is BalanceEnd.TOO_FEW_HARMONICS
    assert balance_of(exact_orbit, 401).outcome is BalanceEnd.CONVERGED


@pytest.mark.parametrize("kept", list(HarmonicSet))
def test_harmonic_balance_without_a_spring_gives_the_exact_linear_response(kept):
    specimen = gong2025(contact="linear")
    found = balance(structure_of(specimen), LINEAR, 266.0, 5e-6, BalanceOptions(kept=kept))
    assert found.outcome is BalanceEnd.CONVERGED
    assert found.response_ii == pytest.approx(np.abs(base_transmissibility(specimen, 266.0)[0]), rel=1e-10)
    assert found.response_i == pytest.approx(found.response_ii, rel=1e-8)


@pytest.mark.parametrize("exponent", [3, 5, 47])
def test_harmonic_balance_with_one_harmonic_is_the_analytical_solution_of_the_paper(exponent):
    structure, spring = structure_of(gong2025()), PowerSpring(FIT_LENGTH, ((exponent, FIT_FORCE),))
    (state,) = first_order_states(structure, spring, 60.0, 5e-6)
    found = balance(structure, spring, 60.0, 5e-6, BalanceOptions(fewest=1, most=1))
    assert found.relative[0] == pytest.approx(state.relative, rel=1e-9)
    assert found.displacements[0] == pytest.approx(state.displacements, rel=1e-9)


@pytest.mark.parametrize(
    "spring",
    [
        PowerSpring(1.0, ((3, 0.5), (7, 2.0))),
        GapSpring(100.0, 1.5, 0.5, 0.8, loss=0.3),
        GapSpring(50.0, 2.5, 0.3, math.inf),
        GapSpring(100.0, 1.5, 0.5, 0.8, loss=0.3, beside=40.0),
    ],
)
def test_the_jacobian_and_both_parameter_derivatives_are_the_derivatives_of_the_residual(spring):
    structure = two_masses(0.03)
    problem = BalanceProblem(structure, spring, harmonics_up_to(7, HarmonicSet.ALL))
    unknowns = np.random.default_rng(5).normal(size=problem.size)
    _, jacobian, by_omega, by_amplitude = problem.linearise(unknowns, 0.9, 0.2)

    def residual(unknowns, omega, amplitude):
        return problem.linearise(unknowns, omega, amplitude)[0]

    step, size = 1e-6, np.abs(jacobian).max()
    columns = [
        (residual(unknowns + step * e, 0.9, 0.2) - residual(unknowns - step * e, 0.9, 0.2)) / (2 * step)
        for e in np.eye(problem.size)
    ]
    np.testing.assert_allclose(jacobian, np.array(columns).T, atol=1e-5 * size)
    slope = (residual(unknowns, 0.9 + step, 0.2) - residual(unknowns, 0.9 - step, 0.2)) / (2 * step)
    np.testing.assert_allclose(by_omega, slope, atol=1e-6 * np.abs(slope).max())
    slope = residual(unknowns, 0.9, 1.2) - residual(unknowns, 0.9, 0.2)
    np.testing.assert_allclose(by_amplitude, slope, atol=1e-9 * np.abs(slope).max())


def test_mirrored_one_sided_stops_give_means_of_opposite_sign():
    structure, options = two_masses(0.1), BalanceOptions(kept=HarmonicSet.ALL)
    above = balance(structure, GapSpring(5.0, 1.0, 0.05, math.inf), 0.1, 0.05, options)
    below = balance(structure, GapSpring(5.0, 1.0, math.inf, 0.05), 0.1, 0.05, options)
    assert above.outcome is below.outcome is BalanceEnd.CONVERGED
    assert above.relative[0].real < -1e-3
    assert below.relative[0].real == pytest.approx(-above.relative[0].real, rel=1e-9)
    assert below.response_ii == pytest.approx(above.response_ii, rel=1e-9)


def test_odd_harmonics_are_refused_for_unequal_stops():
    with pytest.raises(ValueError, match="unequal stops"):
        balance(two_masses(0.1), GapSpring(1.0, 1.0, 0.1, math.inf), 0.1, 0.01)


def two_masses(damping_time):
    """Return two unit masses on springs; the second has the nonlinear spring force and the drive."""
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    push = np.array([0.0, 1.0])
    return LinearStructure(np.eye(2), damping_time * stiffness, stiffness, push, push, np.zeros(2))
