"""Peaks of curves are at the closed-form frequencies, and ripples are not peaks."""

import numpy as np
import pytest

from vibench.cli.paper.responses import bound_peaks, linear_peaks, nearest, response_peaks, two_highest
from vibench.sim import gong2025

GRID = np.arange(5.0, 605.0, 5.0)


def resonances(*middles_hz, heights=None):
    chosen = np.ones(len(middles_hz)) if heights is None else heights
    return sum(h / (1 + ((GRID - f) / 10.0) ** 2) for f, h in zip(middles_hz, chosen, strict=True))


def test_peaks_with_little_damping_are_at_the_natural_frequencies():
    specimen = gong2025(damping_time_s=1e-7)
    np.testing.assert_allclose(linear_peaks(specimen, 5.0, 605.0), specimen.natural_frequencies_hz, atol=0.02)
    np.testing.assert_allclose(bound_peaks(specimen, 5.0, 605.0), specimen.bound_frequencies_hz, atol=0.02)


def test_small_ripples_do_not_count_as_peaks_and_missing_points_are_skipped():
    rough = resonances(200.0, 435.0) * (1.0 + 0.1 * np.sin(GRID))
    np.testing.assert_allclose(response_peaks(GRID, rough), [200.0, 435.0], atol=5.0)
    rough[3] = np.nan
    np.testing.assert_allclose(response_peaks(GRID, rough), [200.0, 435.0], atol=5.0)


def test_the_two_highest_peaks_are_sorted_and_the_height_of_the_third_is_relative():
    first, second, following = two_highest(GRID, resonances(100.0, 300.0, 500.0, heights=(2.0, 9.0, 8.0)))
    assert (first, second) == (300.0, 500.0)
    assert following == pytest.approx(2.0 / 8.0, rel=0.05)
    assert two_highest(GRID, resonances(100.0, 300.0))[2] == 0.0


def test_a_curve_without_peaks_gives_nan():
    assert np.isnan(nearest(np.array([]), (95.0, 266.0))).all()
    assert np.isnan(two_highest(GRID, 1.0 / GRID)).all()
