"""`vibench watch` and `vibench stop` find an engine that somebody else has started, and reach it."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Event

import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.engine import EngineState, Supervision, announced_engines, start_engine
from vibench.acquisition.engine._address import EngineAddress
from vibench.acquisition.engine._announcement import announced
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import load_rig

ROOT = Path(__file__).resolve().parents[2]
PAUSE, LOOK_S = Event(), 0.01
DWELL = {"kind": "dwell", "amplitude_vpp": 1.0, "frequency_hz": 260, "settle_s": 0.2, "duration_s": 900}
LONG = Campaign.model_validate({"name": "night", "measurements": [{"name": "dwell", "excitation": DWELL}]})


@pytest.fixture(autouse=True)
def own_state(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path_factory.mktemp("state")))


@pytest.fixture
def running(tmp_path):
    with start_engine(Supervision.UNATTENDED) as engine:
        engine.client.open(load_rig(ROOT / "hardware_configs" / "virtual_rig.toml"))
        wait(engine, EngineState.READY)
        engine.client.arm(LONG, tmp_path)
        engine.client.start()
        while engine.client.status().samples == 0:
            PAUSE.wait(LOOK_S)
        yield engine


def wait(engine, state):
    give_up_s = time.monotonic() + 60
    while engine.client.status().state is not state:
        assert time.monotonic() < give_up_s
        PAUSE.wait(LOOK_S)


def vibench(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "vibench.cli", *arguments],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )


def test_a_run_is_held_released_and_ended_from_another_terminal(running, vibench_here, tmp_path):
    seen = json.loads(vibench("watch", "--json").stdout)["engines"]
    assert [each["pid"] for each in seen] == [running.pid]
    assert seen[0]["status"]["run"]["name"] == "dwell"
    assert "vibench release" in vibench_here("stop", "--level", "hold", cwd=tmp_path).stdout
    wait(running, EngineState.HELD)
    assert "told to go on" in vibench_here("release", cwd=tmp_path).stdout
    wait(running, EngineState.RUNNING)
    told = vibench("stop", "--level", "abort", "--reason", "smoke in the laboratory")
    assert told.returncode == 0, told.stderr
    wait(running, EngineState.READY)
    with open_recording(tmp_path / "dwell.h5") as recording:
        assert recording.reason == "smoke in the laboratory"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_a_stop_of_an_engine_that_stands_still_is_kept_and_said_so(running, tmp_path):
    os.kill(running.pid, signal.SIGSTOP)
    try:
        told = vibench("stop", "--level", "abort", "--reason", "while it stood still")
        assert told.returncode == 1
        assert "lives and does not answer" in told.stderr
        seen = json.loads(vibench("watch", "--json").stdout)["engines"]
        assert [each["pid"] for each in seen] == [running.pid]
        assert "does not answer within" in seen[0]["silence"]
    finally:
        os.kill(running.pid, signal.SIGCONT)
    wait(running, EngineState.READY)
    with open_recording(tmp_path / "dwell.h5") as recording:
        assert recording.reason == "while it stood still"


def test_watching_shows_the_run_and_its_end(running):
    arguments = [sys.executable, "-m", "vibench.cli", "watch"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    with subprocess.Popen(arguments, env=environment, stdout=subprocess.PIPE, text=True) as observer:
        assert f"process {running.pid}" in observer.stdout.readline()
        running.client.stop("ramp", "enough")
        said = observer.stdout.read()
    assert observer.returncode == 0
    assert "dwell" in said


def test_where_no_engine_runs_it_is_said():
    told = vibench("stop")
    assert told.returncode == 1
    assert "no engine is running; 'vibench measure' and 'vibench gui' start one" in told.stderr


def test_what_a_killed_engine_has_left_is_swept_away(tmp_path):
    gone = EngineAddress(host="127.0.0.1", port=1, token="t")
    with announced(gone, "killed"):
        assert announced_engines() == ()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_nobody_else_can_read_the_token(tmp_path):
    state = Path(os.environ["VIBENCH_STATE_DIR"])
    with announced(EngineAddress(host="127.0.0.1", port=1, token="t"), "mine"):
        (file,) = (state / "engines").iterdir()
        assert file.stat().st_mode & 0o077 == 0
