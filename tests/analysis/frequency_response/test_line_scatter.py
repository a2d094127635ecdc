"""The line scatter used as fit weight follows a model of three noises, not the few averages of one line."""

import numpy as np
import pytest

from vibench.analysis.frequency_response.transmissibility import steady_relative_sd

FREQUENCY_HZ = np.arange(50.0, 600.0, 2.0)
RATIO = FREQUENCY_HZ / 94.6
RESPONSE = 1 / (1 - RATIO**2 + 0.012j * RATIO) + 1 / (1 - (FREQUENCY_HZ / 266) ** 2 + 0.03j)
POWER = 1 - 0.7 / (1 + ((FREQUENCY_HZ - 95) / 3) ** 2)
SHAPES = np.array([np.ones(RESPONSE.size), np.abs(RESPONSE) ** 2, np.abs(np.gradient(RESPONSE)) ** 2])


def estimated_sd(rng, sizes, freedom):
    """Return the true relative standard deviation and its estimate from few degrees of freedom."""
    true = np.sqrt(sizes @ SHAPES / (np.abs(RESPONSE) ** 2 * POWER))
    return true, true * np.sqrt(rng.chisquare(freedom, true.size) / freedom)


@pytest.mark.parametrize("sizes", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.3, 0.2, 0.2), (0.0, 0.0, 1.0)])
@pytest.mark.parametrize("freedom", [2, 8])
def test_the_estimated_scatter_of_each_line_matches_its_noise(sizes, freedom):
    rng, ratios = np.random.default_rng(3), []
    for _ in range(40):
        true, own = estimated_sd(rng, 1e-6 * np.array(sizes), freedom)
        ratios.append(steady_relative_sd(own, RESPONSE, POWER, freedom) / true)
    typical = np.sqrt(np.mean(np.square(ratios), axis=0))
    near_the_mode = np.abs(FREQUENCY_HZ - 94.6) < 8
    assert np.all(typical[near_the_mode] > 0.8)
    assert np.median(typical) == pytest.approx(1.0, abs=0.06)
    # With 2 degrees of freedom the estimates of single lines scatter by more than 50 %.
    assert np.median(np.std(ratios, axis=0)) < 0.25


def test_spectral_lines_without_a_value_do_not_affect_other_lines():
    true, own = estimated_sd(np.random.default_rng(4), np.array([1e-6, 0.0, 0.0]), 4)
    value = RESPONSE.copy()
    value[40], own[90] = np.nan, np.inf
    found = steady_relative_sd(own, value, POWER, 4)
    assert np.flatnonzero(np.isnan(found)).tolist() == [40, 90]
    assert np.nanmax(found / true) < 2.0


def test_the_estimated_scatter_is_zero_without_noise_and_unchanged_with_many_averages():
    none = np.zeros(RESPONSE.size)
    np.testing.assert_array_equal(steady_relative_sd(none, RESPONSE, POWER, 2), none)
    own = np.random.default_rng(5).random(RESPONSE.size)
    assert steady_relative_sd(own, RESPONSE, POWER, 24) is own


@pytest.mark.parametrize("freedom", [1e-3, 0.06, 1.9])
@pytest.mark.parametrize("lines", [2, 5, RESPONSE.size])
def test_less_than_one_effective_average_gives_a_finite_scatter(freedom, lines):
    _, own = estimated_sd(np.random.default_rng(6), np.array([1e-6, 0.0, 0.0]), 2)
    found = steady_relative_sd(own[:lines], RESPONSE[:lines], POWER[:lines], freedom)
    assert np.all(np.isfinite(found) & (found > 0))
