"""Eight and sixteen numbers at once, against the same sums by numpy."""

import numpy as np
import pytest

from vibench.sim.kernels.compile import kernel
from vibench.sim.kernels.simd import (
    eight,
    eight_of_eight,
    eight_of_sixteen,
    eights,
    largest,
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
