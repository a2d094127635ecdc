"""`vibench watch` and `vibench stop` find and reach an engine that another program has started."""

import json
import os
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from threading import Event

import pytest

from tests.frozen import frozen
from tests.windows_here import sees_locks
from vibench.acquisition import StopSwitch, open_recording, stop_on_signal
from vibench.acquisition.engine import EngineState, StopDelivery, Supervision, start_engine, stop_engine
from vibench.acquisition.engine._client import EngineAddress, announce
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import load_rig
from vibench.acquisition.stopping.program import Program, announced_programs

from .conftest import OWN, ROOT

pytestmark = pytest.mark.usefixtures("own_state")
PAUSE, LOOK_S = Event(), 0.01
DWELL = {"kind": "dwell", "amplitude_vpp": 1.0, "frequency_hz": 260, "settle_s": 0.2, "duration_s": 900}
LONG = Campaign.model_validate({"name": "night", "measurements": [{"name": "dwell", "excitation": DWELL}]})


@pytest.fixture
def running(tmp_path):
    with start_engine(Supervision.UNATTENDED) as engine:
        engine.client.open(load_rig("virtual_rig"))
        wait(engine, EngineState.READY)
        engine.client.arm(LONG, tmp_path)
        engine.client.start()
        while engine.client.status().samples == 0:
            PAUSE.wait(LOOK_S)
        yield engine


def refuse_stop(level, reason):
    raise AssertionError((level, reason))


def wait(engine, state):
    give_up_s = time.monotonic() + 60
    while engine.client.status().state is not state:
        assert time.monotonic() < give_up_s
        PAUSE.wait(LOOK_S)


