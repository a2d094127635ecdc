"""Estimation of the base gain while the frequency changes: noise is averaged and a trend is followed."""

import numpy as np
import pytest

from vibench.acquisition.control.sine_loop import GainEstimator

STEP_S = 0.1


def tracked_levels(gain_of, steps=60, memory_s=0.5, noise=0.0, seed=0):
    """Follow a gain with predicted settings; return the ratio of achieved to requested level per step."""
    random = np.random.default_rng(seed)
    estimator = GainEstimator(memory_s)
    achieved = []
    for step in range(steps):
        time_s = (step + 1) * STEP_S
        modelled = 10.0 / estimator.gain_at(time_s)
        turned = gain_of(time_s) * np.exp(0.4j) * modelled
        base = turned + 10 * noise * (random.standard_normal(1) + 1j * random.standard_normal(1))
        estimator.add(time_s, base, modelled, 10.0)
        achieved.append(abs(turned) / 10.0)
    return np.array(achieved), estimator


def test_the_level_is_exact_from_the_second_step_if_the_gain_is_constant():
    achieved, estimator = tracked_levels(lambda time_s: 0.6)
    assert achieved[0] == pytest.approx(0.6)
    np.testing.assert_allclose(achieved[1:], 1.0, rtol=1e-12)
    assert estimator.level == pytest.approx(1.0)


def test_a_steady_trend_of_the_measured_gain_is_extrapolated():
    achieved, _ = tracked_levels(lambda time_s: 1 + 0.3 * time_s)
    np.testing.assert_allclose(achieved[5:], 1.0, atol=1e-9)


def test_random_errors_of_the_measured_gain_are_averaged():
    achieved, _ = tracked_levels(lambda time_s: 1.0, steps=600, noise=0.05)
    # The memory holds six values with 5 % noise: about 2 % remains, rarely more after a linear fit.
    assert np.std(achieved[10:]) < 0.035


def test_a_level_error_after_a_jump_of_the_gain_decays_within_the_memory_of_the_estimator():
    achieved, estimator = tracked_levels(lambda time_s: 1.0 if time_s < 3 else 1.5)
    after = achieved[30:]
    assert np.all(np.abs(after[8:] - 1) < 0.01)
    assert abs(estimator.level - 1) < 0.01


def test_the_gain_remains_unknown_without_a_measurement():
    estimator = GainEstimator(0.5)
    estimator.add(0.1, np.empty(0, np.complex128), 1.0, 1.0)
    assert not estimator.is_known
    assert estimator.gain_at(1.0) == estimator.level == 1.0
