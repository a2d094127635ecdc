"""The ratio of m0 to the base is independent of the time origin of the phases."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.acquisition.control.feedback_channels import FeedbackChannels

HERTZ, DELAY_S = 31.0, 2e-4
CHANNELS = FeedbackChannels(0, 1, 2, 1.0, 1.0, 1.0, DELAY_S, 0.0, 0.0, 10_240.0)


@pytest.mark.parametrize("harmonic", [1, 2, 3, 4])
@pytest.mark.parametrize("shift_rad", [0.0, 1.0, 2.5, -3.0])
def test_a_harmonic_of_the_motion_of_m0_is_measured_under_sinusoidal_base_motion(harmonic, shift_rad):
    """Base U sin(w t) and delayed m0 X sin(n w t - 1.2) give X/U exp(-1.2 i) for any time origin."""
    omega, order = 2 * np.pi * HERTZ, harmonic * 2 * np.pi * HERTZ
    base = np.full(8, -(omega**2) * 2e-4 * np.exp(1j * shift_rad))
    late = harmonic * shift_rad - 1.2 - order * DELAY_S
    response = np.full(8, 1j * order * 3e-6 * np.exp(1j * late))
    seen = CHANNELS.transmissibility(base, response, HERTZ, harmonic)
    assert seen == pytest.approx(3e-6 / 2e-4 * np.exp(-1.2j))


@pytest.mark.parametrize("drives", [2, 3])
@pytest.mark.parametrize("shift_rad", [0.0, 1.0, 2.5, -3.0])
def test_a_subharmonic_phase_is_known_up_to_whole_drive_periods(drives, shift_rad):
    omega = 2 * np.pi * HERTZ
    base = np.full(8, -(omega**2) * 2e-4 * np.exp(1j * shift_rad))
    late = shift_rad / drives - 1.2 - omega / drives * DELAY_S
    response = np.full(8, 1j * omega / drives * 3e-6 * np.exp(1j * late))
    seen = CHANNELS.transmissibility(base, response, HERTZ, 1 / drives)
    assert seen**drives == pytest.approx((3e-6 / 2e-4 * np.exp(-1.2j)) ** drives)


@pytest.mark.parametrize("harmonic", [1, 3])
def test_ac_coupling_of_the_channels_does_not_shift_the_measured_phase(harmonic):
    """A first-order high-pass shifts the base by 0.9 degrees at 31 Hz, which counts three times at 3:1."""
    channels = replace(CHANNELS, base_cut_hz=0.5, response_cut_hz=0.5, response_delay_s=0.0)
    order = harmonic * 2 * np.pi * HERTZ
    base = np.full(8, -2e-4 * (2 * np.pi * HERTZ) ** 2) / (1 + 0.5 / (1j * HERTZ))
    response = np.full(8, 1j * order * 3e-6 * np.exp(-1.2j)) / (1 + 0.5 / (1j * harmonic * HERTZ))
    seen = channels.transmissibility(base, response, HERTZ, harmonic)
    assert seen == pytest.approx(3e-6 / 2e-4 * np.exp(-1.2j), rel=1e-12)


def test_the_response_ratio_is_zero_if_the_base_does_not_move():
    assert CHANNELS.transmissibility(np.zeros(3, complex), np.ones(3, complex), HERTZ, 3) == 0


@pytest.mark.parametrize("derivatives", [-1, 0, 1])
def test_the_acceleration_the_displacement_and_the_velocity_of_m0_give_the_same_response_ratio(derivatives):
    """The velocity follows from a signal after `derivatives` differentiations."""
    channels = replace(CHANNELS, response_derivatives=derivatives, response_delay_s=0.0)
    orders_hz = HERTZ * np.arange(5)
    base = np.full(8, -2e-4 * (2 * np.pi * HERTZ) ** 2)
    moved = 3e-6 * np.exp(-1.2j) * (2j * np.pi * orders_hz[1:]) ** (1 - derivatives)
    velocity = np.concatenate(([7.0], moved)) * channels.velocity_over_response(orders_hz)
    assert velocity[0] == (7.0 if derivatives == 0 else 0.0)
    for order in range(1, 5):
        seen = channels.transmissibility(base, np.full(8, velocity[order]), HERTZ, order)
        assert seen == pytest.approx(3e-6 / 2e-4 * np.exp(-1.2j), rel=1e-12)
