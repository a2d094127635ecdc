"""One sample of the motion per drive period, for clocks that differ and non-integer samples per period."""

import numpy as np
import pytest

from vibench.acquisition.control.steadiness import ORDERS, Stroboscope

RATE_HZ = 51200.0
NEAR_HZ = 260.3
FIRST_BLOCK = 52
"""Number of periods in the first block; the clock difference is not yet known: up to 0.2 degrees off."""


def observe(motion, ppm=17.0, blocks=12, block_s=0.2, phase=0.3, drives=1):
    """Feed blocks of a drive with a separate clock, a base that lags by 0.5 rad, and a motion."""
    scope = Stroboscope(NEAR_HZ, RATE_HZ, drives)
    count = round(block_s * RATE_HZ)
    for block in range(blocks):
        time_s = (block * count + np.arange(count)) / RATE_HZ
        angle = 2 * np.pi * (NEAR_HZ * (1 + 1e-6 * ppm) * time_s + phase)
        scope.add(block * count, np.sin(angle), 2 * np.sin(angle - 0.5), motion(angle))
    return scope


@pytest.mark.parametrize("ppm", [-40.0, 0.0, 17.0])
def test_the_drive_frequency_is_measured_relative_to_the_converter_clock(ppm):
    scope = observe(np.sin, ppm)
    assert scope.clock.frequency_hz == pytest.approx(NEAR_HZ * (1 + 1e-6 * ppm), rel=1e-9)


def test_the_amplitude_and_the_phase_of_a_motion_and_of_a_delayed_base_are_measured():
    periods = observe(lambda angle: 3 * np.sin(angle)).periods()
    np.testing.assert_allclose(periods.response[:, 1], 3.0, atol=0.01)
    np.testing.assert_allclose(periods.response[FIRST_BLOCK:, 1], 3.0, atol=2e-4)
    np.testing.assert_allclose(periods.base[FIRST_BLOCK:], 2 * np.exp(-0.5j), atol=2e-4)


def test_no_period_is_lost_or_repeated_between_blocks():
    periods = observe(np.sin).periods()
    assert periods.count == int(12 * 0.2 * NEAR_HZ)


def test_the_mean_and_each_harmonic_are_measured_separately():
    periods = observe(lambda a: 0.7 + np.sin(a) + 0.3 * np.sin(2 * a) + 0.1 * np.cos(4 * a)).periods()
    np.testing.assert_allclose(np.abs(periods.response.mean(axis=0)), [0.7, 1, 0.3, 0, 0.1], atol=1e-4)


def test_a_subharmonic_makes_successive_drive_periods_differ():
    motion = observe(lambda a: np.sin(a) + 0.1 * np.sin(a / 2))
    response = motion.periods().response[FIRST_BLOCK:]
    np.testing.assert_allclose(response[2:], response[:-2], atol=2e-4)
    # The mean of sin(a/2) over each period is 2/pi, with alternating sign.
    assert np.abs(np.diff(response[:, 0])).min() == pytest.approx(0.1 * 4 / np.pi, rel=1e-2)


@pytest.mark.parametrize("drives", [2, 3])
def test_a_motion_that_repeats_after_several_drive_periods_gives_one_row_per_repetition(drives):
    motion = observe(lambda a: np.sin(a - 1) + 0.1 * np.sin(a / drives), drives=drives)
    periods = motion.periods()
    assert periods.count == int(12 * 0.2 * NEAR_HZ / drives)
    sizes = np.abs(periods.response[FIRST_BLOCK:])
    np.testing.assert_allclose(sizes[:, [1, drives]], [[0.1, 1.0]] * len(sizes), atol=2e-4)
    np.testing.assert_allclose(periods.base[FIRST_BLOCK:], 2 * np.exp(-0.5j), atol=2e-4)
    # The drive period at which counting begins is arbitrary; the phase times `drives` does not depend on it.
    turned = (10 * periods.response[FIRST_BLOCK:, 1]) ** drives
    np.testing.assert_allclose(turned, 1.0, atol=0.01)


def test_the_noise_of_one_period_is_measured_with_the_drive_off():
    noise = 1e-3 * np.random.default_rng(1).standard_normal(20_000)
    per_period = RATE_HZ / NEAR_HZ
    # Variance of a complex amplitude: 4 s^2 / n for each order above the mean, s^2 / n for the mean.
    expected = 1e-3 * np.sqrt((4 * (ORDERS - 1) + 1) / per_period)
    assert Stroboscope.noise_of(noise, NEAR_HZ, RATE_HZ) == pytest.approx(expected, rel=0.1)
