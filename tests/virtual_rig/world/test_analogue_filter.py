"""The discrete filter of a sensor matches its analogue response."""

import numpy as np
import pytest

from vibench.virtual_rig.world.sensors import low_pass_gain, low_pass_poles, running_filter

STEP_S = 1 / 102_400


def response(running, frequency_hz):
    """Return the complex gain of the running filter."""
    z = np.exp(-2j * np.pi * frequency_hz * STEP_S)
    return np.polyval(running.numerator[::-1], z) / np.polyval(running.denominator[::-1], z)


@pytest.mark.parametrize(
    "analogue",
    [low_pass_poles(50e3), low_pass_poles(10e3), low_pass_poles(None, 30e3), low_pass_poles(None, 8e3, 0.3)],
)
def test_the_running_filter_has_the_gain_and_the_phase_of_the_analogue_filter(analogue):
    running = running_filter(analogue, STEP_S)
    slow, audible = np.array([1.0, 95.0, 266.0, 500.0, 1000.0]), np.array([2e3, 5e3, 10e3])
    for frequency_hz, tolerance in ((slow, 1e-4), (audible, 2e-3)):
        error = response(running, frequency_hz) / low_pass_gain(analogue, frequency_hz) - 1
        assert np.max(np.abs(error)) < tolerance


def test_a_filter_resonance_near_nyquist_has_the_right_frequency():
    running = running_filter(low_pass_poles(None, 30e3), STEP_S)
    frequency_hz = np.arange(25e3, 35e3, 10.0)
    assert frequency_hz[np.argmax(np.abs(response(running, frequency_hz)))] == pytest.approx(30e3, abs=50)


def test_the_running_filter_matches_its_stated_response():
    running, frequency_hz = running_filter(low_pass_poles(None, 8e3, 0.3), STEP_S), 3000.0
    phase = 2 * np.pi * frequency_hz * STEP_S * np.arange(4000)
    result = np.concatenate([running.run(np.sin(part)) for part in np.split(phase, [1, 7, 3000])])
    gain = response(running, np.array([frequency_hz]))[0]
    expected = np.imag(gain * np.exp(1j * phase))
    assert result[-500:] == pytest.approx(expected[-500:], abs=1e-9)


def test_a_first_order_filter_delays_by_its_time_constant():
    analogue, frequency_hz = low_pass_poles(50e3), 10.0
    phase = np.angle(low_pass_gain(analogue, np.array([frequency_hz]))[0])
    assert -phase / (2 * np.pi * frequency_hz) == pytest.approx(1 / (2 * np.pi * 50e3), rel=1e-6)
