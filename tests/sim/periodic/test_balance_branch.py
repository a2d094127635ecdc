import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibench.sim import (
    PowerSpring,
    gong2025,
    harmonic_balance_branch,
    jump_frequencies,
    spring_of,
    structure_of,
)
from vibench.sim.periodic._balance_branch import raised_balance
from vibench.sim.periodic._balance_solver import BalanceOptions, balance
from vibench.sim.periodic._branch import BifurcationKind, Parameter
from vibench.sim.periodic._condensation import LinearStructure
from vibench.sim.periodic._continuation import ArcEnd, ArcSteps
from vibench.sim.periodic._harmonic_balance import BalanceEnd, HarmonicSet
from vibench.sim.periodic._restoring_force import GapSpring, NoForce

ONE = np.array([[1.0]])


def oscillator(damping, stiffness=1.0):
    """x'' + damping x' + stiffness x + F = U."""
    return LinearStructure(ONE, damping * ONE, stiffness * ONE, np.ones(1), np.ones(1), np.zeros(1))


def kinds(branch):
    return [event.kind for event in branch.events]


def test_a_first_order_branch_folds_where_the_closed_form_says():
    structure, spring = oscillator(0.04), PowerSpring(1.0, ((3, 0.5),))
    options = BalanceOptions(fewest=1, most=1)
    low, high = 0.8 / (2 * math.pi), 2.0 / (2 * math.pi)
    start = balance(structure, spring, low, 0.1, options)
    branch = harmonic_balance_branch(structure, spring, start, Parameter.FREQUENCY, high, options)
    assert branch.end is ArcEnd.REACHED_BOUND
    folds = [e.frequency_hz for e in branch.events if e.kind is BifurcationKind.FOLD]
    jumps = jump_frequencies(structure, spring, 0.1, low, high, 401)
    assert sorted(folds) == pytest.approx(jumps, rel=1e-9)


def test_between_its_folds_a_duffing_branch_is_unstable_and_a_multiplier_passes_one_there():
    structure, spring = oscillator(0.04), PowerSpring(1.0, ((3, 0.5),))
    options = BalanceOptions(fewest=7, tolerance=1e-6)
    low, high = 1.1 / (2 * math.pi), 2.0 / (2 * math.pi)
    start = balance(structure, spring, low, 0.1, options)
    branch = harmonic_balance_branch(structure, spring, start, Parameter.FREQUENCY, high, options)
    assert kinds(branch) == [BifurcationKind.FOLD, BifurcationKind.FOLD]
    first, second = (event.index for event in branch.events)
    assert np.all(branch.is_stable[: first + 1])
    assert not np.any(branch.is_stable[first + 1 : second + 1])
    assert np.all(branch.is_stable[second + 1 :])
    assert branch.left_out.max() < 1e-6


def test_a_linear_branch_has_no_events_and_reaches_its_end():
    structure = structure_of(gong2025(contact="linear"))
    start = balance(structure, NoForce(), 50.0, 1e-6, BalanceOptions(fewest=1))
    branch = harmonic_balance_branch(
        structure, NoForce(), start, Parameter.FREQUENCY, 80.0, BalanceOptions(fewest=1)
    )
    assert branch.end is ArcEnd.REACHED_BOUND
    assert branch.events == ()
    assert branch.frequencies_hz[[0, -1]] == pytest.approx([50.0, 80.0])
    assert np.all(branch.is_stable)


def test_raising_the_drive_finds_the_stops_at_the_amplitude_at_which_p_equals_the_gap():
    specimen = gong2025(damping_time_s=3e-5)
    structure, spring = structure_of(specimen), spring_of(specimen)
    _, branch = raised_balance(
        structure, spring, 100.0, 5e-6, BalanceOptions(fewest=15, most=15), ArcSteps(most_points=230)
    )
    linear = balance(structure, NoForce(), 100.0, 1e-6)
    assert branch.events[0].kind is BifurcationKind.GRAZING
    assert branch.events[0].amplitude_m == pytest.approx(45e-6 / linear.response_ii[3], rel=1e-6)
    # Near a resonance a stop stiffens the motion away from it: the branch turns back at once.
    assert branch.events[1].kind is BifurcationKind.FOLD


def test_a_strong_power_law_is_reached_by_raising_the_drive():
    structure, spring = oscillator(0.1), PowerSpring(1.0, ((3, 1.0),))
    found, branch = raised_balance(structure, spring, 2.0 / (2 * math.pi), 5.0)
    assert found.outcome is BalanceEnd.CONVERGED
    assert found.amplitude_m == pytest.approx(5.0)
    assert branch.response_ii[-1] == pytest.approx(found.response_ii)
    again = periodic_defect(0.1, 1.0, found, 2.0, 5.0)
    assert again < 1e-3


def periodic_defect(damping, cubic, found, omega, force):
    """How far one period of an independent integration takes the motion from where it began."""

    def rates(time, state):
        x, v = state
        return [v, -damping * v - x - cubic * x**3 + force * math.sin(omega * time)]

    factors = 1j * omega * found.harmonics
    start = [found.relative.sum().real, (factors * found.relative).sum().real]
    end = solve_ivp(rates, (0.0, 2 * math.pi / omega), start, rtol=1e-10, atol=1e-10).y[:, -1]
    return float(np.abs(end - start).max())


def test_a_mirrored_duffing_motion_loses_or_gains_stability_where_its_symmetry_breaks():
    # x-double-dot + 0.2 x-dot + x^3 = B sin t with B from 0 to 6.
    structure, spring = oscillator(0.2, 1e-9), PowerSpring(1.0, ((3, 1.0),))
    options = BalanceOptions(fewest=15, tolerance=1e-8)
    _, branch = raised_balance(structure, spring, 1.0 / (2 * math.pi), 6.0, options, ArcSteps(longest=0.1))
    broken = [event for event in branch.events if event.kind is BifurcationKind.SYMMETRY_BREAKING]
    assert broken
    before = branch.multipliers[broken[0].index, :2]
    after = branch.multipliers[broken[0].index + 1, :2]
    assert (np.abs(before).max() - 1.0) * (np.abs(after).max() - 1.0) < 0.0


@pytest.mark.slow
def test_the_two_mass_unilateral_stop_of_nlvib_doubles_its_period_and_loses_it_on_a_torus():
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
    branch = harmonic_balance_branch(
        structure, spring, start, Parameter.FREQUENCY, 0.5 / (2 * math.pi), options, steps
    )
    omega = 2 * math.pi * branch.frequencies_hz
    assert BifurcationKind.FOLD in kinds(branch)
    doublings = [e for e in branch.events if e.kind is BifurcationKind.PERIOD_DOUBLING]
    assert len(doublings) == 2
    torus = next(e for e in branch.events if e.kind is BifurcationKind.NEIMARK_SACKER)
    assert 0.60 < 2 * math.pi * torus.frequency_hz < 0.62
    between = slice(doublings[1].index + 1, torus.index)
    assert np.all(branch.is_stable[between])
    assert omega[between].min() < 0.635 < omega[between].max()
