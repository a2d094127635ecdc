import numpy as np
import pytest

from vibench.sim.exponents.tangent_run import block_mean


def autoregression(memory, count, seed):
    """Return an autoregressive series of order 1 with steps of unit variance."""
    steps = np.random.default_rng(seed).standard_normal(count + 200)
    values = np.zeros_like(steps)
    for k in range(1, len(steps)):
        values[k] = memory * values[k - 1] + steps[k]
    return values[200:]


@pytest.mark.parametrize("memory", [-0.5, 0.0, 0.6, 0.95])
def test_the_error_of_a_correlated_mean_matches_the_closed_form(memory):
    count = 1 << 14
    found = [block_mean(autoregression(memory, count, seed)) for seed in range(12)]
    exact = 1.0 / (1.0 - memory) / np.sqrt(count)
    assert np.mean([each.standard_error for each in found]) == pytest.approx(exact, rel=0.2)
    assert all(each.is_long_enough for each in found)
    correlated = (1.0 + memory) / (1.0 - memory)
    assert np.mean([each.correlation_length for each in found]) == pytest.approx(correlated, rel=0.35)


def test_the_means_of_blocks_scatter_as_their_stated_errors_predict():
    means = [block_mean(autoregression(0.8, 4096, seed)) for seed in range(150)]
    scores = [each.mean / each.standard_error for each in means]
    assert 0.8 < np.std(scores) < 1.3
    assert np.mean(np.abs(scores) > 2.0) < 0.12


def test_a_series_shorter_than_its_correlation_time_is_marked_as_too_short():
    assert not block_mean(autoregression(0.999, 512, 1)).is_long_enough
    assert not block_mean(np.arange(64.0)).is_long_enough


def test_the_mean_has_zero_error_for_equal_values_and_an_unknown_error_for_one_value():
    assert block_mean([2.5] * 40).standard_error == 0.0
    assert np.isnan(block_mean([2.5]).standard_error)


@pytest.mark.parametrize("values", [[], [1.0, np.nan], [[1.0, 2.0]]])
def test_values_without_a_finite_mean_are_refused(values):
    with pytest.raises(ValueError, match="is not allowed"):
        block_mean(values)
