"""Faults while an output streams: one clear error, silence, and a kept recording with the reason.

Silence is checked at the amplifier's input in the simulated world, while the output's task continues: the
state of a driver does not count.
"""

import signal

import numpy as np
import pytest

from vibench.acquisition import (
    InstrumentError,
    InstrumentLost,
    RecordingError,
    open_recording,
    run_measurement,
)
from vibench.acquisition.errors import DataLost
from vibench.acquisition.plan import Measurement, RunState, StreamedNoise
from vibench.acquisition.recording import RecordingState, create_recording
from vibench.acquisition.rig import load_rig
from vibench.virtual_rig.world.conversion import Coupling, Input

from .ending_silent import bench_on, kept_drive, when_recording

try:
    import resource
except ModuleNotFoundError:  # Windows has no limit on the size of files
    resource = None

FULL_BYTES = 1_000_000
AMPLITUDE_VPP = 4.0
PLAN = Measurement(
    name="run",
    excitation=StreamedNoise(
        amplitude_vpp=AMPLITUDE_VPP, band_start_hz=50, band_stop_hz=600, settle_s=0.2, duration_s=3, seed=5
    ),
    ramp_s=0.3,
    ramp_step_s=0.03,
)
RATE_HZ = 51_200.0
SILENT_V = 1e-3
"""About fifty times the converter's noise, and 1/400 of the rms of the drive."""


@pytest.fixture
def rig():
    return load_rig("virtual_rig_streaming")


def advance(virtual, duration_s):
    """Advance rig time, together with all running tasks."""
    rig = virtual._running_state.daq._rig
    with rig.changed:
        rig.advance_to(rig.now_s + duration_s)


def amplifier_input_v(virtual, duration_s=0.1):
    """Return the largest voltage at the amplifier's input from now on, measured by a separate probe."""
    probe = virtual.world.sample((Input("Dev1/ai0", 10.0, Coupling.DC),), RATE_HZ)
    advance(virtual, duration_s)
    heard = probe.read(round(duration_s * RATE_HZ))
    probe.close()
    # The first samples contain the past because of the converter's filter.
    return float(np.max(np.abs(heard[0, 100:])))


def one_sentence(failure):
    """Return the text of an error, which must be a single line."""
    text = str(failure.value)
    assert "\n" not in text
    return text


@pytest.mark.thorough
def test_a_long_pause_of_the_computer_empties_the_output_buffer_and_ends_in_silence(laboratory, tmp_path):
    virtual, connected = laboratory()
    pause = when_recording(lambda: advance(virtual, 1.0))
    with bench_on(connected) as bench:
        with pytest.raises(DataLost, match=r"ran out of samples.*To do: write further ahead") as failure:
            run_measurement(bench, PLAN, tmp_path / "run.h5", on_progress=pause)
        assert amplifier_input_v(virtual) < SILENT_V
    one_sentence(failure)
    kept_drive(tmp_path / "run.h5", RecordingState.FAILED, "DataLost.*ran out of samples")


def test_after_the_death_of_the_server_at_most_the_written_samples_are_played(laboratory, tmp_path):
    virtual, connected = laboratory()
    die = when_recording(virtual.faults.lose_daq_server)
    with pytest.raises(InstrumentLost, match="MAY STILL BE PLAYING") as failure, bench_on(connected) as bench:
        run_measurement(bench, PLAN, tmp_path / "run.h5", on_progress=die)
    assert "at most 0.5 s" in one_sentence(failure)
    assert "switch the amplifier off" in str(failure.value)
    # The message is true: the output continues and nobody can stop it until its samples run out.
    assert amplifier_input_v(virtual) > 0.1
    advance(virtual, 0.5)
    assert amplifier_input_v(virtual) < SILENT_V
    kept_drive(tmp_path / "run.h5", RecordingState.FAILED, "InstrumentLost.*MAY STILL BE PLAYING")


