"""Parameters of a wrongly described specimen that a motion without impacts determines."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.analysis.hidden_motion import hidden_motion_in_samples
from vibench.analysis.hidden_motion._tracking_model import Hidden, tracked_specimen, value_of
from vibench.sim import gong2025

RATE_HZ, SAMPLES = 51_200.0, 61_440
NOISE = (5e-3, 3.2e-6)
"""Rms noise of the rig's channels [m/s2, m/s]."""
SPECIMEN = gong2025()


def coupled(of0, of1, of2):
    """Return the stiffness or damping matrix of the three masses."""
    return np.array([[of0 + of2, 0, -of2], [0, of1, -of1], [-of2, -of1, of1 + of2]])


def noisy_channels(rng, acceleration):
    """Return noisy base acceleration and m0 velocity of the linear specimen for a base spectrum."""
    (m0, m1, m2), (k0, k1, k2), (c0, c1, c2) = SPECIMEN.masses, SPECIMEN.stiffnesses, SPECIMEN.dampings
    omega = 2 * np.pi * np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)
    some = np.flatnonzero(acceleration)
    w = omega[some]
    dynamic = (
        coupled(k0, k1, k2)
        + 1j * w[:, None, None] * coupled(c0, c1, c2)
        - (w**2)[:, None, None] * np.diag([m0, m1, m2])
    )
    base = -acceleration[some] / w**2
    push = np.zeros((len(some), 3, 1), dtype=complex)
    push[:, 0, 0] = (k0 + 1j * w * c0) * base
    velocity = np.zeros_like(acceleration)
    velocity[some] = 1j * w * np.linalg.solve(dynamic, push)[:, 0, 0]
    pair = (np.fft.irfft(each, SAMPLES) for each in (acceleration, velocity))
    return tuple(each + rms * rng.standard_normal(SAMPLES) for each, rms in zip(pair, NOISE, strict=True))


def sine(frequency_hz, level):
    """Return the base acceleration spectrum of a sine on the nearest spectral line."""
    spectrum = np.zeros(SAMPLES // 2 + 1, dtype=complex)
    spectrum[round(frequency_hz * SAMPLES / RATE_HZ)] = 0.5 * level * SAMPLES
    return spectrum


def white(rng, rms):
    """Return the spectrum of a random base acceleration from 20 Hz to 1 kHz."""
    frequency_hz = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)
    spectrum = rng.standard_normal((2, len(frequency_hz))).T @ np.array([1.0, 1j])
    spectrum *= (frequency_hz > 20) & (frequency_hz < 1000)
    return spectrum * rms / np.std(np.fft.irfft(spectrum, SAMPLES))


def estimate(rng, acceleration, factors):
    """Return the determined parameters if the dampers are described wrongly by these factors."""
    dampings = tuple(float(each) for each in np.array(SPECIMEN.dampings) * factors)
    motion = hidden_motion_in_samples(
        *noisy_channels(rng, acceleration), RATE_HZ, replace(SPECIMEN, dampings=dampings)
    )
    return {each.what: each for each in motion.parameters if each.is_determined}


def coverage(found):
    true = tracked_specimen(SPECIMEN)
    return [each.low <= value_of(true, what) <= each.high for what, each in found.items()]


@pytest.mark.parametrize("factor", [1.5, 0.7])
def test_channel_noise_alone_determines_no_parameter_of_the_specimen(factor):
    assert not estimate(np.random.default_rng(2), np.zeros(SAMPLES // 2 + 1, dtype=complex), (1, factor, 1))


@pytest.mark.thorough
def test_a_single_weak_sine_does_not_determine_the_dampers():
    """Bounds around the described value once missed the true value in ten of ten cases."""
    rng = np.random.default_rng(3)
    inside = []
    for frequency_hz, level in ((95.0, 0.005), (150.0, 0.2), (260.0, 0.2), (400.0, 1.0)):
        for factor in (1.5, 0.7):
            inside += coverage(estimate(rng, sine(frequency_hz, level), (1, factor, 1)))
    assert inside.count(False) <= 1


@pytest.mark.thorough
def test_wrong_values_of_the_dampers_are_corrected_from_weak_noise():
    rng = np.random.default_rng(4)
    inside, dampers = [], []
    for factors in ((1, 1.5, 1), (1, 0.7, 1), (1, 1, 0.8), (1.05, 1.3, 0.9)):
        found = estimate(rng, white(rng, 0.1), factors)
        inside += coverage(found)
        dampers.append(Hidden.C1 in found)
    assert all(dampers)
    assert inside.count(False) <= 1
