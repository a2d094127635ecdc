"""The growth of a perturbation over a long time is computed without overflow."""

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, gong2025
from vibench.sim.scene.followed_run import FollowedRun

SLICE_S, SLICES = 0.25, 8
LOST_E = 10.0
"""Factors of e by which growth may differ, because each new small change first turns into its direction."""


@pytest.mark.parametrize(("frequency_hz", "amplitude_m"), [(300.0, 20e-6), (200.0, 30e-6)])
def test_the_growth_of_perturbations_over_a_run_is_the_product_over_its_parts(frequency_hz, amplitude_m):
    drive = Harmonic(frequency_hz, amplitude_m)
    whole = FollowedRun(gong2025(), drive, Accuracy.STANDARD.tolerance, np.zeros(6))
    whole.follow_tangent()
    for number in range(1, SLICES + 1):
        piece = whole.copy()
        piece.follow_tangent()
        grown = whole.follow(number * SLICE_S).growth
        assert grown == pytest.approx(piece.follow(number * SLICE_S).growth, abs=LOST_E)
