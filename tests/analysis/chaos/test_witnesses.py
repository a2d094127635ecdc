"""Single tests for chaos on maps and flows of known exponent, and on noise."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibench.analysis import InvalidRequest, NotEnoughData
from vibench.analysis.chaos.witnesses import (
    delay_vectors,
    divergence,
    nearest_neighbours,
    surrogate_test,
    surrogates,
    zero_one,
)


def logistic(growth, count):
    series, x = np.empty(count + 500), 0.3
    for step in range(count + 500):
        x = growth * x * (1 - x)
        series[step] = x
    return series[500:]


def henon(count):
    series, x, y = np.empty(count + 500), 0.1, 0.1
    for step in range(count + 500):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        series[step] = x
    return series[500:]


@pytest.fixture(scope="module")
def lorenz():
    def rates(_, at):
        x, y, z = at
        return [10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z]

    time_s = 50 + 0.01 * np.arange(40_000)
    return solve_ivp(rates, (0, time_s[-1]), [1, 1, 1], "DOP853", time_s, rtol=1e-8, atol=1e-8).y[0]


def autoregression(rng, count):
    series = np.zeros(count + 500)
    for step in range(2, count + 500):
        series[step] = 1.6 * series[step - 1] - 0.9 * series[step - 2] + rng.standard_normal()
    return series[500:]


@pytest.mark.parametrize(("growth", "k"), [(4.0, 1.0), (3.55, 0.0)])
def test_the_zero_one_test_distinguishes_chaos_from_a_motion_of_period_eight(growth, k):
    assert zero_one(logistic(growth, 2000)).k == pytest.approx(k, abs=0.01)


@pytest.mark.thorough
@pytest.mark.parametrize(("stride", "is_oversampled"), [(5, True), (20, False)])
def test_the_zero_one_test_detects_an_oversampled_flow(lorenz, stride, is_oversampled):
    found = zero_one(lorenz[::stride][:2000])
    assert found.is_oversampled is is_oversampled
    assert (found.k > 0.9) is not is_oversampled


@pytest.mark.parametrize(
    ("series", "delays", "exponent"),
    [(logistic(4.0, 3000), 1, np.log(2)), (henon(5000), 2, 0.41922)],
    ids=["logistic", "henon"],
)
def test_neighbouring_points_of_a_map_diverge_at_the_rate_of_the_exponent(series, delays, exponent):
    found = divergence(delay_vectors(series, delays), steps=25)
    assert found.is_resolved
    assert found.exponent == pytest.approx(exponent, rel=0.03)
    assert abs(found.exponent - exponent) < 3 * found.sd_exponent


@pytest.mark.thorough
def test_neighbouring_points_of_a_flow_diverge_at_the_rate_of_the_exponent(lorenz):
    points = np.column_stack([lorenz[lag : len(lorenz) - 22 + lag] for lag in (0, 11, 22)])
    found = divergence(points, steps=400, apart=100)
    # The exponent over 400 s differs from the limit value by some per cent.
    assert found.exponent / 0.01 == pytest.approx(0.9056, rel=0.08)


def test_noise_as_large_as_the_attractor_gives_no_exponent():
    noise = np.random.default_rng(0).standard_normal((2000, 3))
    assert not divergence(noise, steps=8).is_resolved
    clean, noisy = henon(3000), henon(3000) + 0.2 * np.random.default_rng(1).standard_normal(3000)
    assert divergence(delay_vectors(clean, 2), steps=20).is_resolved
    assert not divergence(delay_vectors(noisy, 2), steps=20, noise=0.2).is_resolved


@pytest.mark.thorough
def test_the_surrogate_test_separates_a_noisy_henon_map_from_linear_noise():
    rng = np.random.default_rng(2)
    series = henon(2000)
    noisy = series + 0.1 * series.std() * rng.standard_normal(2000)
    assert surrogate_test(noisy).rejects_linear_noise
    assert not surrogate_test(autoregression(rng, 2000)).rejects_linear_noise


@pytest.mark.thorough
def test_the_surrogate_test_rejects_linear_noise_at_its_stated_rate():
    rejected = sum(
        surrogate_test(autoregression(np.random.default_rng(seed), 400), seed=seed).rejects_linear_noise
        for seed in range(60)
    )
    # Each false rejection has probability 1/40: more than 5 in 60 have probability 0.2 %.
    assert rejected <= 5


@pytest.mark.thorough
def test_a_series_whose_surrogates_have_wrong_spectra_is_undecided():
    found = surrogate_test(autoregression(np.random.default_rng(3), 2000) ** 3)
    assert not found.is_valid
    assert not found.rejects_linear_noise


def test_a_surrogate_keeps_the_values_and_the_spectrum_but_not_the_order_of_the_values():
    series = henon(1000)
    made, errors = surrogates(series, np.random.default_rng(4), 2)
    assert not np.array_equal(*made)
    assert np.array_equal(np.sort(made), [np.sort(series)] * 2)
    assert errors.max() < 0.01
    assert np.abs(np.corrcoef([series, *made])[0, 1:]).max() < 0.2


def test_points_close_in_time_are_not_accepted_as_neighbours():
    rng = np.random.default_rng(5)
    points = rng.standard_normal((300, 2))
    found = nearest_neighbours(points, apart=10, last=280, floor=0.05)
    for point, neighbour in zip(*found, strict=True):
        reach = np.linalg.norm(points[:280] - points[point], axis=1)
        allowed = (np.abs(np.arange(280) - point) >= 10) & (reach > 0.05)
        assert reach[neighbour] == pytest.approx(reach[allowed].min())


def test_a_series_that_is_too_short_is_refused():
    with pytest.raises(NotEnoughData, match="200 values"):
        zero_one(np.ones(100))
    with pytest.raises(NotEnoughData, match="neighbour"):
        divergence(np.ones((30, 2)), steps=20)
    with pytest.raises(InvalidRequest, match="delays"):
        delay_vectors(np.ones(10), 0)
