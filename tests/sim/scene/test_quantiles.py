"""Closed forms of quantiles agree with scipy.special."""

import pytest
from scipy.special import chdtri, ndtri, stdtrit

from vibench.sim.scene.shares import normal_quantile, poisson_mean, student_quantile


@pytest.mark.parametrize("probability", [0.6, 0.9, 0.975, 0.999])
@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 9, 10, 31, 100, 1001])
def test_student_quantile_matches_scipy(freedom, probability):
    assert student_quantile(freedom, probability) == pytest.approx(stdtrit(freedom, probability), rel=1e-12)


@pytest.mark.parametrize("tail", [1e-12, 1e-3, 0.025, 0.05 / 7, 0.4])
def test_normal_quantile_matches_scipy(tail):
    assert normal_quantile(tail) == pytest.approx(-ndtri(tail), rel=1e-12)


@pytest.mark.parametrize("probability", [0.025, 0.05, 0.975])
@pytest.mark.parametrize("fewer_than", [1, 2, 3, 16, 17, 300, 2000])
def test_poisson_mean_matches_scipy(fewer_than, probability):
    expected = 0.5 * chdtri(2 * fewer_than, probability)
    assert poisson_mean(fewer_than, probability) == pytest.approx(expected, rel=1e-12)
