"""Waveform codes: the generator plays the requested waveform to within one step."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from vibench.acquisition import LimitExceeded
from vibench.acquisition.drivers import AFG1022_MODEL

waveforms = arrays(np.float64, st.integers(2, 300), elements=st.floats(-1, 1, allow_subnormal=False)).filter(
    lambda values: np.ptp(values) > 1e-6
)


def waveform_of(made):
    """Return the waveform of the codes, on the scale of the given values."""
    return made.panel_factor * (2 * made.codes / AFG1022_MODEL.top_code - 1.0)


def half_a_step(made):
    return made.panel_factor / AFG1022_MODEL.top_code


@given(waveforms)
def test_codes_reproduce_the_zero_mean_waveform_within_half_a_step(values):
    made = AFG1022_MODEL.codes(values)
    assert np.max(np.abs(waveform_of(made) - (values - values.mean()))) <= half_a_step(made) * (1 + 1e-9)


@given(waveforms)
def test_the_value_of_largest_magnitude_is_mapped_to_the_outermost_code(values):
    codes = AFG1022_MODEL.codes(values).codes
    assert codes.min() == 0 or codes.max() == AFG1022_MODEL.top_code
    assert codes.max() <= AFG1022_MODEL.top_code


@given(waveforms)
def test_the_remaining_dc_offset_is_below_half_a_step(values):
    made = AFG1022_MODEL.codes(values)
    assert abs(waveform_of(made).mean()) <= half_a_step(made) * (1 + 1e-9)


def test_a_full_range_sine_keeps_its_amplitude_on_the_panel():
    made = AFG1022_MODEL.codes(np.sin(2 * np.pi * np.arange(4096) / 4096))
    assert made.panel_factor == pytest.approx(1.0, abs=1e-12)
    assert (made.codes.min(), made.codes.max()) == (0, AFG1022_MODEL.top_code)
    assert abs(waveform_of(made).mean()) < 1e-7


def test_an_asymmetric_waveform_needs_a_larger_panel_amplitude():
    values = np.array([1.0, -0.2, -0.2, -0.2, -0.2])
    made = AFG1022_MODEL.codes(values)
    assert made.panel_factor == pytest.approx(0.96)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        (np.zeros(1), "2 to 8192"),
        (np.sin(np.arange(8193.0)), "2 to 8192"),
        (np.zeros((2, 8)), "one period"),
        (np.array([0.0, np.nan]), "from -1 to 1"),
        (np.array([0.0, np.inf]), "from -1 to 1"),
        (np.array([0.0, 1.01]), "1.01"),
        (np.full(8, 0.3), "constant"),
    ],
)
def test_an_impossible_waveform_is_refused_before_sending(values, complaint):
    with pytest.raises(LimitExceeded, match=complaint):
        AFG1022_MODEL.codes(values)
