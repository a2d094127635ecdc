"""Scans: moving the beam, the scan point in each recording, and points that are refused or resumed."""

import json
import shlex
import sys
from typing import ClassVar

import h5py
import numpy as np
import pytest

from vibench.acquisition import (
    ConfigurationError,
    RecordingError,
    StopSwitch,
    open_bench,
    open_recording,
    run_campaign,
    shipped,
    validate,
)
from vibench.acquisition.campaign import (
    CampaignEventKind,
    CommandMessenger,
    PointOutcome,
    ReasonCode,
    ReconnectingBench,
    estimate_campaign,
    read_journal,
)
from vibench.acquisition.campaign._journal import journal_path
from vibench.acquisition.plan import Campaign
from vibench.acquisition.recording import SealDepth, SealState
from vibench.acquisition.rig import Role, TransducerConfig, confirm_simulated, load_rig
from vibench.acquisition.stopping.stop import DRIVES_ON, Cause, StopRequest
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS
from vibench.virtual_rig import VirtualRig

STATES = {"m0": "vx", "m1": "vy", "m2": "vz"}
pytestmark = [pytest.mark.thorough, pytest.mark.timeout(300)]
PLACES = {"top": "m2", "low": "m0", "side": "m1", "end": "m2"}


def scan(**others):
    points = [
        {"name": name, "body": body, "x_m": 0.01 * number, "y_m": -0.5, "z_m": 0.0}
        for number, (name, body) in enumerate(PLACES.items())
    ]
    excitation = {"kind": "dwell", "amplitude_vpp": 0.3, "frequency_hz": 150, "settle_s": 0.2}
    plan = {"ramp_s": 0.3, "ramp_step_s": 0.03, "excitation": {**excitation, "duration_s": 0.3}}
    content = {"name": "c", "scan": points, "measurements": [{"name": "dwell", **plan}], **others}
    return validate(content, Campaign, "c.toml")


@pytest.fixture
def coarse(rig):
    return rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"grid_rate_hz": 25_600.0})})


@pytest.fixture
def kept(coarse):
    with ReconnectingBench(coarse) as opened:
        yield opened


def outcomes(point_results):
    return [(each.name, each.outcome) for each in point_results]


ALL = [(f"dwell-{name}", PointOutcome.RECORDED) for name in PLACES]


def test_each_scan_recording_states_its_point_and_contains_the_motion_of_a_mass_at_that_point(kept, tmp_path):
    world = kept._power._virtual.world
    world.keep_truth()
    velocities = {}

    def handle_event(event):
        if event.kind is CampaignEventKind.POINT_DONE:
            truth = world.truth()[: -round(0.35 * 25_600)][-round(0.2 * 25_600) :]
            columns = dict(zip(MOTION_COLUMNS, np.ptp(truth, axis=0), strict=True))
            velocities[event.facts["point"]] = columns

    assert outcomes(run_campaign(kept.bench, scan(), tmp_path, on_event=handle_event)) == ALL
    for number, (name, body) in enumerate(PLACES.items()):
        path = tmp_path / f"dwell-{name}.h5"
        with open_recording(path) as recording:
            assert f"{body}_velocity" in recording.roles
            assert recording.bench["daq"]["channels"][3]["role"] == f"{body}_velocity"
            dwell = next(each for each in recording.segments if each.label == "dwell")
            seen = np.ptp(recording.read(f"{body}_velocity", dwell.first_sample, dwell.last_sample))
        with h5py.File(path) as file:
            assert {key: file.attrs[f"point_{key}"] for key in ("name", "body", "node", "x_m", "y_m")} == {
                "name": name.encode(),
                "body": body.encode(),
                "node": number + 1,
                "x_m": pytest.approx(0.01 * number),
                "y_m": -0.5,
            }
        moved = velocities[f"dwell-{name}"]
        assert seen == pytest.approx(moved[STATES[body]], rel=0.02), moved
    assert world._beam is Role.M0_VELOCITY


def test_the_seal_covers_the_scan_coordinates(kept, tmp_path):
    run_campaign(kept.bench, scan(), tmp_path)
    with open_recording(tmp_path / "dwell-side.h5") as recording:
        assert recording.check_seal(SealDepth.WHOLE).state is SealState.INTACT
    with h5py.File(tmp_path / "dwell-side.h5", "a") as file:
        file.attrs["point_x_m"] = 0.03
    with pytest.raises(RecordingError, match="was changed after its seal had been checked"):
        open_recording(tmp_path / "dwell-side.h5")


@pytest.mark.parametrize("journal", ["kept", "lost"])
def test_a_scan_stopped_at_its_third_point_resumes_at_that_point(coarse, tmp_path, journal):
    switch = StopSwitch()

    def stop_at_third_point(progress):
        if progress.name == "dwell-side":
            switch.ask(StopRequest.of(Cause.OPERATOR, "stopped"))

    with ReconnectingBench(coarse) as kept:
        first = run_campaign(kept.bench, scan(), tmp_path, on_progress=stop_at_third_point, switch=switch)
    assert outcomes(first)[-1] == ("dwell-side", PointOutcome.STOPPED)
    if journal == "lost":
        journal_path(tmp_path, "c").unlink()
    with ReconnectingBench(coarse) as kept:
        again = run_campaign(kept.bench, scan(), tmp_path, "resume")
    assert outcomes(again) == [
        ("dwell-top", PointOutcome.KEPT),
        ("dwell-low", PointOutcome.KEPT),
        *ALL[2:],
    ]
    with open_recording(tmp_path / "dwell-side.2.h5") as recording:
        assert "m1_velocity" in recording.roles


