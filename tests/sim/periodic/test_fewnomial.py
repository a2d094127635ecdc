import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.sim.periodic.first_order_balance import positive_zeros


@given(st.lists(st.floats(0.01, 100.0), min_size=1, max_size=4))
def test_every_zero_of_a_polynomial_with_known_zeros_is_found(zeros):
    zeros = sorted(zeros)
    if np.any(np.diff(np.log(zeros)) < 0.05):
        return
    found = positive_zeros(np.poly(zeros)[::-1], np.arange(len(zeros) + 1.0))
    np.testing.assert_allclose(found, zeros, rtol=1e-7)


def test_a_polynomial_exponent_of_two_hundred_neither_overflows_nor_hides_a_zero():
    # Zeros of u^201 - 1e200 u + 1e-100: the last two terms balance at 1e-300, the first two at 10.
    found = positive_zeros(np.array([1.0, -1e200, 1e-100]), np.array([201.0, 1.0, 0.0]))
    np.testing.assert_allclose(np.log10(found), [-300.0, 1.0], rtol=1e-12)


@given(st.floats(-3.0, 3.0), st.floats(0.3, 5.0))
def test_the_zeros_of_a_polynomial_scale_with_the_variable(shift, exponent):
    coefficients, exponents = np.array([2.0, -7.0, 3.0, -0.1]), np.array([0.0, 1.0, 2.5, 4.0])
    plain = positive_zeros(coefficients, exponents)
    scale = 10.0**shift
    np.testing.assert_allclose(positive_zeros(coefficients * scale**-exponents, exponents), plain * scale)
    np.testing.assert_allclose(positive_zeros(coefficients, exponents * exponent), plain ** (1.0 / exponent))


def test_a_double_zero_of_a_polynomial_is_found_once():
    np.testing.assert_allclose(positive_zeros(np.array([1.0, -2.0, 1.0]), np.array([0.0, 1.0, 2.0])), [1.0])


@pytest.mark.parametrize(
    "coefficients", [[1.0, 2.0, 3.0], [-1.0, -2.0, -3.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
)
def test_a_polynomial_without_a_change_of_sign_has_no_zero(coefficients):
    assert len(positive_zeros(np.array(coefficients), np.array([0.0, 1.0, 2.0]))) == 0
