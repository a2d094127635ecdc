"""Base displacement from recorded acceleration equals the played motion, without drift or delay."""

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.excitation.stepped_sine import FrequencyGrid
from vibench.acquisition.plan import Dwell, Measurement, SineSweep, SteppedSine, WhiteNoise
from vibench.analysis.errors import UnusableData
from vibench.analysis.overlay.driven_rig import (
    advance,
    lowest_frequency_hz,
    recorded_base_motion,
    shake_specimen,
)
from vibench.analysis.recordings.facts import plan_of
from vibench.sim import Sampled, gong2025, integrate

RATE = 6400.0


def motion_of(path):
    with open_recording(path) as recording:
        return recorded_base_motion(recording, plan_of(recording))


def test_base_displacement_matches_the_played_motion_within_0_1_percent(dwell_file, dwell_motions):
    found = motion_of(dwell_file("strong"))
    true = dwell_motions["strong"][0].displacement_m
    inner = slice(round(0.6 * RATE), -round(0.2 * RATE))
    np.testing.assert_allclose(found[inner], true[inner], atol=1e-3 * 5e-6)
    assert abs(np.mean(found)) < 1e-4 * 5e-6


def test_a_base_motion_with_a_gap_is_refused_with_the_number_of_lost_samples(dwell_file):
    with pytest.raises(UnusableData, match="30 samples of the base's acceleration were lost"):
        motion_of(dwell_file("weak", hole=(9000, 9030)))


def test_a_signal_can_be_advanced_by_a_fraction_of_a_sample():
    time = np.arange(512)
    shown = np.cos(2 * np.pi * 16 / 512 * (time - 0.3))
    np.testing.assert_allclose(advance(shown, 0.3), np.cos(2 * np.pi * 16 / 512 * time), atol=1e-12)


@pytest.mark.parametrize(
    ("plan", "lowest_hz"),
    [
        (Dwell(amplitude_vpp=1, frequency_hz=260, duration_s=1), 260),
        (SineSweep(amplitude_vpp=1, start_hz=350, stop_hz=150, duration_s=1), 150),
        (WhiteNoise(amplitude_vpp=1, band_start_hz=20, band_stop_hz=800), 20),
        (SteppedSine(amplitude_vpp=1, frequencies_hz=(90, 95)), 90),
        (SteppedSine(amplitude_vpp=1, grid=FrequencyGrid(start_hz=80, stop_hz=90, step_hz=5)), 80),
    ],
)
def test_the_lowest_played_frequency_sets_the_lower_band_edge(plan, lowest_hz):
    assert lowest_frequency_hz(Measurement(name="m", excitation=plan)) == lowest_hz


def test_a_simulation_made_in_pieces_equals_a_simulation_made_at_once(dwell_motions):
    base = np.tile(dwell_motions["weak"][0].displacement_m[round(4 * RATE) :], 8)[: round(7 * RATE)]
    base = base * np.clip(np.arange(base.size) / RATE, 0, 1)
    velocity, impacts = shake_specimen(gong2025(), base, RATE)
    whole = integrate(gong2025(), Sampled(base, RATE), (base.size - 1) / RATE, sample_rate_hz=RATE)
    assert impacts[-1] == whole.impacts.count == 0
    np.testing.assert_allclose(velocity, whole.states[:, 3], atol=1e-9 * np.max(np.abs(velocity)))


def test_impacts_have_the_right_times_in_a_simulation_in_pieces(dwell_motions):
    motion = dwell_motions["strong"][0].displacement_m
    first = shake_specimen(gong2025(), motion, RATE)[1]
    # Ten seconds at rest before the motion shift the same impacts into a later piece.
    later = shake_specimen(gong2025(), np.concatenate((np.zeros(round(10 * RATE)), motion)), RATE)[1]
    # Times of the first twenty impacts from the cumulative counts.
    early = np.arange(1, 21)
    times = [np.searchsorted(counts, early) / RATE for counts in (first, later)]
    np.testing.assert_allclose(times[1], times[0] + 10.0, atol=1.5 / RATE)
