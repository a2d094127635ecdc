"""Complete runs: plan, real pyvisa and nidaqmx, simulated instruments, files."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import Dwell, Measurement, RunState, SineSweep, WhiteNoise
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import load_rig
from vibench.acquisition.run.silence_watch import fit_sine

ROOT = Path(__file__).parent.parent.parent.parent
VIRTUAL = ROOT / "hardware_configs" / "virtual_rig.toml"
TERMINAL = load_rig(VIRTUAL).generator.terminal_factor()


@pytest.fixture
def virtual_bench():
    with open_bench(VIRTUAL) as bench:
        yield bench


def record(bench, folder, excitation, **fields):
    """Carry out a plan and return its recording."""
    plan = Measurement(name="run", excitation=excitation, **{"ramp_s": 0.4, "ramp_step_s": 0.02, **fields})
    outcome = run_measurement(bench, plan, folder / "run.h5")
    assert outcome.state is RunState.FINISHED
    return open_recording(outcome.path)


def segment(recording, label):
    found = next(each for each in recording.segments if each.label == label)
    return recording.read("drive_voltage", found.first_sample, found.last_sample + 1)


@pytest.mark.thorough
def test_a_recorded_dwell_has_the_planned_frequency_and_amplitude(virtual_bench, tmp_path):
    dwell = Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.2, duration_s=1)
    with record(virtual_bench, tmp_path, dwell) as recording:
        drive = segment(recording, "dwell")
        rate_hz = recording.sample_rate_hz
    assert len(drive) == rate_hz
    assert fit_sine(drive, 260.0, rate_hz).amplitude == pytest.approx(0.75 * TERMINAL, rel=1e-3)
    # The remaining signal is noise of generator and converter.
    rms = np.sqrt(np.mean(drive**2))
    assert rms == pytest.approx(0.75 * TERMINAL / np.sqrt(2), rel=1e-3)


def test_the_recorded_ramps_rise_and_fall_along_a_half_cosine(virtual_bench, tmp_path):
    dwell = Dwell(amplitude_vpp=1.5, frequency_hz=500, settle_s=0.1, duration_s=0.2)
    with record(virtual_bench, tmp_path, dwell) as recording:
        rate_hz = recording.sample_rate_hz
        up, down = segment(recording, "ramp_up"), segment(recording, "ramp_down")
    stair = round(0.02 * rate_hz)
    expected = 0.75 * TERMINAL * (1 - np.cos(np.pi * np.arange(1, 21) / 20)) / 2
    for ramp, heights in ((up, expected), (down, np.append(expected[-2::-1], 0.0))):
        # The converter's filter delays each step by some 40 samples: omit the beginning of each step.
        settled = ramp.reshape(-1, stair)[:, stair // 8 :]
        levels = [fit_sine(piece, 500.0, rate_hz).amplitude for piece in settled]
        # A ramp begins and ends at the quiet level of 2.5 mVpp.
        np.testing.assert_allclose(levels, heights, atol=2e-3)


@pytest.mark.thorough
def test_recorded_noise_has_a_flat_line_spectrum_in_its_band(virtual_bench, tmp_path):
    noise = WhiteNoise(
        amplitude_vpp=1.0, band_start_hz=20, band_stop_hz=800, realisations=1, periods=1, settle_s=0.2
    )
    with record(virtual_bench, tmp_path, noise) as recording:
        drive = segment(recording, "realisation")
    lines = np.abs(np.fft.rfft(drive))[:2000] * 2 / len(drive)
    inside = lines[20:801]
    values = next(noise.steps()).play.values
    planned = np.sqrt(2 * np.mean(values**2) / 781) * 0.5 * TERMINAL
    assert np.mean(inside) == pytest.approx(planned, rel=0.01)
    # The clocks differ by 17 ppm: in a second the lines shift by 17e-6 cycles per hertz, and the leakage into
    # neighbouring lines is 1.4 % at 800 Hz and 0.3 % at 200 Hz.
    low = lines[20:201]
    assert np.ptp(low) / np.mean(low) < 0.03
    assert np.ptp(inside) / np.mean(inside) < 0.12
    assert np.max(lines[900:]) < 0.02 * np.mean(inside)


@pytest.mark.thorough
def test_a_recorded_sweep_has_as_many_cycles_as_the_ideal_sweep(virtual_bench, tmp_path):
    sweep = SineSweep(amplitude_vpp=1.5, start_hz=150, stop_hz=350, duration_s=2, step_s=0.05, settle_s=0.2)
    with record(virtual_bench, tmp_path, sweep) as recording:
        drive = segment(recording, "sweep")
    rising = np.flatnonzero((drive[:-1] < 0) & (drive[1:] >= 0))
    assert len(rising) == pytest.approx(sweep.cycles(2.0), abs=1)
    assert np.max(np.abs(drive)) == pytest.approx(0.75 * TERMINAL, rel=0.01)


CHILD = """
import sys
from pathlib import Path
from vibench.acquisition import open_bench
from vibench.acquisition.plan import Dwell
from vibench.acquisition.plan import Measurement
from vibench.acquisition import run_measurement
from vibench.acquisition.plan import RunState

told = []

def tell(progress):
    if progress.state is RunState.RECORDING and not told:
        told.append(True)
        print("recording", flush=True)

if __name__ == "__main__":
    plan = Measurement(
        name="run", excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.1, duration_s=2000)
    )
    with open_bench(Path(sys.argv[1])) as bench:
        outcome = run_measurement(bench, plan, Path(sys.argv[2]), on_progress=tell)
    print(outcome.state.value, flush=True)
"""


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM for another process")
def test_a_signal_ends_a_run_with_a_ramp(tmp_path):
    script, path = tmp_path / "child.py", tmp_path / "run.h5"
    script.write_text(CHILD)
    with subprocess.Popen(
        [sys.executable, str(script), str(VIRTUAL), str(path)], stdout=subprocess.PIPE, text=True, cwd=ROOT
    ) as child:
        assert child.stdout.readline() == "recording\n"
        child.send_signal(signal.SIGTERM)
        out, _ = child.communicate(timeout=60)
    assert child.returncode == 0
    assert out == "stopped\n"
    with open_recording(path) as recording:
        assert recording.state is RecordingState.STOPPED
        assert recording.reason.startswith("SIGTERM")
        assert np.max(np.abs(recording.read("drive_voltage", recording.samples - 64))) < 5e-3