MOVER = """
import json, pathlib, sys
point = json.load(sys.stdin)
with pathlib.Path(sys.argv[1]).open("a") as log:
    log.write(json.dumps({**point, "said": sys.argv[2]}) + "\\n")
sys.exit(3 if point["name"] == "low" else 0)
"""


class DriveWatcher(CommandMessenger):
    """A command that also notes whether a drive was on when it ran."""

    driven: ClassVar = []

    def run(self, document, longest_s):
        self.driven.append(bool(DRIVES_ON))
        return super().run(document, longest_s)


def test_the_move_command_runs_with_the_drive_off_and_may_refuse_a_point(kept, tmp_path):
    script, log = tmp_path / "move.py", tmp_path / "moves.jsonl"
    script.write_text(MOVER)
    command = DriveWatcher.of(shlex.join([sys.executable, str(script), str(log), "$HOME; no shell"]))
    twice = [
        {"name": name, **scan().measurements[0].model_dump(mode="json", exclude={"name"})} for name in "ab"
    ]
    found = run_campaign(
        kept.bench,
        scan(measurements=twice),
        tmp_path / "out",
        after_failure="go_on",
        move_beam=command,
    )
    refused = [each for each in found if each.outcome is PointOutcome.FAILED]
    assert [each.name for each in refused] == ["a-low", "b-low"]
    assert refused[0].reason_code is ReasonCode.FAULT
    assert refused[0].reason.startswith("the beam was not moved to low on m0 (x 0.01, y -0.5, z 0 m): ")
    assert "ended with 3. Nothing was played there; correct the command" in refused[0].reason
    assert not (tmp_path / "out/a-low.h5").exists()
    moves = [json.loads(line) for line in log.read_text().splitlines()]
    assert [each["recording"] for each in moves] == ["a-top", "a-low", "b-low", "a-side", "a-end"]
    assert moves[0] == {
        "recording": "a-top",
        "name": "top",
        "body": "m2",
        "node": 1,
        "x_m": 0.0,
        "y_m": -0.5,
        "z_m": 0.0,
        "direction": "z",
        "said": "$HOME; no shell",
    }
    assert command.driven == [False] * 5
    log.unlink()
    script.write_text(MOVER.replace('== "low"', '== "none"'))
    again = run_campaign(kept.bench, scan(measurements=twice), tmp_path / "out", "resume", move_beam=command)
    assert [each.name for each in again if each.outcome is PointOutcome.RECORDED] == ["a-low", "b-low"]
    assert len(log.read_text().splitlines()) == 1


def test_a_scan_without_a_move_command_waits_for_the_operator(coarse, tmp_path):
    """Another program serves the rig, so the campaign cannot move the beam by itself."""
    asked, switch = [], StopSwitch()
    with VirtualRig(coarse) as virtual:
        real = coarse.model_copy(
            update={
                "virtual": None,
                "daq": coarse.daq.model_copy(update={"server": virtual.daq_address}),
                "generator": coarse.generator.model_copy(update={"resource": virtual.socket_resource}),
            }
        )

        def handle_event(event):
            if event.kind is CampaignEventKind.MOVE_BEAM:
                asked.append(event.text)
                assert switch.is_holding
                assert not DRIVES_ON
                if event.facts["point"] == "side":
                    switch.ask(StopRequest.of(Cause.OPERATOR, "enough"))
                    return
                virtual.aim(Role(f"{PLACES[event.facts['point']]}_velocity"))
                switch.resume()

        with open_bench(real, confirm_simulated, "waived") as bench:
            found = run_campaign(bench, scan(), tmp_path, switch=switch, on_event=handle_event)
    assert outcomes(found) == ALL[:2]
    assert asked[0] == (
        "move the beam to top on m2 (x 0, y -0.5, z 0 m), then run 'vibench release' or press 'Go on'"
    )
    assert len(asked) == 3
    assert [each.state.value for each in read_journal(journal_path(tmp_path, "c"))][2:] == ["queued"] * 2
    assert asked[0] in (tmp_path / "c.status").read_text()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("no vibrometer", r"the rig .* has no channel m0_velocity\. Nothing was played"),
        ("sensor on m2", r"a point on m2, but the rig .* records m2_velocity with another sensor"),
    ],
)
def test_a_point_that_the_rig_cannot_reach_is_refused(coarse, tmp_path, change, sentence):
    rig = coarse
    if change == "no vibrometer":
        rig = load_rig(shipped("hardware_configs/virtual_rig_accelerometers.toml"))
    else:
        sensor = TransducerConfig(
            model="probe", sensitivity="4 V/(m/s)", full_scale_v=4, calibrated="2026-02-10"
        )
        last = rig.daq.channels[1].model_copy(update={"role": Role.M2_VELOCITY})
        channels = (rig.daq.channels[0], last, *rig.daq.channels[2:])
        daq = rig.daq.model_copy(update={"channels": channels})
        rig = rig.model_copy(update={"sensors": {Role.M2_VELOCITY: sensor}, "daq": daq})
    with pytest.raises(ConfigurationError, match=sentence):
        estimate_campaign(scan(), rig, tmp_path)
    with open_bench(rig) as bench, pytest.raises(ConfigurationError, match=sentence):
        run_campaign(bench, scan(), tmp_path)
    assert not list(tmp_path.iterdir())