@pytest.mark.parametrize(("code", "kind"), [(-200361, DataLost), (-200284, InstrumentError)])
def test_a_failing_input_fades_the_output_out(laboratory, tmp_path, code, kind):
    virtual, connected = laboratory()
    fail = when_recording(lambda: virtual.faults.fail_daq("ReadAnalogF64", code))
    with bench_on(connected) as bench:
        with pytest.raises(kind) as failure:
            run_measurement(bench, PLAN, tmp_path / "run.h5", on_progress=fail)
        virtual.faults.heal()
        assert amplifier_input_v(virtual) < SILENT_V
    one_sentence(failure)
    kept_drive(tmp_path / "run.h5", RecordingState.FAILED, kind.__name__)


def test_after_ctrl_c_the_written_samples_and_a_ramp_are_played_before_silence(laboratory, tmp_path):
    virtual, connected = laboratory()
    elapsed_s = []

    def watch(progress):
        if progress.state is RunState.RECORDING and not elapsed_s:
            elapsed_s.append(progress.elapsed_s)
            signal.raise_signal(signal.SIGINT)

    with bench_on(connected) as bench:
        outcome = run_measurement(bench, PLAN, tmp_path / "run.h5", on_progress=watch)
        assert amplifier_input_v(virtual) < SILENT_V
    assert outcome.state is RunState.STOPPED
    drive = kept_drive(tmp_path / "run.h5", RecordingState.STOPPED, "^SIGINT: stopped")
    assert drive.size / RATE_HZ - elapsed_s[0] <= 0.5 + 0.3 + 0.1 + 1e-3
    assert np.max(np.abs(drive[-200:])) < 0.01


def test_after_a_second_ctrl_c_the_ramp_is_skipped_and_the_output_is_silent(laboratory, tmp_path):
    virtual, connected = laboratory()
    insist = when_recording(lambda: [signal.raise_signal(signal.SIGINT) for _ in range(2)])
    with bench_on(connected) as bench:
        with pytest.raises(KeyboardInterrupt):
            run_measurement(bench, PLAN, tmp_path / "run.h5", on_progress=insist)
        assert amplifier_input_v(virtual) < SILENT_V
    kept_drive(tmp_path / "run.h5", RecordingState.STOPPED, "abandoned|keyboard")


class FillingDisk:
    """A recording whose disk is full after the first commit, and has room again at the end."""

    def __init__(self, path, header):
        self._writer = create_recording(path, header)
        self._unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
        self.log = self._writer.log
        self.begin_segment = self._writer.begin_segment
        self.end_segment = self._writer.end_segment

    def append(self, block):
        if self._writer.committed_samples > 0:
            resource.setrlimit(resource.RLIMIT_FSIZE, (FULL_BYTES, self._unlimited[1]))
        self._writer.append(block)

    def finish(self, state, reason=""):
        resource.setrlimit(resource.RLIMIT_FSIZE, self._unlimited)
        return self._writer.finish(state, reason)


@pytest.mark.thorough
@pytest.mark.skipif(resource is None, reason="limits on file size exist on POSIX only")
def test_a_full_disk_fades_the_output_out_and_keeps_the_recording(laboratory, tmp_path):
    virtual, connected = laboratory()
    long = PLAN.model_copy(update={"excitation": PLAN.excitation.model_copy(update={"duration_s": 120})})
    with bench_on(connected) as bench:
        with pytest.raises(RecordingError, match="Writing to the disk failed") as failure:
            run_measurement(bench, long, tmp_path / "run.h5", create=FillingDisk)
        assert amplifier_input_v(virtual) < SILENT_V
    one_sentence(failure)
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.state is RecordingState.FAILED
        assert "Writing to the disk failed" in recording.reason
        assert recording.samples > 0


def test_leaving_the_with_block_of_a_bench_silences_a_playing_output(laboratory):
    virtual, connected = laboratory()
    with bench_on(connected) as bench:
        bench.output.write(np.full(25_600, 1.0))
        bench.output.arm()
        bench.digitizer.start()
        bench.digitizer.read(5120)
        assert amplifier_input_v(virtual) == pytest.approx(1.0, rel=0.01)
    assert amplifier_input_v(virtual) < SILENT_V
