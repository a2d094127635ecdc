"""Following a sampled base motion sample by sample equals its integration."""

import numpy as np
import pytest

from vibench.sim import Accuracy, Sampled, follow_samples, gong2025, integrate

RATE_HZ = 51_200.0


def ramped_sine_base(amplitude_m, seconds=0.3, frequency_hz=260.0):
    time_s = np.arange(round(seconds * RATE_HZ) + 1) / RATE_HZ
    ramp = np.clip(time_s / 0.02, 0.0, 1.0)
    return Sampled(amplitude_m * ramp**3 * np.sin(2 * np.pi * frequency_hz * time_s), RATE_HZ)


@pytest.mark.parametrize("amplitude_m", [0.0, 1e-7, 2e-6, 2e-5])
def test_following_a_base_motion_sample_by_sample_gives_the_same_motion_as_integration(amplitude_m):
    drive = ramped_sine_base(amplitude_m)
    followed = follow_samples(gong2025(), drive, Accuracy.REFERENCE)
    duration_s = (len(drive.displacement_m) - 1) / RATE_HZ
    whole = integrate(gong2025(), drive, duration_s, Accuracy.REFERENCE, sample_rate_hz=RATE_HZ)
    assert followed.states.shape == (followed.requested, 6)
    assert np.sum(followed.impacts) == whole.impacts.count
    # Both use the same intervals with different rounding, which chaos amplifies.
    near = slice(0, 4000)
    scale = np.array([1e-4, 1e-4, 1e-4, 0.1, 0.1, 0.1])
    np.testing.assert_allclose(followed.states[near] / scale, whole.states[near] / scale, atol=1e-9)


def test_impacts_are_counted_in_the_interval_in_which_they_begin():
    drive = ramped_sine_base(2e-6)
    followed = follow_samples(gong2025(), drive)
    whole = integrate(gong2025(), drive, (len(drive.displacement_m) - 1) / RATE_HZ)
    first = np.floor(whole.impacts.times_s[:10] * RATE_HZ).astype(int)
    assert np.flatnonzero(followed.impacts)[:10].tolist() == first.tolist()


def test_an_overflowing_motion_stops_at_its_last_finite_sample():
    samples = np.zeros(1000)
    samples[500:] = 1e280
    followed = follow_samples(gong2025(), Sampled(samples, RATE_HZ))
    assert len(followed.states) < followed.requested
    assert np.all(np.isfinite(followed.states[:400]))
