"""Eight and sixteen numbers at once, against the same sums by numpy."""

import numpy as np
import pytest

from vibench.sim.kernels import (
    below,
    choose,
    eight,
    eight_of_eight,
    eight_of_sixteen,
    eights,
    fma,
    kernel,
    largest,
    magnitude,
    polynomials,
    root,
    sixteen,
    sixteen_of_sixteen,
    store,
    total,
)

RANDOM = np.random.default_rng(7)


@kernel
def reckoned(table, weights, out):
    """A bit of everything: 1 + 2 w + w sqrt(w) - rows 0 and 1, and what is drawn from it."""
    w = sixteen_of_sixteen(table, 0, weights)
    value = 1.0 + 2.0 * w + w * root(w)
    value -= sixteen(table, 0) + sixteen(table, 1)
    store(out, 1, value)
    return total(value), largest(value)


@kernel
def sums_of_eight(table, weights, out):
    store(out, 0, eight_of_eight(table, 0, weights))
    store(out, 1, eight_of_sixteen(table, 0, weights))
    store(out, 2, eight_of_eight(table, 4, eight(weights, 1)) * eights(0.5))


def test_sixteen_numbers_are_reckoned_with_as_numpy_does():
    table, weights, out = RANDOM.normal(size=(16, 16)), RANDOM.normal(size=16), np.zeros((2, 16))
    of_all, most = reckoned(table, weights, out)
    w = weights @ table
    expected = 1.0 + 2.0 * w + w * np.sqrt(np.maximum(w, 0.0)) - table[0] - table[1]
    np.testing.assert_allclose(out[1], expected, rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(out[0], 0.0)
    assert of_all == pytest.approx(expected.sum(), rel=1e-13)
    assert most == np.abs(out[1]).max()


def test_sums_of_eight_take_the_rows_and_weights_that_they_say():
    table, weights, out = RANDOM.normal(size=(16, 8)), RANDOM.normal(size=16), np.zeros((3, 8))
    sums_of_eight(table, weights, out)
    np.testing.assert_allclose(out[0], weights[:8] @ table[:8], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(out[1], weights @ table, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(out[2], 0.5 * weights[8:] @ table[4:12], rtol=1e-12, atol=1e-14)


def test_what_is_not_a_number_shows_in_a_sum_and_in_the_largest():
    table = np.zeros((16, 16))
    table[5, 3] = np.nan
    assert np.isnan(reckoned(table, np.ones(16), np.zeros((2, 16)))).all()


evaluate = polynomials(((0, 0), (0, 1), (1, 1), (1, 0)), (5, 3))
"""Of 1, x, y, x y, x x: the first has all of them, the second three."""


@kernel
def by_masks(rows, out):
    one, other = eight(rows, 0), eight(rows, 1)
    store(out, 0, choose(below(one, other), -one, 2.0 * other) / magnitude(other))
    store(out, 1, fma(one, other, 0.5))
    return below(one, 0.0), below(1.0 - one, other)


@kernel
def evaluated(rows, coefficients, out):
    evaluate(rows, coefficients, out)


def test_lanes_go_their_own_ways_by_masks():
    rows, out = RANDOM.normal(size=(2, 8)), np.zeros((2, 8))
    rows[0, 3] = np.nan
    negative, larger = by_masks(rows, out)
    one, other = rows
    bits = 1 << np.arange(8)
    assert negative == bits[one < 0.0].sum()
    assert larger == bits[1.0 - one < other].sum()
    expected = np.where(one < other, -one, 2.0 * other) / np.abs(other)
    np.testing.assert_allclose(out[0], expected, rtol=1e-15)
    np.testing.assert_allclose(out[1], one * other + 0.5, rtol=1e-15, atol=1e-16)


def test_polynomials_of_eight_points_are_those_of_numpy():
    rows, coefficients, out = RANDOM.normal(size=(2, 8)), RANDOM.normal(size=8), np.zeros((2, 8))
    evaluated(rows, coefficients, out)
    x, y = rows
    monomials = np.array([np.ones(8), x, y, x * y, x * x])
    np.testing.assert_allclose(out[0], coefficients[:5] @ monomials, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(out[1], coefficients[5:] @ monomials[:3], rtol=1e-13, atol=1e-14)
