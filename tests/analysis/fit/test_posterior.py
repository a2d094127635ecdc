"""Parameters estimated from statistics of runs, for a model whose posterior is known in closed form."""

import numpy as np
import pytest

from vibench.analysis.fit.statistical_numbers import _FAR, _distance, posterior

ROUNDS = (60, 60, 120)
BOX = np.array([[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]])
SCATTER = 0.1
CASES = 60


class Linear:
    """Noisy statistics that depend linearly on the first two parameters and not on the third."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.gain = np.random.default_rng(1).normal(size=(3, 20))
        self.gain[2] = 0.0

    def __call__(self, parameters):
        scatter = SCATTER * self.rng.standard_normal((len(parameters), self.gain.shape[1]))
        return parameters @ self.gain + scatter


@pytest.fixture(scope="module")
def cases():
    """Return pairs of true parameters and the posterior found from their statistics."""
    found = []
    for seed in range(CASES):
        runs, true = Linear(seed), np.random.default_rng(1000 + seed).uniform(-0.9, 0.9, 3)
        found.append((true, posterior(runs, runs(true[None])[0], BOX, seed, ROUNDS)))
    return found


@pytest.mark.thorough
def test_the_95_percent_bounds_of_the_posterior_have_the_stated_coverage_and_a_useful_width(cases):
    bounds = np.array([np.quantile(each.draws, [0.025, 0.975], axis=0) for _, each in cases])
    held = np.array([(low <= true) & (true <= high) for (true, _), (low, high) in zip(cases, bounds)])  # noqa: B905
    count = held[:, :2].size
    assert held[:, :2].sum() > 0.95 * count - 3 * np.sqrt(0.95 * 0.05 * count)
    width = np.median(bounds[:, 1] - bounds[:, 0], axis=0)
    gain = Linear(0).gain[:2]
    best = 2 * 1.96 * SCATTER * np.sqrt(np.diag(np.linalg.inv(gain @ gain.T)))
    assert np.all(width[:2] < 1.4 * best)


@pytest.mark.thorough
def test_uninformative_statistics_give_bounds_as_wide_as_the_bounds_of_the_prior(cases):
    wide = [np.ptp(np.quantile(each.draws[:, 2], [0.025, 0.975])) for _, each in cases]
    assert np.median(wide) > 0.85 * 2.0


def test_no_fit_is_reported_for_statistics_that_no_parameters_can_produce(cases):
    assert sum(not each.fits for _, each in cases) <= 3
    runs = Linear(5)
    off = np.linalg.svd(runs.gain[:2])[2][-1]  # a direction that no parameter produces
    strange = runs(np.array([[0.3, -0.2, 0.0]]))[0] + 12 * SCATTER * off
    assert not posterior(runs, strange, BOX, 5, ROUNDS).fits


def test_the_true_model_is_rarely_rejected_even_with_few_reference_runs():
    """With the distances of the 80 regression runs as reference, two in five true runs were once rejected."""
    refused, runs, statistics = 0, 80, 60
    for seed in range(12):
        rng = np.random.default_rng(seed)
        parameters = rng.uniform(-1.0, 1.0, (runs + 1, 6))
        scatter = 0.5 * rng.normal(size=(runs + 1, statistics)) @ rng.normal(size=(statistics, statistics))
        seen = parameters @ rng.normal(size=(6, statistics)) + scatter
        refused += _distance(parameters, seen[:-1], seen[-1]) > _FAR
    assert refused <= 1


def test_the_same_ranges_of_parameters_are_not_sampled_again():
    """Noise without parameters leaves the parameter box unchanged, so two sets of 60 runs suffice."""
    rng, made = np.random.default_rng(7), []

    def runs(parameters):
        made.append(len(parameters))
        return np.array([rng.standard_normal(20) for _ in parameters])

    found = posterior(runs, rng.standard_normal(20), BOX, 7, ROUNDS)
    assert made == [60, 60]
    assert found.fits
    bounds = np.quantile(found.draws, [0.025, 0.975], axis=0)
    assert np.all(np.diff(bounds, axis=0) > 0.8 * 2.0 * 0.95)


def test_no_fit_is_reported_for_statistics_of_parameters_outside_their_range():
    """The bounds of c1 had zero width, at the end of the range."""
    for seed in range(8):
        runs = Linear(seed)
        assert not posterior(runs, runs(np.array([[1.2, -0.2, 0.0]]))[0], BOX, seed, ROUNDS).fits
