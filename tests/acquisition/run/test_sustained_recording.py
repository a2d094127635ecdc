"""Ten minutes of four channels at 51.2 kS/s lose no sample, and memory does not grow."""

from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import Dwell, Measurement
from vibench.acquisition.recording import RecordingState

VIRTUAL = Path(__file__).parents[3] / "hardware_configs" / "virtual_rig.toml"
MINUTES = 10
FREQUENCY_HZ = 260.0


def resident_mb():
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS:"))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_ten_minute_recording_loses_no_sample_and_uses_constant_memory(tmp_path):
    memory_mb = []

    def watch(progress):
        if progress.elapsed_s >= 60 * (len(memory_mb) + 1):
            memory_mb.append(resident_mb())

    excitation = Dwell(amplitude_vpp=1.5, frequency_hz=FREQUENCY_HZ, settle_s=1, duration_s=60 * MINUTES)
    with open_bench(VIRTUAL) as bench:
        run_measurement(
            bench, Measurement(name="long", excitation=excitation), tmp_path / "run.h5", on_progress=watch
        )
    assert len(memory_mb) >= MINUTES
    assert max(memory_mb[2:]) - memory_mb[1] < 60

    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.state is RecordingState.COMPLETE
        assert not recording.gaps
        assert not recording.overloads
        dwell = next(each for each in recording.segments if each.label == "dwell")
        rate = recording.sample_rate_hz
        assert dwell.last_sample + 1 - dwell.first_sample == round(60 * MINUTES * rate)
        # A lost or repeated sample would shift the phase of the drive by 1.8 degrees from then on.
        phases = []
        second = round(rate)
        for first in range(dwell.first_sample, dwell.last_sample - second, second):
            turns = (
                FREQUENCY_HZ
                * np.arange(first - dwell.first_sample, first - dwell.first_sample + second)
                / rate
            )
            drive = recording.read("drive_voltage", first, first + second)
            phases.append(np.angle(np.vdot(np.exp(2j * np.pi * turns), drive)))
    steps = np.degrees(np.diff(np.unwrap(phases)))
    # The clocks differ by 17 ppm: the phase drifts by 360 x 260 x 17e-6 degrees per second.
    assert np.median(steps) == pytest.approx(360 * FREQUENCY_HZ * 17e-6, rel=0.02)
    assert np.max(np.abs(steps - np.median(steps))) < 0.1
