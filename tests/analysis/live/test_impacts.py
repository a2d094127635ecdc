import numpy as np
import pytest

from vibench.analysis.live._view import ImpactCounter

RATE = 51_200.0


def motion_with_impacts(times_s, duration_s, noise=3e-6, seed=1):
    """Return the velocity of a 260 Hz motion with spring-like impacts at given times."""
    time_s = np.arange(int(duration_s * RATE)) / RATE
    velocity = 0.02 * np.sin(2 * np.pi * 260 * time_s)
    for number, at in enumerate(times_s):
        since = np.clip(time_s - at, 0, None)
        velocity += (-1) ** number * 5e5 * (0.5 * since**2 + 2e-5 * since) * np.exp(-since / 1.5e-3)
    return velocity + noise * np.random.default_rng(seed).standard_normal(time_s.size)


@pytest.mark.parametrize("block", [100, 2560, 51_200])
def test_every_impact_is_counted_once_for_any_block_size(block):
    times_s = 0.1 + 0.0123 * np.arange(60)
    velocity = motion_with_impacts(times_s, 1.0)
    counter = ImpactCounter(RATE)
    found = sum(counter.add(velocity[first : first + block]) for first in range(0, velocity.size, block))
    assert counter.count == found == 60


def test_no_impacts_are_counted_in_a_smooth_motion_with_harmonics():
    time_s = np.arange(int(3 * RATE)) / RATE
    velocity = 0.02 * np.sin(2 * np.pi * 260 * time_s) + 0.0008 * np.sin(2 * np.pi * 780 * time_s)
    counter = ImpactCounter(RATE)
    counter.add(velocity + 3e-6 * np.random.default_rng(2).standard_normal(time_s.size))
    assert counter.count == 0


def test_no_impacts_are_counted_in_noise_alone():
    counter = ImpactCounter(RATE)
    counter.add(np.random.default_rng(3).standard_normal(int(5 * RATE)))
    assert counter.count == 0


def test_lost_samples_are_not_counted_as_impacts():
    velocity = motion_with_impacts((), 1.0)
    velocity[20_000:20_500] = np.nan
    counter = ImpactCounter(RATE)
    counter.add(velocity)
    assert counter.count == 0
