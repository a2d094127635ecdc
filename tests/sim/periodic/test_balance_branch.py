import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from vibench.sim import PowerSpring, first_order_states, gong2025, spring_of, structure_of
from vibench.sim.periodic.balance_branch import BalanceOptions, balance, balance_branch_within
from vibench.sim.periodic.branch import BifurcationKind
from vibench.sim.periodic.branch_following import AmplitudePath, FrequencyPath
from vibench.sim.periodic.continuation import ArcEnd, ArcSteps
from vibench.sim.periodic.harmonic_balance import BalanceEnd, HarmonicSet, LinearStructure
from vibench.sim.periodic.restoring_force import LINEAR, GapSpring

ONE = np.array([[1.0]])
ENOUGH, STEPS = BalanceOptions(), ArcSteps()


def oscillator(damping, stiffness=1.0):
    """Return the oscillator x'' + damping x' + stiffness x + F = U."""
    return LinearStructure(ONE, damping * ONE, stiffness * ONE, np.ones(1), np.ones(1), np.zeros(1))


def along_frequency(structure, spring, start, other_hz, options, steps=STEPS):
    """Return the branch from the frequency of a balance to another frequency."""
    ends = sorted((start.frequency_hz, other_hz))
    path = FrequencyPath((start.amplitude_m,))
    return balance_branch_within(structure, spring, start, path, *ends, options, steps)


def level_branch(structure, spring, frequency_hz, weak_m, strong_m, options=ENOUGH, steps=STEPS):
    """Return the branch over the drive level, from a weak level with nearly linear response."""
    start = balance(structure, spring, frequency_hz, weak_m, options)
    path = AmplitudePath(frequency_hz)
    return balance_branch_within(structure, spring, start, path, weak_m, strong_m, options, steps)


def kinds(branch):
    return [event.kind for event in branch.events]


def test_a_branch_of_first_order_balance_folds_at_the_closed_form_frequencies():
    zeta, alpha, force = 0.02, 0.5, 0.1
    structure, spring = oscillator(2.0 * zeta), PowerSpring(1.0, ((3, alpha),))
    options = BalanceOptions(fewest=1, most=1)
    low, high = 0.8 / (2 * math.pi), 2.0 / (2 * math.pi)
    start = balance(structure, spring, low, force, options)
    branch = along_frequency(structure, spring, start, high, options)
    assert branch.end is ArcEnd.REACHED_BOUND
    folds = sorted(e.frequency_hz for e in branch.events if e.kind is BifurcationKind.FOLD)
    assert len(folds) == 2
    for frequency in folds:
        omega = 2.0 * math.pi * frequency
        # At a fold, d/d(a^2) of a^2 ((1 - W^2 + 3/4 alpha a^2)^2 + (2 zeta W)^2) is zero.
        detuning = 1.0 - omega**2
        squares = np.roots(
            [27.0 / 16.0 * alpha**2, 3.0 * alpha * detuning, detuning**2 + (2 * zeta * omega) ** 2]
        ).real
        forces = np.sqrt(squares * ((detuning + 0.75 * alpha * squares) ** 2 + (2 * zeta * omega) ** 2))
        assert np.min(np.abs(forces - force)) < 1e-9
    inside = first_order_states(structure, spring, 0.5 * sum(folds), force)
    assert [state.is_stable_to_amplitude for state in inside] == [True, False, True]
    assert len(first_order_states(structure, spring, folds[0] * 0.999, force)) == 1
    assert len(first_order_states(structure, spring, folds[1] * 1.001, force)) == 1


@pytest.mark.thorough
def test_the_phase_resonance_of_a_duffing_oscillator_runs_along_the_exact_backbone():
    # Free motion of x'' + x + alpha x^3: omega = pi sqrt(1 + alpha a^2) / (2 K(m)).
    alpha, options = 0.5, BalanceOptions(fewest=15, tolerance=1e-8)
    structure, spring = oscillator(2e-3), PowerSpring(1.0, ((3, alpha),))
    for forced in (1e-3, 4e-3):
        start = balance(structure, spring, 0.9 / (2 * math.pi), forced, options)
        branch = along_frequency(structure, spring, start, 3.0 / (2 * math.pi), options)
        k = int(np.argmax(branch.frequencies_hz * branch.response_ii[:, 0]))
        size = branch.response_i[k, 0] * forced
        modulus = alpha * size**2 / (2.0 * (1.0 + alpha * size**2))
        backbone = math.pi * math.sqrt(1.0 + alpha * size**2) / (2.0 * ellipk(modulus))
        assert size > 0.4
        assert 2 * math.pi * branch.frequencies_hz[k] == pytest.approx(backbone, rel=1e-4)


