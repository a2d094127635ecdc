"""What noise adds to a maximum, against its scatter in repeated draws."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from vibench.analysis.tones import noise_bias


def test_noise_alone_reaches_four_and_a_half_standard_deviations_in_a_second():
    exact, _ = quad(lambda z: 1 - erf(z / np.sqrt(2)) ** 51_200, 0, 8, limit=200)
    assert noise_bias(np.zeros(51_200), 1.0, 51_200) == pytest.approx(exact, abs=2e-3)
    assert exact == pytest.approx(4.4, abs=0.05)


@pytest.mark.parametrize("noise_sd", [0.02, 0.2])
def test_a_sine_is_lifted_as_repeated_draws_are(noise_sd):
    rng = np.random.default_rng(1)
    motion = np.cos(2 * np.pi * 0.037 * np.arange(2000))
    drawn = [np.max(np.abs(motion + noise_sd * rng.standard_normal(2000))) - 1 for _ in range(400)]
    assert noise_bias(motion, noise_sd, 2000) == pytest.approx(
        np.mean(drawn), abs=4 * np.std(drawn) / 20 + 0.02 * noise_sd
    )


def test_no_noise_no_bias_and_the_unit_does_not_matter():
    motion = np.random.default_rng(2).standard_normal(500)
    assert noise_bias(motion, 0.0, 500) == 0
    assert noise_bias(1e-6 * motion, 1e-7, 500) == pytest.approx(
        1e-6 * noise_bias(motion, 0.1, 500), rel=1e-3
    )


def test_fewer_independent_values_lift_a_maximum_less():
    assert noise_bias(np.zeros(5000), 1.0, 50) < noise_bias(np.zeros(5000), 1.0, 5000)
