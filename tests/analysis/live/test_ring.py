import numpy as np
import pytest

from vibench.analysis import InvalidRequest
from vibench.analysis.live._ring import Ring


def numbers(first, count):
    return np.stack([np.arange(first, first + count), -np.arange(first, first + count)]).astype(np.float32)


@pytest.mark.parametrize("length", [1, 7, 99, 100, 101, 250])
def test_the_newest_samples_of_a_ring_buffer_are_contiguous_for_any_block_size(length):
    ring = Ring(2, 100)
    for first in range(40, 1000, length):
        ring.add(first, numbers(first, length))
        window = ring.newest(100)
        assert window.stop_sample == first + length == ring.next_sample
        expected = numbers(window.first_sample, window.values.shape[1])
        assert np.array_equal(window.values, expected)


def test_a_ring_buffer_returns_only_received_samples():
    ring = Ring(1, 100)
    assert ring.newest(10).values.shape == (1, 0)
    ring.add(5, np.ones((1, 3), dtype=np.float32))
    assert ring.newest(10).values.shape == (1, 3)
    assert ring.newest(10).first_sample == 5


def test_repeated_samples_are_stored_once_in_a_ring_buffer():
    ring = Ring(2, 50)
    ring.add(0, numbers(0, 20))
    ring.add(10, numbers(10, 20))
    ring.add(0, numbers(0, 30))
    assert np.array_equal(ring.newest(50).values, numbers(0, 30))


def test_lost_samples_are_nan_in_a_ring_buffer_and_older_samples_remain():
    ring = Ring(2, 50)
    ring.add(0, numbers(0, 20))
    ring.add(30, numbers(30, 5))
    values = ring.newest(50).values
    assert values.shape == (2, 35)
    assert np.isnan(values[:, 20:30]).all()
    assert np.array_equal(values[:, :20], numbers(0, 20))
    assert np.array_equal(values[:, 30:], numbers(30, 5))


def test_a_ring_buffer_returns_the_samples_after_a_position():
    ring = Ring(2, 50)
    ring.add(0, numbers(0, 45))
    assert np.array_equal(ring.samples_since(40).values, numbers(40, 5))
    assert ring.samples_since(45).values.shape == (2, 0)


def test_a_ring_buffer_without_channels_or_samples_is_refused():
    with pytest.raises(InvalidRequest, match="0 channels"):
        Ring(0, 10)
