import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim.kernels import orthonormal_rows, orthonormalise

METRIC = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 100.0]])


@settings(deadline=None)
@given(st.integers(0, 10_000), st.floats(1e-6, 1e6))
def test_rows_become_orthonormal_in_the_metric(seed, size):
    rows = size * np.random.default_rng(seed).standard_normal((3, 3))
    made = orthonormal_rows(rows, METRIC)
    np.testing.assert_allclose(made @ METRIC @ made.T, np.eye(3), atol=1e-12)


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_the_logarithms_add_up_to_that_of_the_volume(seed):
    rows = np.random.default_rng(seed).standard_normal((3, 3))
    logarithms = np.zeros(3)
    orthonormalise(rows.copy(), METRIC, logarithms)
    volume = np.linalg.slogdet(rows)[1] + 0.5 * np.linalg.slogdet(METRIC)[1]
    assert logarithms.sum() == pytest.approx(volume, abs=1e-9)


def test_rows_that_nearly_agree_are_still_made_orthogonal():
    rows = np.array([[1.0, 1e-9, 0.0], [1.0, 0.0, 1e-9], [1.0, 0.0, 0.0]])
    made = orthonormal_rows(rows, np.eye(3))
    np.testing.assert_allclose(made @ made.T, np.eye(3), atol=1e-12)


def test_a_row_that_depends_on_the_others_is_lost_and_replaced():
    rows = np.array([[1.0, 2.0, 3.0], [-2.0, -4.0, -6.0], [0.0, 1.0, 0.0]])
    logarithms = np.zeros(3)
    orthonormalise(rows, METRIC, logarithms)
    assert logarithms[1] == -np.inf
    assert np.all(np.isfinite(logarithms[[0, 2]]))
    np.testing.assert_allclose(rows @ METRIC @ rows.T, np.eye(3), atol=1e-12)
