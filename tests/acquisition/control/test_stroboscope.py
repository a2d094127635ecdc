"""The motion once a period, although two clocks disagree and no period is a whole number of samples."""

import numpy as np
import pytest

from vibench.acquisition.control.steadiness import ORDERS, Stroboscope

RATE_HZ = 51200.0
NEAR_HZ = 260.3
FIRST_BLOCK = 52
"""Periods that are seen before a second block tells the clocks apart: up to 0.2 degrees off."""


def looked_at(motion, ppm=17.0, blocks=12, block_s=0.2, phase=0.3, drives=1):
    """Feed blocks of a drive with its own clock, a base half a radian behind, and a motion of its phase."""
    scope = Stroboscope(NEAR_HZ, RATE_HZ, drives)
    count = round(block_s * RATE_HZ)
    for block in range(blocks):
        time_s = (block * count + np.arange(count)) / RATE_HZ
        angle = 2 * np.pi * (NEAR_HZ * (1 + 1e-6 * ppm) * time_s + phase)
        scope.add(block * count, np.sin(angle), 2 * np.sin(angle - 0.5), motion(angle))
    return scope


@pytest.mark.parametrize("ppm", [-40.0, 0.0, 17.0])
def test_the_drive_frequency_is_measured_by_the_converter_clock(ppm):
    scope = looked_at(np.sin, ppm)
    assert scope.clock.frequency_hz == pytest.approx(NEAR_HZ * (1 + 1e-6 * ppm), rel=1e-9)


def test_a_delayed_sine_has_a_negative_phase():
    periods = looked_at(lambda angle: 3 * np.sin(angle)).periods()
    np.testing.assert_allclose(periods.response[:, 1], 3.0, atol=0.01)
    np.testing.assert_allclose(periods.response[FIRST_BLOCK:, 1], 3.0, atol=2e-4)
    np.testing.assert_allclose(periods.base[FIRST_BLOCK:], 2 * np.exp(-0.5j), atol=2e-4)


def test_no_period_is_lost_or_repeated_between_blocks():
    periods = looked_at(np.sin).periods()
    assert periods.count == int(12 * 0.2 * NEAR_HZ)


def test_harmonics_and_mean_are_measured_in_their_orders():
    periods = looked_at(lambda a: 0.7 + np.sin(a) + 0.3 * np.sin(2 * a) + 0.1 * np.cos(4 * a)).periods()
    np.testing.assert_allclose(np.abs(periods.response.mean(axis=0)), [0.7, 1, 0.3, 0, 0.1], atol=1e-4)


def test_a_subharmonic_alternates_from_one_drive_period_to_the_next():
    motion = looked_at(lambda a: np.sin(a) + 0.1 * np.sin(a / 2))
    response = motion.periods().response[FIRST_BLOCK:]
    np.testing.assert_allclose(response[2:], response[:-2], atol=2e-4)
    # The mean of sin(a/2) over each period is 2/pi, with either sign.
    assert np.abs(np.diff(response[:, 0])).min() == pytest.approx(0.1 * 4 / np.pi, rel=1e-2)


@pytest.mark.parametrize("drives", [2, 3])
def test_a_motion_over_several_drive_periods_gives_one_row_per_repetition(drives):
    motion = looked_at(lambda a: np.sin(a - 1) + 0.1 * np.sin(a / drives), drives=drives)
    periods = motion.periods()
    assert periods.count == int(12 * 0.2 * NEAR_HZ / drives)
    sizes = np.abs(periods.response[FIRST_BLOCK:])
    np.testing.assert_allclose(sizes[:, [1, drives]], [[0.1, 1.0]] * len(sizes), atol=2e-4)
    np.testing.assert_allclose(periods.base[FIRST_BLOCK:], 2 * np.exp(-0.5j), atol=2e-4)
    # From which of its drives a period is counted is any; so many times the phase is not.
    turned = (10 * periods.response[FIRST_BLOCK:, 1]) ** drives
    np.testing.assert_allclose(turned, 1.0, atol=0.01)


def test_the_noise_per_period_is_measured_with_the_drive_off():
    noise = 1e-3 * np.random.default_rng(1).standard_normal(20_000)
    per_period = RATE_HZ / NEAR_HZ
    # Each order above the mean: variance 4 s^2 / n of a complex amplitude; the mean: s^2 / n.
    expected = 1e-3 * np.sqrt((4 * (ORDERS - 1) + 1) / per_period)
    assert Stroboscope.noise_of(noise, NEAR_HZ, RATE_HZ) == pytest.approx(expected, rel=0.1)
