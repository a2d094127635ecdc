"""Branches of harmonic balances against closed forms and against exact branches."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

from vibench.sim import (
    BalanceOptions,
    FrequencyPath,
    Harmonic,
    HarmonicSet,
    PowerSpring,
    first_order_states,
    gong2025,
    spring_of,
    structure_of,
)
from vibench.sim.branches import MotionSearch, balanced_branches, shot_branches
from vibench.sim.periodic.balance_branch import balance, balance_branch_within
from vibench.sim.periodic.harmonic_balance import LinearStructure

ONE = np.array([[1.0]])
FIRST = BalanceOptions(HarmonicSet.ODD, fewest=1, most=1)


def test_the_phase_resonance_of_a_duffing_oscillator_runs_along_the_exact_backbone():
    # Free motion of x'' + x + alpha x^3: omega = pi sqrt(1 + alpha a^2) / (2 K(m)).
    damping, alpha = 2e-3, 0.5
    structure = LinearStructure(ONE, damping * ONE, ONE, np.ones(1), np.ones(1), np.zeros(1))
    spring, options = PowerSpring(1.0, ((3, alpha),)), BalanceOptions(fewest=15, tolerance=1e-8)
    for forced in (1e-3, 4e-3):
        low, high = 0.9 / (2 * math.pi), 3.0 / (2 * math.pi)
        start = balance(structure, spring, low, forced, options)
        branch = balance_branch_within(structure, spring, start, FrequencyPath((forced,)), low, high, options)
        k = int(np.argmax(branch.frequencies_hz * branch.response_ii[:, 0]))
        size = branch.response_i[k, 0] * forced
        modulus = alpha * size**2 / (2.0 * (1.0 + alpha * size**2))
        backbone = math.pi * math.sqrt(1.0 + alpha * size**2) / (2.0 * ellipk(modulus))
        assert size > 0.4
        assert 2 * math.pi * branch.frequencies_hz[k] == pytest.approx(backbone, rel=1e-4)


@pytest.mark.thorough
@pytest.mark.parametrize("amplitude", [1e-6, 5e-6, 50e-6])
def test_every_point_of_a_first_order_branch_solves_the_papers_equation_five(amplitude):
    specimen = gong2025(contact="power:5")
    structure, spring = structure_of(specimen), spring_of(specimen)
    search = MotionSearch(places=12)
    found = list(balanced_branches(specimen, FrequencyPath((amplitude,)), 60.0, 560.0, FIRST, search))
    for each in found:
        for k in range(0, len(each.branch.frequencies_hz), 5):
            states = first_order_states(structure, spring, float(each.branch.frequencies_hz[k]), amplitude)
            # Beside a fold two solutions meet, and each is known to the root of what the equation is.
            sizes = [abs(state.relative) / amplitude for state in states]
            assert np.min(np.abs(np.array(sizes) / each.branch.response_ii[k, 3] - 1.0)) < 1e-6
    # And each solution of the equation, at frequencies not searched, is on one of the branches.
    for frequency in np.linspace(65.0, 555.0, 23):
        drive = Harmonic(float(frequency), amplitude)
        for state in first_order_states(structure, spring, drive.frequency_hz, amplitude):
            assert any(
                _passes(each.branch, drive.frequency_hz, abs(state.relative) / amplitude) for each in found
            )


def _passes(branch, frequency, size):
    along = branch.frequencies_hz
    for k in np.flatnonzero((along[:-1] - frequency) * (along[1:] - frequency) <= 0.0):
        ends = branch.response_ii[k : k + 2, 3]
        if 0.9 * ends.min() <= size <= 1.1 * ends.max():
            return True
    return False


@pytest.mark.thorough
def test_with_many_harmonics_a_balance_follows_the_exact_branch():
    specimen, path = gong2025(contact="power:5"), FrequencyPath((5e-6,))
    options = BalanceOptions(HarmonicSet.ODD, fewest=15, most=127, tolerance=1e-6)
    search = MotionSearch(places=2, starts=2)
    balanced = next(balanced_branches(specimen, path, 60.0, 90.0, options, search)).branch
    exact = next(shot_branches(specimen, path, 60.0, 90.0, search)).branch
    assert not np.any(np.diff(exact.frequencies_hz) <= 0.0)
    here = np.interp(balanced.frequencies_hz, exact.frequencies_hz, exact.response_ii[:, 0])
    assert balanced.response_ii[:, 0] == pytest.approx(here, rel=1e-3)
    at_end = balanced.response_ii[[0, -1], 0]
    assert at_end == pytest.approx(exact.response_ii[[0, -1], 0], rel=1e-6)
    assert np.abs(balanced.multipliers[-1, 0]) == pytest.approx(np.abs(exact.multipliers[-1, 0]), rel=1e-4)
