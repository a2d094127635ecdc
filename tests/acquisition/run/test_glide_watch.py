"""Lost cycles of a recorded sweep are counted, also whole cycles."""

from types import SimpleNamespace

import numpy as np
import pytest

from vibench.acquisition.instruments import Block, Spacing, Sweep
from vibench.acquisition.rig import Role
from vibench.acquisition.run.phase_runner import GlideWatch

RATE = 5120.0
CHANNELS = (SimpleNamespace(role=Role.M0_VELOCITY), SimpleNamespace(role=Role.DRIVE_VOLTAGE))


def drive_blocks(cycles, amplitude_v=0.1, noise_v=1e-3, offset_v=0.0, block=512, seed=0):
    """Return blocks of a noisy drive with this phase in cycles."""
    drive = offset_v + amplitude_v * np.sin(2 * np.pi * cycles)
    drive += noise_v * np.random.default_rng(seed).standard_normal(drive.size)
    cut = range(0, drive.size, block)
    return [Block(first, np.vstack([drive, drive])[:, first : first + block]) for first in cut]


def excess(tones, late_s, step_s, **noise):
    """Play tones that begin ``late_s`` too late, except for the first; return the excess cycles."""
    time_s = np.arange(round(len(tones) * step_s * RATE)) / RATE
    number = np.clip(((time_s - late_s) / step_s).astype(int), 0, len(tones) - 1)
    cycles = np.cumsum(np.array(tones)[number]) / RATE
    blocks = drive_blocks(cycles, **noise)
    watch = GlideWatch(CHANNELS, RATE)
    each = round(step_s * RATE / 512)
    for place, tone in enumerate(tones):
        watch.take(blocks[place * each : (place + 1) * each], tone, step_s)
    return watch.more_cycles


@pytest.mark.parametrize("seed", range(6))
def test_any_number_of_cycles_lost_by_a_late_drive_is_counted(seed):
    rng = np.random.default_rng(seed)
    tones = np.cumsum(rng.uniform(5.0, 30.0, 6)) + 80.0
    late_s = rng.uniform(0.0, 0.4)
    lost = late_s * (tones[-1] - tones[0])
    found = excess(tones, late_s, 1.0, seed=seed, offset_v=0.03, amplitude_v=0.01)
    delay = 40 / RATE * (tones[-1] - tones[0])
    assert found == pytest.approx(-max(0.0, lost - delay), abs=0.06)


def test_three_whole_cycles_lost_by_a_late_drive_are_detected():
    assert excess([150.0, 180.0], 0.1, 1.0, noise_v=0.0) == pytest.approx(-3 + 40 / RATE * 30, abs=0.02)


@pytest.mark.parametrize("spacing", list(Spacing))
def test_the_cycles_lost_because_a_sweep_started_late_are_counted_at_the_end_of_the_sweep(spacing):
    sweep, late_s = Sweep(90.0, 530.0, 3.0, spacing), 0.02
    time_s = np.arange(round(3.0 * RATE)) / RATE
    watch = GlideWatch(CHANNELS, RATE)
    take_block = watch.following(sweep)
    began = np.where(time_s < late_s, 90.0 * time_s, 90.0 * late_s + sweep.cycles(time_s - late_s))
    for block in drive_blocks(began):
        take_block(block)
    lost = float(sweep.cycles(3.0) - 90.0 * late_s - sweep.cycles(3.0 - late_s))
    assert watch.more_cycles == pytest.approx(-(lost - 40 / RATE * 440), abs=0.4)


def test_unobserved_samples_restart_the_count_of_cycles():
    watch = GlideWatch(CHANNELS, RATE)
    blocks = drive_blocks(100.0 * np.arange(5120) / RATE)
    watch.take(blocks[:3], 100.0, 0.3)
    watch.take(blocks[6:], 100.0, 0.4)
    assert watch.more_cycles == pytest.approx(0.0, abs=0.01)
