"""`vibench stop` reaches `vibench measure` between two runs, and while one is held, at the wall's pace."""

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
from vibench.acquisition.engine import EngineClient, EngineError, EngineState, the_engine
from vibench.acquisition.recording import RecordingState
from vibench.cli.exit_code import ExitCode

RIG = (Path(__file__).resolve().parents[2] / "hardware_configs" / "virtual_rig.toml").read_text()
RUN = """
[[measurements]]
name = "{name}"
ramp_s = 0.3
ramp_step_s = 0.03

[measurements.excitation]
kind = "dwell"
amplitude_vpp = 1.0
frequency_hz = 260
settle_s = 0.1
duration_s = {duration_s}
"""
SILENT_V = 0.02
"""Of the recorded drive: its noise, and the last stair of a ramp."""
LONG_S = 600.0
PATIENCE_S = 60.0
SOON_S = 20.0
"""Far below what would have come next, and far above what a command takes to start."""

pytestmark = sees_locks


@pytest.fixture(autouse=True)
def own_state(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path_factory.mktemp("state")))


@contextmanager
def measuring(folder, first_s, rest_s):
    """Let a campaign of two runs be measured by a command of its own."""
    runs = RUN.format(name="first", duration_s=first_s) + RUN.format(name="second", duration_s=LONG_S)
    (folder / "c.toml").write_text(f'name = "c"\nrest_s = {rest_s}\n{runs}')
    (folder / "rig.toml").write_text(RIG.replace('pace = "free"', 'pace = "wall"'))
    words = ("measure", "c.toml", "--bench", "rig.toml", "--out", "out", "--check", "waived")
    command = [sys.executable, "-m", "vibench.cli", *words]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as program:
        try:
            yield program
        finally:
            program.kill()


def until(program, is_so):
    """Look at the command's engine until something is so."""
    give_up_s, clock = time.monotonic() + PATIENCE_S, Event()
    while time.monotonic() < give_up_s and program.poll() is None:
        with suppress(EngineError), EngineClient.attach(the_engine(program.pid).address) as visitor:
            if is_so(visitor.status()):
                return
        clock.wait(0.02)
    program.kill()
    pytest.fail(f"never so: {program.stdout.read().decode()}")


def rests(status):
    return any("resting for" in each.what for each in status.messages)


def is_held(status):
    return status.state is EngineState.HELD


def dwells(status):
    return status.run is not None and status.run.segment == "dwell"


def states(folder):
    return [each.state for each in read_journal(folder / "out" / "c.campaign.sqlite")]


@pytest.mark.parametrize("level", ["ramp", pytest.param("off", marks=pytest.mark.thorough)])
def test_a_stop_while_the_rig_cools_ends_the_campaign(vibench_here, tmp_path, level):
    with measuring(tmp_path, first_s=0.2, rest_s=LONG_S) as program:
        until(program, rests)
        told = vibench_here("stop", "--level", level, cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        assert program.wait(SOON_S) == ExitCode.STOPPED
    assert states(tmp_path) == [JournalPointState.DONE, JournalPointState.QUEUED]
    assert not list((tmp_path / "out").glob("second*"))


@pytest.mark.parametrize(
    "level", ["off", *(pytest.param(each, marks=pytest.mark.thorough) for each in ("ramp", "abort"))]
)
def test_a_stop_of_a_held_run_keeps_it_and_ends_silent(vibench_here, tmp_path, level):
    with measuring(tmp_path, first_s=LONG_S, rest_s=0.0) as program:
        until(program, dwells)
        assert vibench_here("stop", "--level", "hold", cwd=tmp_path).returncode == 0
        until(program, is_held)
        told = vibench_here("stop", "--level", level, "--reason", "smoke", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        assert program.wait(SOON_S) == ExitCode.STOPPED
    assert states(tmp_path) == [JournalPointState.INTERRUPTED, JournalPointState.QUEUED]
    with open_recording(tmp_path / "out" / "first.h5") as recording:
        assert (recording.state, recording.reason) == (RecordingState.STOPPED, "smoke")
        assert np.max(np.abs(recording.read("drive_voltage", recording.samples - 32))) < SILENT_V
