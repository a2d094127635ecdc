"""Live views of a sine and a sweep match a motion in closed form."""

import numpy as np
import pytest

from vibench.analysis.live._ring import RingWindow
from vibench.analysis.live._sine_response import (
    PoincareSection,
    drive_tone,
    drive_turns,
    look_samples,
    portrait,
    portrait_samples,
    sine_point,
    stretch_samples,
)

RATE = 51_200.0
A0 = 4e-6


def motion(phase, omega):
    """Drive, base A0 cos(phase) and response 5 A0 cos(phase - 0.7) with a second harmonic of 1 A0."""
    velocity = -5 * A0 * omega * np.sin(phase - 0.7) - 2 * A0 * omega * np.sin(2 * phase)
    return np.stack((0.3 * np.cos(phase), -A0 * omega**2 * np.cos(phase), velocity))


def sine(frequency_hz, samples, first=0):
    omega = 2 * np.pi * frequency_hz
    return RingWindow(
        first, motion(omega * (first + np.arange(samples)) / RATE + 0.4, omega).astype(np.float32)
    )


@pytest.mark.parametrize("frequency_hz", [95.3, 260.01, 499.9])
def test_a_sine_with_a_frequency_between_spectral_lines_is_found(frequency_hz):
    tone = drive_tone(sine(frequency_hz, look_samples(RATE)).values[0], RATE)
    assert tone.frequency_hz == pytest.approx(frequency_hz, abs=2e-3)
    assert tone.amplitude == pytest.approx(0.3, rel=1e-3)


def test_noise_is_not_reported_as_a_sine():
    assert drive_tone(np.random.default_rng(1).standard_normal(25_600), RATE) is None
    assert drive_tone(np.zeros(25_600), RATE) is None


@pytest.mark.parametrize("frequency_hz", [40.0, 260.0])
def test_a_live_point_has_the_responses_of_a_known_motion(frequency_hz):
    count = max(stretch_samples(frequency_hz, RATE), look_samples(RATE)) + 100
    point = sine_point(sine(frequency_hz, count), (0, 1, 2), RATE)
    phase = np.linspace(0, 2 * np.pi, 100_001)
    largest = np.abs(5 * np.cos(phase - 0.7) + np.cos(2 * phase)).max()
    assert point.frequency_hz == pytest.approx(frequency_hz, abs=0.01)
    assert point.drive_amplitude_m == pytest.approx(A0, rel=2e-3)
    assert point.response_ii == pytest.approx(5.0, rel=2e-3)
    assert point.response_i == pytest.approx(largest, rel=5e-3)
    slope = -5 * np.sin(phase - 0.7) - 2 * np.sin(2 * phase)
    omega = 2 * np.pi * frequency_hz
    assert point.upper == pytest.approx(A0 * omega * slope.max(), rel=2e-3)
    assert point.lower == pytest.approx(A0 * omega * slope.min(), rel=2e-3)


def test_a_live_point_of_a_sweep_has_the_frequency_of_the_sweep_at_that_time():
    time_s = np.arange(int(2 * RATE)) / RATE
    phase = 2 * np.pi * (255.0 * time_s + 0.5 * 2.0 * time_s**2)
    window = RingWindow(0, motion(phase, 2 * np.pi * (255.0 + 2.0 * time_s)).astype(np.float32))
    point = sine_point(window, (0, 1, 2), RATE)
    assert point.frequency_hz == pytest.approx(255.0 + 2.0 * point.time_s, abs=0.02)
    assert point.response_ii == pytest.approx(5.0, rel=0.01)


def constant_displacement_sweep(start_hz, rate_hz_per_s, level=1.0):
    """Two seconds of a sweep whose drive voltage grows with the square of its frequency."""
    time_s = np.arange(int(2 * RATE)) / RATE
    frequency_hz = start_hz + rate_hz_per_s * time_s
    values = motion(
        2 * np.pi * (start_hz * time_s + 0.5 * rate_hz_per_s * time_s**2), 2 * np.pi * frequency_hz
    )
    values[0] *= (frequency_hz / start_hz) ** 2
    return RingWindow(0, (level * values).astype(np.float32))


