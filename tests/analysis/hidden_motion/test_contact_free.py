"""Gaps and loss without a contact model: determined by differing impacts, not by identical ones."""

import numpy as np
import pytest

from vibench.analysis.hidden_motion._contact_free import FreeImpacts, free_gaps, free_loss, measured_gaps

GAP_M, DEPTH_M = 45e-6, 1.4e-6


def impacts(spread, error_m=0.0, loss_s_per_m=0.0, count=400):
    """Return impacts on both sides with scattered depths; the error of p has a cycle of four impacts."""
    rng = np.random.default_rng(3)
    depth = 1.0 + spread * rng.uniform(-1.0, 1.0, count)
    sides = np.where(np.arange(count) % 2, 1.0, -1.0)
    off = error_m * np.cos(0.5 * np.pi * np.arange(count))
    speed = 0.2 * depth**1.25
    return FreeImpacts(
        samples=100.0 * np.arange(count),
        sides=sides,
        impulses=2e-4 * depth**1.25,
        p=sides * (GAP_M + DEPTH_M * depth + off),
        p_sd=np.full(count, 1e-8),
        rate_before=speed,
        rate_after=speed * (1.0 - 2.0 / 3.0 * loss_s_per_m * speed),
    )


def test_impacts_that_differ_from_each_other_determine_the_gaps():
    for gap in free_gaps(impacts(0.5, error_m=1e-7)):
        assert gap.value_m == pytest.approx(GAP_M, abs=2 * gap.sd_m)
        assert gap.sd_m < 0.3e-6


@pytest.mark.parametrize("error_m", [0.0, 1e-7, 4e-7])
def test_impacts_that_are_all_alike_determine_no_gap(error_m):
    """A settled motion once gave a gap of (48.0 +- 1.1) um for 45: one point determines no line."""
    alike = impacts(0.03, error_m)
    assert free_gaps(alike) == (None, None)
    assert np.all(np.isnan(measured_gaps(alike)))


@pytest.mark.parametrize("loss_s_per_m", [0.0, 0.2, 0.8])
def test_the_impact_loss_is_reported_as_a_function_of_impact_speed(loss_s_per_m):
    assert free_loss(impacts(0.5, loss_s_per_m=loss_s_per_m)) == pytest.approx(loss_s_per_m, abs=0.02)


def test_few_impacts_determine_neither_gaps_nor_loss():
    few = impacts(0.5, count=6)
    assert free_gaps(few) == (None, None)
    assert free_loss(few) is None
