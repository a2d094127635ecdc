"""Vibrometer and accelerometer: scale, noise, full scale, drop-outs."""

import numpy as np
import pytest

from vibench.acquisition import ConfigurationError
from vibench.acquisition.rig import Role, load_rig
from vibench.virtual_rig.world.sensors import (
    LONGEST_DELAY_S,
    PAGE,
    Disturbance,
    MotionSensor,
    NoiseStream,
    RandomDropouts,
)
from vibench.virtual_rig.world.time_grid import FULL_BAND_HZ, USUAL_GRID

RIG = load_rig("virtual_rig")
GRID_RATE_HZ = USUAL_GRID.rate_hz
FULL_SCALE_V = RIG.vibrometer.full_scale_v
FULL_SCALE_M_PER_S = FULL_SCALE_V * RIG.vibrometer.units_per_volt("m s-1")


def vibrometer(noise_density=0.0, dropouts_per_s=0.0, **config):
    return MotionSensor(
        RIG.vibrometer.model_copy(update=config),
        Role.M0_VELOCITY,
        noise_density * np.sqrt(GRID_RATE_HZ / 2),
        NoiseStream(1, "vibrometer"),
        dropouts=RandomDropouts(dropouts_per_s, NoiseStream(1, "dropouts")),
    )


def accelerometer(noise_m_per_s2=0.0, **config):
    return MotionSensor(
        RIG.accelerometer.model_copy(update=config),
        Role.BASE_ACCELERATION,
        USUAL_GRID.rms_per_step(noise_m_per_s2),
        NoiseStream(1, "accelerometer"),
    )


def test_a_steady_velocity_gives_the_voltage_set_by_the_decoder_range():
    volts = vibrometer().volts(np.full(200, 0.3 * FULL_SCALE_M_PER_S), 0)
    assert volts[-1] == pytest.approx(0.3 * FULL_SCALE_V, rel=1e-9)


def test_a_velocity_beyond_full_scale_is_clipped():
    volts = vibrometer().volts(np.full(200, -1.7 * FULL_SCALE_M_PER_S), 0)
    assert np.min(volts) == -FULL_SCALE_V
    assert np.count_nonzero(volts == -FULL_SCALE_V) > 190


def test_the_vibrometer_noise_has_the_configured_density():
    density = 2e-8
    volts = vibrometer(noise_density=density).volts(np.zeros(200_000), 0)
    rms = np.std(volts) * FULL_SCALE_M_PER_S / FULL_SCALE_V
    assert rms == pytest.approx(density * np.sqrt(GRID_RATE_HZ / 2), rel=0.01)


def test_the_accelerometer_noise_has_its_stated_rms_in_the_full_band():
    acceleration = accelerometer(noise_m_per_s2=0.005).volts(np.zeros(200_000), 0)
    acceleration /= RIG.accelerometer.sensitivity_v_per_m_per_s2
    spectrum = np.abs(np.fft.rfft(acceleration)) ** 2 * 2 / len(acceleration) ** 2
    in_band = np.fft.rfftfreq(len(acceleration), 1 / GRID_RATE_HZ) < FULL_BAND_HZ
    assert np.sqrt(np.sum(spectrum[in_band])) == pytest.approx(0.005, rel=0.01)


def test_the_accelerometer_clips_at_its_full_scale():
    limit = RIG.accelerometer.full_scale_v
    volts = accelerometer().volts(np.full(2000, 3 * limit / RIG.accelerometer.sensitivity_v_per_m_per_s2), 0)
    assert volts[-1] == limit


def test_the_decoder_delay_includes_the_delay_of_its_bandwidth():
    config = RIG.vibrometer
    bandwidth_s = 1 / (2 * np.pi * config.bandwidth_hz)
    assert vibrometer().delay_steps / GRID_RATE_HZ + bandwidth_s == pytest.approx(config.delay_s)


def test_a_delay_that_cannot_be_simulated_is_refused():
    with pytest.raises(ConfigurationError, match=r"delay_s = 0\.1 s.*at most"):
        vibrometer(delay_s=0.1)
    assert vibrometer(delay_s=LONGEST_DELAY_S).delay_steps > 0


def test_a_requested_drop_out_replaces_the_signal_for_its_duration():
    instrument = vibrometer()
    instrument.disturb(Disturbance(150, 160, 1.0))
    first, second = (instrument.volts(np.full(100, 0.01), start) for start in (100, 200))
    assert np.all(first[50:60] == FULL_SCALE_V)
    assert np.count_nonzero(first == FULL_SCALE_V) == 10
    quiet = 0.01 / FULL_SCALE_M_PER_S * FULL_SCALE_V
    assert np.concatenate([first[60:], second]) == pytest.approx(quiet, rel=1e-6)


def test_drop_outs_occur_at_random_at_the_configured_rate():
    per_s, steps = 50.0, 1_000_000
    found = RandomDropouts(per_s, NoiseStream(2, "dropouts")).between(0, steps)
    begun = [one for one in found if 0 <= one.first_step < steps]
    expected = per_s * steps / GRID_RATE_HZ
    assert abs(len(begun) - expected) < 5 * np.sqrt(expected)
    lengths = [one.stop_step - one.first_step for one in begun]
    assert np.mean(lengths) == pytest.approx(RandomDropouts.MEAN_S * GRID_RATE_HZ, rel=0.15)


def test_drop_outs_do_not_depend_on_the_block_size():
    steps = 5 * PAGE  # a multiple of 640
    whole = vibrometer(dropouts_per_s=200.0).volts(np.zeros(steps), 0)
    instrument = vibrometer(dropouts_per_s=200.0)
    parts = [instrument.volts(np.zeros(640), start) for start in range(0, steps, 640)]
    assert np.count_nonzero(whole) > 500
    assert np.array_equal(np.concatenate(parts), whole)