@pytest.mark.thorough
def test_a_duffing_branch_is_unstable_between_its_folds():
    structure, spring = oscillator(0.04), PowerSpring(1.0, ((3, 0.5),))
    options = BalanceOptions(fewest=7, tolerance=1e-6)
    low, high = 1.1 / (2 * math.pi), 2.0 / (2 * math.pi)
    start = balance(structure, spring, low, 0.1, options)
    branch = along_frequency(structure, spring, start, high, options)
    assert kinds(branch) == [BifurcationKind.FOLD, BifurcationKind.FOLD]
    first, second = (event.index for event in branch.events)
    assert np.all(branch.is_stable[: first + 1])
    assert not np.any(branch.is_stable[first + 1 : second + 1])
    assert np.all(branch.is_stable[second + 1 :])
    assert branch.left_out.max() < 1e-6


def test_a_harmonic_balance_that_does_not_converge_is_not_reported_as_converged():
    # The motion at 260 Hz and 5 um is chaotic, so 31 harmonics cannot converge.
    structure, spring = structure_of(gong2025()), spring_of(gong2025())
    found = balance(structure, spring, 260.0, 5e-6, BalanceOptions(fewest=15, most=31))
    assert found.outcome is not BalanceEnd.CONVERGED


def test_a_branch_over_amplitude_grazes_where_the_linear_motion_equals_the_gap():
    specimen = gong2025(damping_time_s=3e-5)
    structure, spring = structure_of(specimen), spring_of(specimen)
    options, steps = BalanceOptions(fewest=15, most=15), ArcSteps(most_points=230)
    branch = level_branch(structure, spring, 100.0, 0.5e-6, 5e-6, options, steps)
    linear = balance(structure, LINEAR, 100.0, 1e-6)
    assert branch.events[0].kind is BifurcationKind.GRAZING
    assert branch.events[0].amplitude_m == pytest.approx(45e-6 / linear.response_ii[3], rel=1e-6)
    # Contact stiffens the specimen away from its resonance, so the branch folds at once.
    assert branch.events[1].kind is BifurcationKind.FOLD


@pytest.mark.thorough
def test_a_branch_over_amplitude_reaches_a_strongly_nonlinear_motion():
    structure, spring = oscillator(0.1), PowerSpring(1.0, ((3, 1.0),))
    branch = level_branch(structure, spring, 2.0 / (2 * math.pi), 0.1, 5.0)
    assert branch.end is ArcEnd.REACHED_BOUND
    assert branch.amplitudes_m[-1] == pytest.approx(5.0)
    assert periodic_defect(0.1, 1.0, branch.states[-1], 2.0, 5.0) < 1e-3


def periodic_defect(damping, cubic, start, omega, force):
    """Return the distance between the states before and after one period, integrated by scipy."""

    def rates(time, state):
        x, v = state
        return [v, -damping * v - x - cubic * x**3 + force * math.sin(omega * time)]

    end = solve_ivp(rates, (0.0, 2 * math.pi / omega), start, rtol=1e-10, atol=1e-10).y[:, -1]
    return float(np.abs(end - start).max())


def test_a_duffing_branch_changes_stability_where_its_symmetry_breaks():
    # Oscillator: x'' + 0.2 x' + x^3 = B sin t, with B up to 6.
    structure, spring = oscillator(0.2, 1e-9), PowerSpring(1.0, ((3, 1.0),))
    options = BalanceOptions(fewest=15, tolerance=1e-8)
    branch = level_branch(structure, spring, 1.0 / (2 * math.pi), 0.1, 6.0, options, ArcSteps(longest=0.1))
    broken = [event for event in branch.events if event.kind is BifurcationKind.SYMMETRY_BREAKING]
    assert broken
    before = branch.multipliers[broken[0].index, :2]
    after = branch.multipliers[broken[0].index + 1, :2]
    assert (np.abs(before).max() - 1.0) * (np.abs(after).max() - 1.0) < 0.0


@pytest.mark.slow
def test_the_nlvib_example_3_has_its_published_bifurcations():
    # Krack and Gross, NLvib, example 03: 21 harmonics, from 0.8 to 0.5 rad/s. Its authors report turning
    # points, period doubling near the peak, a stable motion at 0.635, and a Neimark-Sacker point above 0.60.
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    structure = LinearStructure(
        np.eye(2), 0.03 * stiffness, stiffness, np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.zeros(2)
    )
    spring = GapSpring(100.0, 1.0, 1.0, math.inf)
    options = BalanceOptions(HarmonicSet.ALL, fewest=21, most=21, tolerance=1e-2)
    start = balance(structure, spring, 0.8 / (2 * math.pi), 0.1, options)
    steps = ArcSteps(first=0.05, longest=0.3, most_points=1500)
    branch = along_frequency(structure, spring, start, 0.5 / (2 * math.pi), options, steps)
    omega = 2 * math.pi * branch.frequencies_hz
    assert BifurcationKind.FOLD in kinds(branch)
    doublings = [e for e in branch.events if e.kind is BifurcationKind.PERIOD_DOUBLING]
    assert len(doublings) == 2
    torus = next(e for e in branch.events if e.kind is BifurcationKind.NEIMARK_SACKER)
    assert 0.60 < 2 * math.pi * torus.frequency_hz < 0.62
    between = slice(doublings[1].index + 1, torus.index)
    assert np.all(branch.is_stable[between])
    assert omega[between].min() < 0.635 < omega[between].max()
