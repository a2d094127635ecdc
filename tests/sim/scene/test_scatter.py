import numpy as np
import pytest

from vibench.sim.scene.scatter import bootstrap_of_largest, window_scatter


def test_the_closed_form_bootstrap_of_a_maximum_matches_random_draws():
    random = np.random.default_rng(3)
    peaks, blocks = random.gumbel(5.0, 0.3, 40), 5
    drawn = random.choice(peaks, (200_000, blocks)).max(axis=1)
    mean, deviation = bootstrap_of_largest(np.sort(peaks), blocks)
    assert mean == pytest.approx(drawn.mean(), rel=0.001)
    assert deviation == pytest.approx(drawn.std(), rel=0.01)


def test_the_scatter_of_a_gumbel_maximum_is_found():
    """The maximum of n Gumbel values has a Gumbel distribution shifted by ln n widths."""
    random = np.random.default_rng(4)
    width, blocks, many = 0.2, 5, 4000
    truth = width * np.pi / np.sqrt(6.0) / (5.0 + width * (np.log(blocks) + np.euler_gamma))
    found = window_scatter(random.gumbel(5.0, width, many), blocks)
    assert found.relative == pytest.approx(truth, rel=0.05)


def test_no_scatter_is_estimated_from_too_few_blocks():
    assert window_scatter(np.random.default_rng(5).uniform(1.0, 2.0, 3), 3) is None


@pytest.mark.parametrize("blocks", [1, 5, 10])
def test_two_windows_differ_by_at_most_the_stated_error_in_95_percent_of_cases(blocks):
    """Coverage is 95 % for one block per window; with more blocks the stated error is conservative."""
    random = np.random.default_rng(6)
    inside = 0
    for _ in range(2000):
        peaks = random.normal(5.0, 0.2, 20)
        one, another = peaks[-blocks:].max(), random.normal(5.0, 0.2, blocks).max()
        inside += abs(another / one - 1.0) < window_scatter(peaks, blocks).between_runs
    assert 0.93 < inside / 2000 < (0.965 if blocks == 1 else 1.0)