def test_no_live_point_is_drawn_while_the_drive_is_ramped_down():
    time_s = np.arange(int(2 * RATE)) / RATE
    ramp = np.cos(0.5 * np.pi * np.clip(time_s - 1.7, 0.0, 1.0)) ** 2
    assert sine_point(constant_displacement_sweep(260.0, 0.0), (0, 1, 2), RATE) is not None
    assert sine_point(constant_displacement_sweep(260.0, 0.0, ramp), (0, 1, 2), RATE) is None
    silence = np.where(time_s < 1.9, 1.0, 0.0)
    assert sine_point(constant_displacement_sweep(260.0, 0.0, silence), (0, 1, 2), RATE) is None


@pytest.mark.parametrize(("start_hz", "rate_hz_per_s"), [(110.0, -20.0), (260.0, -3.0), (260.0, 30.0)])
def test_a_sweep_of_constant_displacement_gives_a_live_point(start_hz, rate_hz_per_s):
    point = sine_point(constant_displacement_sweep(start_hz, rate_hz_per_s), (0, 1, 2), RATE)
    assert point.frequency_hz == pytest.approx(start_hz + rate_hz_per_s * point.time_s, rel=0.01)


def test_lost_or_too_few_samples_give_no_live_point():
    window = sine(260.0, 60_000)
    assert sine_point(RingWindow(0, window.values[:, :1000]), (0, 1, 2), RATE) is None
    window.values[1, -50] = np.nan
    assert sine_point(window, (0, 1, 2), RATE) is None


@pytest.mark.parametrize("rate_hz_per_s", [0.0, 1.0, -3.0])
def test_drive_periods_begin_at_the_drive_maximum_even_in_a_sweep(rate_hz_per_s):
    time_s = np.arange(int(0.5 * RATE)) / RATE
    turns = 260.0 * time_s + 0.5 * rate_hz_per_s * time_s**2 + 0.31
    found = drive_turns(np.cos(2 * np.pi * turns), RATE, 260.0 + 0.25 * rate_hz_per_s)
    at = np.interp(found, np.arange(time_s.size), turns)
    assert found.size > 95
    assert np.abs(at - np.rint(at)).max() < 5e-4


def test_a_motion_with_the_drive_period_has_one_poincare_point():
    count = max(portrait_samples(260.0, RATE), look_samples(RATE))
    window = sine(260.0, count, first=10_000)
    found = portrait(window, 0, 2, RATE)
    assert found.strobe_sample.size >= 15
    assert np.allclose(found.strobe_displacement_m, A0 * (5 * np.cos(0.7) + 1), rtol=2e-3)
    assert np.allclose(found.strobe_velocity_m_per_s, 5 * A0 * 2 * np.pi * 260 * np.sin(0.7), rtol=5e-3)
    assert np.all(np.diff(found.strobe_sample) == pytest.approx(RATE / 260.0, abs=0.05))
    assert found.strobe_sample[0] > 10_000
    phase = np.linspace(0, 2 * np.pi, 1001)
    assert found.orbit_displacement_m.max() == pytest.approx(
        A0 * np.max(5 * np.cos(phase - 0.7) + np.cos(2 * phase)), rel=0.01
    )


def test_each_poincare_point_is_given_once_even_if_phase_portraits_overlap():
    section, kept = PoincareSection(), []
    count = portrait_samples(260.0, RATE)
    for first in range(0, 30_000, 2560):
        found = portrait(sine(260.0, count + 13_000, first), 0, 2, RATE)
        before = section.displacement_m.size
        section.add(found)
        kept.append(section.displacement_m.size - before)
    assert sum(kept) == section.displacement_m.size
    # each portrait omits 20 of its 70 periods at either end; the last begins 28 160 samples after the first
    assert section.displacement_m.size == pytest.approx(28_160 / RATE * 260 + 70 - 40, abs=2)


def test_a_full_poincare_section_drops_its_oldest_points():
    section = PoincareSection(most=10)
    section.add(portrait(sine(260.0, portrait_samples(260.0, RATE) + 13_000), 0, 2, RATE))
    assert section.displacement_m.size == section.velocity_m_per_s.size == 10
