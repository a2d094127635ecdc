"""`vibench stop` reaches `vibench measure` between two runs and during a held run, in real time."""

import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from tests.windows_here import sees_locks
from vibench.acquisition import open_recording
from vibench.acquisition.campaign import JournalPointState, read_journal
from vibench.acquisition.engine import Engine, EngineClient, EngineError, EngineState, the_engine
from vibench.acquisition.plan import RunState
from vibench.acquisition.recording import RecordingState, _writer as writer
from vibench.acquisition.run import silence_watch as drive_guard
from vibench.acquisition.stopping.stop import Cause, StopRequest
from vibench.cli.output import ExitCode

RIG = (Path(__file__).resolve().parents[2] / "hardware_configs" / "virtual_rig.toml").read_text()
RUN = """
[[measurements]]
name = "{name}"
ramp_s = {ramp_s}
ramp_step_s = 0.03

[measurements.excitation]
kind = "dwell"
amplitude_vpp = 1.0
frequency_hz = 260
settle_s = 0.1
duration_s = {duration_s}
"""
SILENT_V = 0.02
"""Upper bound of a silent recorded drive: noise and the last step of a ramp."""
LONG_S = 600.0
PATIENCE_S = 60.0
SOON_S = 20.0
"""Much shorter than the time to the next event, and much longer than the start of a command."""

pytestmark = [sees_locks, pytest.mark.usefixtures("own_state")]


@contextmanager
def measuring_program(folder, first_s, rest_s, ramp_s=0.3):
    """Run a campaign of two runs by command, in a separate process."""
    runs = "".join(
        RUN.format(name=name, duration_s=duration_s, ramp_s=ramp_s)
        for name, duration_s in (("first", first_s), ("second", LONG_S))
    )
    (folder / "c.toml").write_text(f'name = "c"\nrest_s = {rest_s}\n{runs}')
    (folder / "rig.toml").write_text(RIG.replace('pace = "free"', 'pace = "wall"'))
    words = ("measure", "c.toml", "--bench", "rig.toml", "--out", "out", "--check", "waived")
    command = [sys.executable, "-m", "vibench.cli", *words]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as program:
        try:
            yield program
        finally:
            program.kill()


def until(program, is_so):
    """Poll the status of the command's engine until a condition holds."""
    give_up_s, clock = time.monotonic() + PATIENCE_S, Event()
    while time.monotonic() < give_up_s and program.poll() is None:
        with suppress(EngineError), EngineClient.attach(the_engine(program.pid).address) as visitor:
            if is_so(visitor.status()):
                return
        clock.wait(0.02)
    program.kill()
    pytest.fail(f"never so: {program.stderr.read().decode()}")


def is_resting(status):
    return any("pausing for" in each.what for each in status.messages)


def is_held(status):
    return status.state is EngineState.HELD


def is_dwelling(status):
    return status.run is not None and status.run.segment == "dwell"


def is_ramping_down(status):
    return status.run is not None and status.run.run_state is RunState.RAMPING_DOWN


def states(folder):
    return [each.state for each in read_journal(folder / "out" / "c.campaign.sqlite")]


@pytest.mark.thorough
@pytest.mark.parametrize("level", ["ramp", pytest.param("off", marks=pytest.mark.thorough)])
def test_a_stop_during_a_cooling_pause_ends_the_campaign(vibench_here, tmp_path, level):
    with measuring_program(tmp_path, first_s=0.2, rest_s=LONG_S) as program:
        until(program, is_resting)
        told = vibench_here("stop", "--level", level, "--reason", "smoke", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        assert program.wait(SOON_S) == ExitCode.STOPPED
        assert program.stderr.read() == b"stopped: smoke. The output is off.\n"
    assert states(tmp_path) == [JournalPointState.DONE, JournalPointState.QUEUED]
    assert not list((tmp_path / "out").glob("second*"))


@pytest.mark.thorough
@pytest.mark.parametrize(
    "level", ["off", *(pytest.param(each, marks=pytest.mark.thorough) for each in ("ramp", "abort"))]
)
def test_stopping_a_held_run_keeps_its_recording_and_ends_in_silence(vibench_here, tmp_path, level):
    with measuring_program(tmp_path, first_s=LONG_S, rest_s=0.0) as program:
        until(program, is_dwelling)
        assert vibench_here("stop", "--level", "hold", cwd=tmp_path).returncode == 0
        until(program, is_held)
        told = vibench_here("stop", "--level", level, "--reason", "smoke", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        assert program.wait(SOON_S) == ExitCode.STOPPED
        assert program.stderr.read() == b"stopped: smoke. The output is off.\n"
    assert states(tmp_path) == [JournalPointState.INTERRUPTED, JournalPointState.QUEUED]
    with open_recording(tmp_path / "out" / "first.h5") as recording:
        assert (recording.state, recording.reason) == (RecordingState.STOPPED, "smoke")
        assert np.max(np.abs(recording.read("drive_voltage", recording.samples - 32))) < SILENT_V


@pytest.mark.thorough
def test_a_stalled_run_is_reported_as_failed(vibench_here, tmp_path, monkeypatch):
    runs = "".join(RUN.format(name=name, duration_s=LONG_S, ramp_s=0.3) for name in ("first", "second"))
    (tmp_path / "c.toml").write_text(f'name = "c"\n{runs}')
    (tmp_path / "f.toml").write_text(
        '[[faults]]\nat_s = 1.0\nfault = "slow_disk"\ndelay_s = 0.2\nfor_s = 9.0\n'
    )
    # A short queue fills before rig time reaches the end of the fault.
    monkeypatch.setattr(writer, "QUEUE_S", 0.5)
    monkeypatch.setattr(drive_guard, "STANDSTILL_BLOCKS", 3)
    words = ("measure", "c.toml", "--out", "out", "--check", "waived", "--faults", "f.toml")
    ended = vibench_here(*words, cwd=tmp_path)
    assert ended.returncode == ExitCode.FAILED
    assert ended.stderr.startswith("error: the run read no samples for")
    assert states(tmp_path) == [JournalPointState.FAILED, JournalPointState.QUEUED]
    with open_recording(tmp_path / "out" / "first.h5") as recording:
        assert recording.state is RecordingState.FAILED
        assert "read no samples" in recording.reason


class StoppedBefore(Engine):
    """A stop switch that is used while the bench opens."""

    def __init__(self, supervision):
        super().__init__(supervision)
        self.switch.ask(StopRequest.of(Cause.KEYBOARD, "SIGINT"))


def test_a_campaign_stopped_during_its_check_is_reported(vibench_here, tmp_path, monkeypatch):
    (tmp_path / "c.toml").write_text(f'name = "c"\n{RUN.format(name="first", duration_s=0.1, ramp_s=0.3)}')
    monkeypatch.setattr("vibench.cli.measure.Engine", StoppedBefore)
    ended = vibench_here("measure", "c.toml", "--out", "out", cwd=tmp_path)
    assert (ended.returncode, ended.stderr) == (ExitCode.STOPPED, "stopped: SIGINT. The output is off.\n")


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to children")
def test_after_a_second_ctrl_c_the_command_states_that_the_output_is_off(tmp_path):
    with measuring_program(tmp_path, first_s=LONG_S, rest_s=0.0, ramp_s=5.0) as program:
        until(program, is_dwelling)
        program.send_signal(signal.SIGINT)
        until(program, is_ramping_down)
        program.send_signal(signal.SIGINT)
        assert program.wait(SOON_S) == 128 + signal.SIGINT
        assert re.fullmatch(rb"stopped: SIGINT: .*\. The output is off\.\n", program.stderr.read())
