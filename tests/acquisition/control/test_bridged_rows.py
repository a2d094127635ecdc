"""Drop-outs of the vibrometer are bridged before feedback uses the samples, for any block size."""

import numpy as np
import pytest

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.control.feedback_channels import BridgedRows
from vibench.acquisition.plan import Measurement, ResonanceTracking
from vibench.acquisition.recording import feedback_note
from vibench.sim import gong2025

RATE_HZ = 51_200.0


def velocity(seconds=2.0):
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    noise = 3e-6 * np.random.default_rng(1).standard_normal(time_s.size)
    return 0.02 * np.sin(2 * np.pi * 266 * time_s) + 0.001 * np.sin(2 * np.pi * 532 * time_s) + noise


@pytest.mark.parametrize("block", [900, 1925, 5000])
def test_bridged_samples_are_passed_on_once_and_in_order(block):
    light = velocity()
    dark = light.copy()
    begins = np.random.default_rng(block).integers(2_000, light.size - 3_000, 14)
    for at in begins:
        dark[at : at + 20] = 0.6
    rows, seen, place = BridgedRows(RATE_HZ), [], 0
    for first in range(0, dark.size - block, block):
        part = dark[first : first + block]
        begin, handed_on = rows.take(first, np.stack([part, part, part]))
        assert begin == place
        place += handed_on.shape[1]
        seen.append(handed_on[-1])
    together = np.concatenate(seen)
    assert together.size > dark.size - block - round(8e-3 * RATE_HZ) - block
    assert np.max(np.abs(together - light[: together.size])) < 0.02 * np.max(light)


def test_samples_without_suspected_drop_outs_are_not_delayed():
    light, rows = velocity(), BridgedRows(RATE_HZ)
    for first in range(0, 50_000, 2_000):
        part = light[first : first + 2_000]
        begin, handed_on = rows.take(first, np.stack([part, 2 * part, 3 * part]))
        assert begin == first
        assert np.array_equal(handed_on, [part, 2 * part, 3 * part])


def test_a_gap_or_a_changed_tone_restarts_the_drop_out_bridging():
    light, rows = velocity(), BridgedRows(RATE_HZ)
    dark = light[:2_000].copy()
    dark[-15:] = 0.6
    begin, handed_on = rows.take(0, np.stack([dark] * 3))
    assert handed_on.shape[1] < 2_000 - 15
    rows.skip()
    part = light[2_000:4_000]
    assert rows.take(2_000, np.stack([part] * 3))[0] == 2_000
    begin, handed_on = rows.take(9_000, np.stack([part] * 3))
    assert (begin, handed_on.shape[1]) == (9_000, 2_000)


@pytest.mark.thorough
def test_a_resonance_is_tracked_despite_vibrometer_drop_outs(rig, tmp_path):
    """Six drop-outs per second once gave 263.4 +- 2.2 Hz and a negative damping ratio."""
    virtual = rig.virtual.model_copy(update={"vibrometer_dropouts_per_s": 6.0})
    daq = rig.daq.model_copy(update={"sample_rate_hz": RATE_HZ})
    plan = ResonanceTracking(
        amplitude_vpp=0.2,
        start_hz=262,
        low_hz=240,
        high_hz=290,
        widest_step_hz=3,
        accelerations_m_per_s2=(0.3, 0.6),
    )
    with open_bench(rig.model_copy(update={"virtual": virtual, "daq": daq})) as bench:
        run_measurement(bench, Measurement(name="mode", excitation=plan, ramp_s=0.5), tmp_path / "mode.h5")
    with open_recording(tmp_path / "mode.h5") as recording:
        notes = [note for each in recording.events if (note := feedback_note(each))]
    told = [each for each in notes if getattr(each, "mode_hz", None)]
    specimen = gong2025()
    assert told
    assert told[0].mode_hz == pytest.approx(specimen.natural_frequencies_hz[1], abs=0.02)
    assert told[0].damping_ratio == pytest.approx(specimen.damping_ratios[1], rel=0.02)
