"""Level control converges, keeps its limits, and ignores random errors."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.acquisition.control.control_action import MeasuredLevel, measured_level
from vibench.acquisition.control.feedback_channels import feedback_channels_of
from vibench.acquisition.control.sine_loop import SineLoop
from vibench.acquisition.excitation.plan import BaseLevel
from vibench.acquisition.plan import HeldDwell, Measurement
from vibench.acquisition.recording import Hold
from vibench.acquisition.rig import channels_of

LEVEL = BaseLevel(acceleration_m_per_s2=10.0)


@given(gain=st.floats(3.0, 300.0), start_vpp=st.floats(0.01, 5.0))
def test_level_control_converges_whenever_the_level_is_reachable(gain, start_vpp):
    setting_vpp = start_vpp
    for _ in range(60):
        correction = MeasuredLevel(gain * setting_vpp, 0.0).correction(LEVEL, 10.0)
        assert max(correction, 1 / correction) <= 1.25 * (1 + 1e-12)
        setting_vpp *= correction
    assert MeasuredLevel(gain * setting_vpp, 0.0).hold_state(10.0, 0.025) is Hold.WITHIN


def test_level_control_stays_between_the_smallest_and_the_largest_planned_voltage(rig):
    plan = HeldDwell(amplitude_vpp=5.0, frequency_hz=110.0, duration_s=1.0, base_level=LEVEL)
    measurement = Measurement(name="held", excitation=plan, ramp_s=0.2)
    loop = SineLoop(feedback_channels_of(channels_of(rig), 5120.0), rig, measurement)
    assert loop.bounded_vpp(4.9 * MeasuredLevel(1.0, 0.0).correction(LEVEL, 10.0)) == 5.0
    assert loop.bounded_vpp(2.1e-3 * MeasuredLevel(100.0, 0.0).correction(LEVEL, 10.0)) == loop.least_vpp


def test_an_insignificant_level_error_does_not_change_the_generator_voltage():
    assert MeasuredLevel(9.5, 0.3).correction(LEVEL, 10.0) == 1.0
    assert MeasuredLevel(9.5, 0.1).correction(LEVEL, 10.0) > 1.0


def test_the_level_uncertainty_matches_the_scatter_of_repetitions_with_correlated_periods():
    random = np.random.default_rng(3)
    means, stated = [], []
    for _ in range(200):
        white = random.standard_normal(480)
        correlated = np.convolve(white, np.ones(12) / 12, mode="valid")[:468]
        found = measured_level((10 + correlated) * np.exp(0.7j))
        means.append(found.amplitude)
        stated.append(found.uncertainty)
    assert np.mean(means) == pytest.approx(10, abs=0.02)
    assert np.sqrt(np.mean(np.square(stated))) == pytest.approx(np.std(means), rel=0.2)


def test_the_uncertainty_of_a_level_from_too_few_periods_equals_the_level():
    few = measured_level(np.full(10, 3.0 + 0j))
    assert few.uncertainty == few.amplitude == 3.0
