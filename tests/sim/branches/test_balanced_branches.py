"""Harmonic-balance branches match closed forms."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

from vibench.sim import BalanceOptions, FrequencyPath, PowerSpring
from vibench.sim.periodic.balance_branch import balance, balance_branch_within
from vibench.sim.periodic.harmonic_balance import LinearStructure

ONE = np.array([[1.0]])


@pytest.mark.thorough
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
