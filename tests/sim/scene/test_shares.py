"""Intervals of shares and escape rates have their stated coverage and agree with known formulas."""

import numpy as np
import pytest
from scipy.special import chdtri, ndtri, stdtrit
from scipy.stats import binomtest

from vibench.sim.scene.shares import (
    Count,
    escape_rate,
    normal_quantile,
    poisson_mean,
    shares_of,
    student_quantile,
    wilson_share,
)


@pytest.mark.parametrize(("count", "trials"), [(0, 16), (1, 16), (5, 16), (16, 16), (37, 64)])
def test_the_interval_of_a_share_is_the_wilson_interval(count, trials):
    found = wilson_share(count, trials)
    known = binomtest(count, trials).proportion_ci(0.95, method="wilson")
    assert found.share == count / trials
    assert (found.low, found.high) == pytest.approx((known.low, known.high), abs=1e-12)


@pytest.mark.parametrize("shares", [(0.3, 0.7), (0.5, 0.3, 0.2), (0.4, 0.3, 0.2, 0.1)])
def test_joint_share_intervals_cover_the_true_shares_in_95_percent_of_cases(shares):
    random = np.random.default_rng(11)
    drawn = random.multinomial(32, shares, 4000)
    held = 0
    for counts in drawn:
        found = shares_of([Count(int(each), is_final=True) for each in counts])
        held += all(one.low <= truth <= one.high for one, truth in zip(found, shares, strict=True))
    assert held / len(drawn) > 0.93


def test_share_intervals_allow_for_unfinished_runs_that_reach_any_motion():
    settled, pending = shares_of([Count(6, is_final=True), Count(10, is_final=False)])
    alone = wilson_share(6, 16)
    assert (settled.share, settled.low, settled.high) == (alone.share, alone.low, 1.0)
    assert (pending.share, pending.low, pending.high) == (10 / 16, 0.0, wilson_share(10, 16).high)


def test_escape_rate_intervals_hold_for_censored_lifetimes():
    """Lifetimes are exponential with a mean of 20 s, each observed for at most 15 s."""
    random, held = np.random.default_rng(12), 0
    for _ in range(2000):
        lives = random.exponential(20.0, 16)
        found = escape_rate(int(np.count_nonzero(lives < 15.0)), float(np.minimum(lives, 15.0).sum()))
        held += found.low_per_s <= 1.0 / 20.0 <= found.high_per_s
    assert 0.93 < held / 2000 < 0.99


def test_chaos_without_escape_has_only_a_lower_bound_of_its_lifetime():
    found = escape_rate(0, 300.0)
    assert found.lifetime_above_s == pytest.approx(300.0 / np.log(20.0))
    assert (found.rate_per_s, found.low_per_s) == (0.0, 0.0)


def test_share_intervals_allow_for_unfinished_runs_that_change_their_motion():
    one, other = shares_of([Count(4, is_final=False), Count(4, is_final=False)])
    assert (one.low, one.high) == (other.low, other.high) == (0.0, 1.0)
    settled, *open_ones = shares_of([Count(8, is_final=True), *2 * [Count(4, is_final=False)]])
    assert settled.high == 1.0
    assert [each.high for each in open_ones] == 2 * [wilson_share(8, 16, 0.05 / 3).high]


@pytest.mark.parametrize("probability", [0.6, 0.9, 0.975, 0.999])
@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 9, 10, 31, 100, 1001])
def test_the_student_quantile_matches_scipy(freedom, probability):
    assert student_quantile(freedom, probability) == pytest.approx(stdtrit(freedom, probability), rel=1e-12)


@pytest.mark.parametrize("tail", [1e-12, 1e-3, 0.025, 0.05 / 7, 0.4])
def test_the_normal_quantile_matches_scipy(tail):
    assert normal_quantile(tail) == pytest.approx(-ndtri(tail), rel=1e-12)


@pytest.mark.parametrize("probability", [0.025, 0.05, 0.975])
@pytest.mark.parametrize("fewer_than", [1, 2, 3, 16, 17, 300, 2000])
def test_the_poisson_mean_matches_scipy(fewer_than, probability):
    expected = 0.5 * chdtri(2 * fewer_than, probability)
    assert poisson_mean(fewer_than, probability) == pytest.approx(expected, rel=1e-12)
