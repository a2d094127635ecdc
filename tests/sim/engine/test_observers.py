"""Peaks and spectral lines observed during a run match dense samples of the same motion."""

import numpy as np
import pytest

from tests.sim.engine import native_calls
from vibench.sim import Harmonic, gong2025
from vibench.sim.engine.run import NativeRun, RunRecord, Watch

LAWS = (*native_calls.LAWS, "power:47")
PERIODS, SAMPLES = 6, 120_000


def observe_run(law, tolerance, drive):
    """Return the record of whole periods after a transient, with dense samples and their times."""
    begin_s, end_s = 0.02, 0.02 + PERIODS / drive.frequency_hz
    run = NativeRun(gong2025(contact=law), drive, np.zeros(6), tolerance)
    rate_hz = SAMPLES / (end_s - begin_s)
    record = RunRecord(10_000, start_s=begin_s, sample_rate_hz=rate_hz, samples=SAMPLES + 1)
    run.advance(begin_s, record)
    record.watch(Watch.PEAKS_AND_LINES)
    run.advance(end_s, record)
    return record, record.all_samples(run.motion), begin_s + np.arange(SAMPLES + 1) / rate_hz


@pytest.mark.parametrize(
    ("law", "tolerance"), [*((law, 3e-7) for law in LAWS), *((law, 1e-10) for law in LAWS[::3])]
)
def test_peaks_and_spectral_lines_of_a_run_match_its_samples(law, tolerance):
    drive = Harmonic(130.0, 20e-6, 0.7)
    record, states, time_s = observe_run(law, tolerance, drive)
    assert record.impacts > 10 or law == "linear" or law.startswith("power")
    x, p = states[:, 0], states[:, 1] - states[:, 2]
    against = np.exp(-1j * (2.0 * np.pi * drive.frequency_hz * time_s + drive.phase_rad))
    for values, peak, area in ((x, record.peak_x_m, record.area_x), (p, record.peak_p_m, record.area_p)):
        # A peak may lie between two samples; samples within a power-law step err within the tolerance.
        assert np.abs(values).max() <= peak * (1.0 + tolerance)
        assert np.abs(values).max() == pytest.approx(peak, rel=5e-5)
        assert abs(area - np.trapezoid(values * against, time_s)) < 3e-8 * abs(area)


@pytest.mark.parametrize("law", LAWS)
def test_observing_peaks_and_lines_does_not_change_the_motion(law):
    drive = Harmonic(260.0, 5e-6)
    motions = []
    for watch in Watch:
        run, record = NativeRun(gong2025(contact=law), drive, np.zeros(6), 3e-7), RunRecord(10_000)
        record.watch(watch)
        run.advance(0.3, record)
        motions.append(run.motion)
    for motion in motions[1:]:
        np.testing.assert_array_equal(motion, motions[0])
