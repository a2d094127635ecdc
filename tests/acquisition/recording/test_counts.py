import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.acquisition import RecordingError
from vibench.acquisition.recording import ChannelHeader
from vibench.acquisition.recording._writer import CountScale


def scale(step, zero=0.0, range_v=5.0):
    channel = ChannelHeader(
        "m0_velocity", "ai0", "velocity", "m s-1", 1.0, range_v, step, volts_at_zero_count=zero
    )
    return CountScale([channel])


@given(
    step=st.floats(1e-9, 1e-3),
    zero=st.floats(-0.01, 0.01),
    counts=st.lists(st.integers(-(2**23), 2**23 - 1), min_size=1, max_size=50),
)
def test_24_bit_counts_round_trip_through_volts(step, zero, counts):
    volts = np.array([counts]) * step + zero
    np.testing.assert_array_equal(scale(step, zero).counts(volts), [counts])


@given(volts=st.lists(st.floats(-9.99, 9.99), min_size=1, max_size=50))
def test_volts_without_a_known_converter_step_are_stored_to_within_half_a_fine_step(volts):
    counts = scale(None).counts(np.array([volts]))
    fine_step = 5.0 * 2**-30
    assert np.abs(counts * fine_step - volts).max() <= 0.5 * fine_step


def test_volts_that_contradict_the_stated_converter_step_are_detected():
    true_step, claimed_step = 5.0 / 2**23, 5.0 / 2**22
    volts = np.arange(-100.0, 100.0)[None] * true_step
    with pytest.raises(RecordingError, match=r"'m0_velocity' differ by up to 0\.50 counts from"):
        scale(claimed_step).counts(volts)


@pytest.mark.parametrize("volts", [np.nan, np.inf, -np.inf, 1e6])
def test_values_beyond_the_range_of_counts_are_refused(volts):
    with pytest.raises(RecordingError, match="was not recorded"):
        scale(1e-6).counts(np.array([[0.0, volts]]))