@pytest.mark.thorough
@sees_locks
def test_a_run_can_be_held_and_released_and_stopped_from_another_terminal(
    running, vibench, vibench_here, tmp_path
):
    seen = json.loads(vibench("watch", "--json", cwd=tmp_path).stdout)["engines"]
    assert [each["pid"] for each in seen] == [running.pid]
    assert seen[0]["status"]["run"]["name"] == "dwell"
    assert "vibench release" in vibench_here("stop", "--level", "hold", cwd=tmp_path).stdout
    wait(running, EngineState.HELD)
    assert "has received the release" in vibench_here("release", cwd=tmp_path).stdout
    wait(running, EngineState.RUNNING)
    told = vibench("stop", "--level", "abort", "--reason", "smoke in the laboratory", cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    wait(running, EngineState.READY)
    with open_recording(tmp_path / "dwell.h5") as recording:
        assert recording.reason == "smoke in the laboratory"


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_a_stop_of_a_stalled_engine_is_kept_and_reported(running, vibench, tmp_path):
    with frozen(running.pid):
        told = vibench("stop", "--level", "abort", "--reason", "while it stood still", cwd=tmp_path)
        assert told.returncode == 1
        assert "runs but does not answer" in told.stderr
        seen = json.loads(vibench("watch", "--json", cwd=tmp_path).stdout)["engines"]
        assert [each["pid"] for each in seen] == [running.pid]
        assert "does not answer within" in seen[0]["silence"]
    wait(running, EngineState.READY)
    with open_recording(tmp_path / "dwell.h5") as recording:
        assert recording.reason == "while it stood still"


@pytest.mark.thorough
def test_the_watch_command_shows_the_run_and_its_end(running):
    arguments = [sys.executable, "-m", "vibench.cli", "watch"]
    with subprocess.Popen(
        arguments, env={**os.environ, **OWN}, stdout=subprocess.PIPE, text=True
    ) as observer:
        assert f"process {running.pid}" in observer.stdout.readline()
        running.client.stop("ramp", "enough")
        said = observer.stdout.read()
    assert observer.returncode == 0
    assert "dwell" in said


@pytest.mark.thorough
def test_the_watch_command_reports_that_no_engine_runs(vibench, tmp_path):
    told = vibench("stop", cwd=tmp_path)
    assert told.returncode == 1
    assert "no engine is running; 'vibench measure' and 'vibench gui' start an engine" in told.stderr
    assert f"Only {os.environ['VIBENCH_STATE_DIR']} was searched" in told.stderr


def test_the_watch_command_reports_an_unwritable_state_folder(vibench_here, tmp_path):
    (tmp_path / "state").write_text("a file")
    told = vibench_here("stop", cwd=tmp_path, environment={"VIBENCH_STATE_DIR": str(tmp_path / "state")})
    assert told.returncode == 1
    assert "the state folder cannot be searched for programs" in told.stderr
    assert "VIBENCH_STATE_DIR" in told.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_only_the_owner_can_read_the_token(tmp_path):
    state = Path(os.environ["VIBENCH_STATE_DIR"])
    with announce(EngineAddress(host="127.0.0.1", port=1, token="t"), "mine", refuse_stop):
        (file,) = (state / "engines").iterdir()
        assert file.stat().st_mode & 0o077 == 0


SCRIPT = """
from pathlib import Path
from vibench.acquisition import open_bench, run_measurement
from vibench.acquisition.plan import Measurement

dwell = {dwell!r}
with open_bench(Path({rig!r})) as bench:
    def progress(stand):
        print("running", flush=True)
    outcome = run_measurement(bench, Measurement.model_validate({{"name": "alone", "excitation": dwell}}),
                              Path("alone.h5"), on_progress=progress)
print(outcome.state)
"""


@sees_locks
class TestWithoutAnEngine:
    """Scripts and checks without an engine are also found while they drive a bench."""

    @pytest.fixture
    def script(self, tmp_path):
        text = SCRIPT.format(dwell=DWELL, rig=str(ROOT / "hardware_configs" / "virtual_rig.toml"))
        with subprocess.Popen(
            [sys.executable, "-c", text], cwd=tmp_path, stdout=subprocess.PIPE, text=True
        ) as script:
            assert script.stdout.readline() == "running\n"
            yield script
            script.kill()

    @pytest.mark.thorough
    def test_a_user_script_is_found_by_watch_and_stopped(self, script, vibench_here, tmp_path):
        listed = json.loads(vibench_here("watch", "--json", cwd=tmp_path).stdout)
        assert listed["engines"] == []
        assert [(each["pid"], each["what"]) for each in listed["programs"]] == [(script.pid, "alone")]
        told = vibench_here("stop", "--level", "abort", "--reason", "from elsewhere", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        assert f"alone, process {script.pid}, has carried out the stop (abort)" in told.stdout
        said = script.communicate(timeout=60)[0]
        assert said.splitlines()[-1].startswith("stopped")
        with open_recording(tmp_path / "alone.h5") as recording:
            assert recording.reason == "from elsewhere"
        assert list((Path(os.environ["VIBENCH_STATE_DIR"]) / "engines").glob("*.json")) == []

    @pytest.mark.thorough
    def test_engine_commands_are_refused_for_other_programs(self, script, vibench_here, tmp_path):
        held = vibench_here("stop", "--level", "hold", cwd=tmp_path)
        assert held.returncode == 1
        assert "is not an engine and cannot be held" in held.stderr
        watched = vibench_here("watch", cwd=tmp_path)
        assert watched.returncode == 1
        assert f"{script.pid} (alone) drives a bench without an engine" in watched.stderr

    @pytest.mark.thorough
    def test_the_stop_command_stops_a_bench_check(self, vibench_here, tmp_path):
        rig = (ROOT / "hardware_configs" / "virtual_rig.toml").read_text().replace('"free"', '"wall"')
        (tmp_path / "wall.toml").write_text(rig)
        words = [sys.executable, "-m", "vibench.cli", "bench", "check", "--bench", "wall.toml"]
        with subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as check:
            while "bench check" not in vibench_here("watch", "--json", cwd=tmp_path).stdout:
                assert check.poll() is None
                PAUSE.wait(LOOK_S)
            told = vibench_here("stop", "--level", "off", "--reason", "enough", cwd=tmp_path)
            assert told.returncode == 0, told.stderr
            assert "enough" in check.communicate(timeout=60)[1]
        assert check.returncode == 3


def test_a_stop_reaches_both_of_two_runs_in_one_process(tmp_path):
    first, second = StopSwitch(), StopSwitch()
    with stop_on_signal(first, "first"), stop_on_signal(second, "second"):
        (program,) = announced_programs(Program)
        assert program.what == "first"
        assert stop_engine(program, "abort", "both") is StopDelivery.TAKEN
    assert (first.request.reason, second.request.reason) == ("both", "both")
    assert announced_programs(Program) == ()


def test_a_program_stays_announced_until_its_last_run_ends(tmp_path):
    with ExitStack() as first:
        first.enter_context(stop_on_signal(StopSwitch(), "first"))
        second = first.enter_context(ExitStack())
        second.enter_context(stop_on_signal(StopSwitch(), "second"))
        staying = second.pop_all()
    with staying:
        assert [each.what for each in announced_programs(Program)] == ["second"]
    assert announced_programs(Program) == ()
