from itertools import pairwise

import numpy as np
import pytest

from vibench.analysis import InvalidRequest
from vibench.analysis.live import column_starts, envelope, zigzag


def test_each_envelope_column_shows_the_extremes_of_its_own_samples():
    samples = np.random.default_rng(3).standard_normal(10_007)
    low, high = envelope(samples, 333)
    edges = [*column_starts(10_007, 333), 10_007]
    for column, (begin, end) in enumerate(pairwise(edges)):
        assert low[column] == samples[begin:end].min()
        assert high[column] == samples[begin:end].max()


def test_lost_samples_leave_only_their_own_envelope_columns_empty():
    samples = np.arange(40.0)
    samples[5] = np.nan
    samples[10:20] = np.nan
    low, high = envelope(samples, 4)
    assert low[0] == 0.0
    assert high[0] == 9.0
    assert np.isnan(low[1])
    assert np.isnan(high[1])
    assert (low[2], high[3]) == (20.0, 39.0)


def test_samples_are_drawn_individually_if_an_envelope_has_more_columns_than_samples():
    samples = np.array([3.0, 1.0, 2.0])
    low, high = envelope(samples, 10)
    assert np.array_equal(low, samples)
    assert np.array_equal(high, samples)
    assert np.array_equal(column_starts(3, 10), [0, 1, 2])


def test_an_envelope_without_columns_is_refused():
    with pytest.raises(InvalidRequest, match="0 columns"):
        envelope(np.zeros(5), 0)


def test_the_upper_and_lower_edge_of_an_envelope_are_drawn_as_one_zigzag_line():
    assert np.array_equal(zigzag(np.array([[0.0, 1.0]]), np.array([[2.0, 3.0]])), [[0, 2, 1, 3]])
