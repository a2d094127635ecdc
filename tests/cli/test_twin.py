"""`vibench twin` beside a real engine in real time reports p and does not delay the run."""

import os
import signal
import time
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import pytest

from tests.full_disk import full_disk
from vibench.acquisition import open_recording
from vibench.acquisition.check.admission import CheckRule
from vibench.acquisition.engine import (
    DRIVING,
    CampaignRequest,
    EngineState,
    Supervision,
    TwinSwitch,
    start_engine,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import load_rig, specimen_of, with_faults
from vibench.analysis.hidden_motion import ChangeWatch, Hidden, KnownNumber, Level
from vibench.cli.twin import _Following

ROOT = Path(__file__).resolve().parents[2]
PAUSE, LOOK_S, PATIENCE_S = Event(), 0.02, 200.0
STOPPING = {"on_changed_specimen": "stop"}


def campaign(limits, duration_s=600.0):
    dwell = {"kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "duration_s": duration_s}
    dwell["settle_s"] = 0.2
    one = {"name": "dwell", "ramp_s": 0.3, "excitation": dwell, "limits": limits}
    return Campaign.model_validate({"name": "twins", "measurements": [one]})


@pytest.fixture
def running(tmp_path, monkeypatch):
    """Return a function that starts an engine with a rig in real time, and a campaign on it."""
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    rig = load_rig("virtual_rig")
    rig = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": "wall"})})
    with start_engine(Supervision.UNATTENDED) as engine:

        def start(plan, faults=None, **how):
            engine.client.open(rig if faults is None else with_faults(rig, faults))
            until(engine.client, lambda status: status.state is EngineState.READY)
            request = CampaignRequest(campaign=plan, folder=tmp_path, check=CheckRule.WAIVED, **how)
            engine.client.arm_request(request)
            engine.client.start()
            return engine.client

        yield start


def until(client, is_so):
    give_up_s = time.monotonic() + PATIENCE_S
    while not is_so(status := client.status()):
        assert time.monotonic() < give_up_s, status
        PAUSE.wait(LOOK_S)
    return status


def is_tracked(status):
    return status.twin is not None and status.twin.state == "tracked" and status.twin.level is not None


def events_and_gaps(tmp_path):
    with open_recording(tmp_path / "dwell.h5") as recording:
        return [(each.kind, each.text) for each in recording.events], recording.gaps


@pytest.mark.thorough
def test_the_live_twin_reports_hidden_motion_and_a_change_ends_the_run_if_the_plan_says_so(running, tmp_path):
    client = running(campaign(STOPPING))
    told = until(client, is_tracked).twin
    assert told.stops_m == pytest.approx((-45e-6, 45e-6), rel=1e-2)
    shown = [each for each in told.p_m if each is not None]
    assert len(shown) > 100
    assert max(map(abs, shown)) < 48e-6
    assert told.step_s * len(told.p_m) == pytest.approx(0.05, rel=0.1)
    # A twin may be ended and started again while the measurement continues.
    client.turn_twin(TwinSwitch.OFF)
    assert client.status().twin is None
    until(client, lambda status: status.samples > told.end_sample + 51_200)
    client.note_change("The specimen is not what it was.")
    status = until(client, lambda status: status.state not in DRIVING)
    assert [each.state for each in status.rows] == ["failed"]
    assert "as on_changed_specimen requires" in status.rows[0].reason
    events, gaps = events_and_gaps(tmp_path)
    assert ("specimen", "The specimen is not what it was.") in events
    assert "limit" in dict(events)
    assert gaps == ()


@pytest.mark.thorough
def test_the_live_twin_waits_while_a_scan_measures_another_mass(running):
    """The samples are then those of m2, which would look like another specimen if taken for m0."""
    point = {"name": "tip", "body": "m2", "x_m": 0.0, "y_m": 0.0, "z_m": 0.04}
    plan = campaign({}).model_dump(mode="json") | {"scan": [point]}
    client = running(Campaign.model_validate(plan), twin=TwinSwitch.ON)
    until(client, lambda status: status.twin is not None and status.twin.pid > 0 and status.samples > 0)
    began = client.status().samples
    status = until(client, lambda status: status.samples > began + 3 * 51_200)
    assert [each.role for each in status.bench.channels][-1] == "m2_velocity"
    assert status.twin.state == "waiting"


@pytest.mark.thorough
def test_a_killed_twin_is_reported_and_the_run_continues(running, tmp_path):
    client = running(campaign({}), twin=TwinSwitch.ON)
    pid = until(client, lambda status: status.twin is not None and status.twin.pid > 0).twin.pid
    os.kill(pid, signal.SIGKILL)
    status = until(client, lambda status: status.twin is None)
    assert "live twin has ended" in status.messages[-1].what
    before = status.samples
    until(client, lambda status: status.samples > before + 10_000)
    client.note_change("The upper gap is 46 um.")
    client.stop("abort", "enough")
    until(client, lambda status: status.state not in DRIVING)
    events, gaps = events_and_gaps(tmp_path)
    assert ("specimen", "The upper gap is 46 um.") in events
    assert "limit" not in dict(events)
    assert gaps == ()


def test_a_twin_reports_a_baseline_that_cannot_be_stored_and_continues(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    rig = load_rig("virtual_rig")
    known = {Hidden.M1: KnownNumber(value=2.1e-3, low=2.0e-3, high=2.2e-3)}
    live = SimpleNamespace(watch=ChangeWatch(Level(mean=1.0, sd=0.1)), numbers=known)
    following = _Following(None, rig, specimen_of(rig), live, (0, 1), plan="dwell")
    with full_disk():
        following._keep_baseline()
    (said,) = "".join(capsys.readouterr().err.split("\n")).split("warning: ")[1:]
    assert "could not be written (File too large)" in said
    assert not [each for each in tmp_path.rglob("*") if each.is_file()]
