"""Sixteen numbers of a sum of turning terms at once, against the sum itself."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim.kernels import (
    STEPS_AHEAD,
    fill_series,
    kernel,
    march,
    propagate_by,
    series_rows,
    steps_ahead,
    sum_now,
)

RATES = np.array([-3.0 + 600.0j, -20.0 + 1700.0j, -60.0 + 3100.0j, 1630.0j])
GRID_S = 0.25 / 3101.0
TERMS = np.array([2.0 - 1.0j, 0.5 + 0.3j, -0.2 + 0.1j, 1.0 + 1.5j])
NOW, SERIES = steps_ahead(RATES, GRID_S), series_rows(RATES)


@kernel
def marched(terms, steps, low, high):
    return march(terms, NOW, steps, low, high)


@kernel
def looked_ahead(terms, series):
    fill_series(series, terms, SERIES)
    propagate_by(terms, NOW, 5)
    return sum_now(terms)


def exact(time_s):
    return (TERMS * np.exp(np.multiply.outer(time_s, RATES))).sum(axis=-1).real


def test_a_series_is_that_of_the_sum_and_turning_goes_where_it_says():
    terms, series = TERMS.copy(), np.zeros(STEPS_AHEAD)
    assert looked_ahead(terms, series) == pytest.approx(exact(5 * GRID_S), rel=1e-13)
    time_s = np.linspace(0.0, GRID_S, 9)
    np.testing.assert_allclose(np.polynomial.Polynomial(series)(time_s), exact(time_s), rtol=1e-14)


@settings(deadline=None)
@given(steps=st.integers(0, 200), low=st.floats(-5.0, 1.0), high=st.floats(2.0, 5.0))
def test_a_march_ends_at_the_last_step_that_is_inside(steps, low, high):
    terms = TERMS.copy()
    made = marched(terms, steps, low, high)
    course = exact(GRID_S * np.arange(1, steps + 1))
    inside = (low < course) & (course < high)
    # A sum that comes as close as its rounding to an end may be taken for either.
    doubtful = np.minimum(np.abs(course - low), np.abs(course - high)) < 1e-11
    assert np.all(inside[:made] | doubtful[:made])
    assert made == steps or not inside[made] or doubtful[made]
    assert terms.sum().real == pytest.approx(exact(GRID_S * made), abs=1e-11)
