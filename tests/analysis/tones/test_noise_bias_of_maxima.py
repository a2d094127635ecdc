"""The bias of a maximum by noise matches repeated draws."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import quad
from scipy.special import erf

from vibench.analysis.tones import noise_lift


def test_the_maximum_of_one_second_of_noise_is_4_4_standard_deviations():
    exact, _ = quad(lambda z: 1 - erf(z / np.sqrt(2)) ** 51_200, 0, 8, limit=200)
    assert noise_lift(np.zeros(51_200), 1.0, 51_200).bias == pytest.approx(exact, abs=2e-3)
    assert exact == pytest.approx(4.4, abs=0.05)


@pytest.mark.parametrize("noise_sd", [0.02, 0.2])
def test_the_increase_of_the_maximum_of_a_sine_caused_by_noise_matches_repeated_draws(noise_sd):
    rng = np.random.default_rng(1)
    motion = np.cos(2 * np.pi * 0.037 * np.arange(2000))
    drawn = [np.max(np.abs(motion + noise_sd * rng.standard_normal(2000))) - 1 for _ in range(400)]
    assert noise_lift(motion, noise_sd, 2000).bias == pytest.approx(
        np.mean(drawn), abs=4 * np.std(drawn) / 20 + 0.02 * noise_sd
    )


def test_zero_noise_gives_no_bias_and_the_bias_scales_with_the_unit():
    motion = np.random.default_rng(2).standard_normal(500)
    assert noise_lift(motion, 0.0, 500) == (0, 0)
    assert noise_lift(1e-6 * motion, 1e-7, 500).bias == pytest.approx(
        1e-6 * noise_lift(motion, 0.1, 500).bias, rel=1e-3
    )


@given(
    motion=arrays(np.float64, st.integers(1, 60), elements=st.floats(-1, 1)),
    noise_sd=st.floats(1e-6, 1e3),
    independent=st.floats(0.1, 100.0),
)
def test_noise_never_lowers_a_maximum_and_bounds_include_the_increase(motion, noise_sd, independent):
    lift = noise_lift(motion, noise_sd, independent)
    assert 0.0 <= lift.bias <= lift.error < np.inf


def test_the_error_of_a_maximum_includes_the_scatter_and_the_increase_by_noise():
    rng = np.random.default_rng(1)
    for motion in (np.cos(2 * np.pi * 0.037 * np.arange(2000)), np.eye(1, 50)[0]):
        drawn = [np.max(np.abs(motion + 0.1 * rng.standard_normal(motion.size))) - 1 for _ in range(2000)]
        assert noise_lift(motion, 0.1, motion.size).error == pytest.approx(
            np.sqrt(np.mean(np.square(drawn))), rel=0.06
        )


def test_unknown_noise_leaves_the_increase_of_a_maximum_unknown():
    assert np.isnan(noise_lift(np.ones(5), np.nan, 5)).all()
