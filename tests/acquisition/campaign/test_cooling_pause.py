"""Cooling pauses between recordings: duration, silence, stops, holds and kills."""

import shutil
from datetime import timedelta
from time import monotonic

import pytest

from vibench.acquisition import ConfigurationError, StopSwitch, run_campaign, validate
from vibench.acquisition.campaign import (
    CampaignEventKind,
    ExistingRecordings,
    ReconnectingBench,
    estimate_campaign,
)
from vibench.acquisition.campaign._run_campaign import LOOK_EVERY_S
from vibench.acquisition.errors import DataLost
from vibench.acquisition.plan import Campaign
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .small_campaigns import campaign, fail_one_read, outcomes, points, states

REST_S = 12.0


@pytest.mark.thorough
def test_the_rig_is_silent_between_recordings(rig, tmp_path):
    coarse = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"grid_rate_hz": 25_600.0})})
    with ReconnectingBench(coarse) as kept:
        world = kept._power._virtual.world
        began_s, loudest_v = [], []

        def record_event(event):
            match event.kind:
                case CampaignEventKind.RESTING:
                    world.keep_truth()
                    began_s.append(world.time_s)
                case CampaignEventKind.POINT_BEGUN if began_s:
                    assert world.time_s - began_s[-1] == pytest.approx(REST_S, abs=1e-3)
                    loudest_v.append(abs(world.truth()[-1000:, 1]).max())

        begun = monotonic()
        point_results = run_campaign(
            kept.bench, campaign("one", "two", rest_s=REST_S), tmp_path, on_event=record_event
        )
        assert monotonic() - begun < REST_S
    assert outcomes(point_results) == [("one", "recorded"), ("two", "recorded")]
    assert len(began_s) == 1
    assert max(loudest_v) < 1e-4  # velocity of the table [m/s]: noise of the amplifier
    told = (tmp_path / "c.status").read_text()
    assert "pausing for 12 s before two" in told


def test_cooling_pauses_are_part_of_the_planned_and_the_estimated_duration(rig, tmp_path):
    with_rest, without = campaign("one", "two", "three", rest_s=REST_S), campaign("one", "two", "three")
    assert with_rest.duration_s - without.duration_s == pytest.approx(2 * REST_S)
    assert with_rest.size_bytes(5120, 4) == without.size_bytes(5120, 4)
    expected = estimate_campaign(with_rest, rig, tmp_path)
    assert expected.rest_s == pytest.approx(2 * REST_S)
    assert expected.duration_s == pytest.approx(
        estimate_campaign(without, rig, tmp_path).duration_s + 2 * REST_S
    )


def test_a_stop_ends_a_cooling_pause(bench, tmp_path):
    switch = StopSwitch()
    idle = bench.idle

    def idle_and_stop(duration_s):
        idle(duration_s)
        if bench.idled_s > 5.0:
            switch.ask(StopRequest.of(Cause.OPERATOR, "enough"))

    bench.idle = idle_and_stop
    point_results = run_campaign(bench, campaign("one", "two", rest_s=REST_S), tmp_path, switch=switch)
    assert bench.idled_s == pytest.approx(5.1, abs=0.05)
    assert [point_result.name for point_result in point_results] == ["one"]
    assert states(tmp_path) == ["done", "queued"]


def test_a_hold_extends_a_cooling_pause_until_the_hold_is_released(bench, tmp_path):
    switch = StopSwitch()
    idle = bench.idle

    def idle_and_press(duration_s):
        idle(duration_s)
        switch.hold() if bench.idled_s < 2 * REST_S else switch.resume()

    bench.idle = idle_and_press
    point_results = run_campaign(bench, campaign("one", "two", rest_s=REST_S), tmp_path, switch=switch)
    assert bench.idled_s == pytest.approx(2 * REST_S, abs=0.2)
    assert outcomes(point_results) == [("one", "recorded"), ("two", "recorded")]


@pytest.mark.thorough
def test_a_campaign_killed_in_a_cooling_pause_continues_at_the_next_point(bench, new_bench, rig, tmp_path):
    def as_left_by_a_kill(event):
        if event.kind is CampaignEventKind.RESTING:
            # A killed process leaves the files as they are now, including the write-ahead log of the journal.
            shutil.copytree(tmp_path / "out", tmp_path / "killed", dirs_exist_ok=True)

    plan = campaign("one", "two", rest_s=REST_S)
    run_campaign(bench, plan, tmp_path / "out", on_event=as_left_by_a_kill)
    killed = tmp_path / "killed"
    assert [(point.state.value, point.attempts) for point in points(killed)] == [("done", 1), ("queued", 0)]
    fresh = new_bench(rig)
    point_results = run_campaign(fresh, plan, killed, ExistingRecordings.RESUME)
    assert outcomes(point_results) == [("one", "kept"), ("two", "recorded")]
    assert fresh.idled_s == 0.0  # nothing has been played in this session


def test_a_cooling_pause_also_precedes_a_repeated_measurement(bench, tmp_path):
    fault = fail_one_read(bench, DataLost("a hole"))
    point_results = run_campaign(
        bench, campaign("one", rest_s=REST_S, attempts=2), tmp_path, on_progress=fault
    )
    assert [point_result.path.name for point_result in point_results] == ["one.2.h5"]
    assert bench.idled_s == pytest.approx(LOOK_EVERY_S + REST_S)


def test_an_invalid_cooling_pause_is_refused():
    longest = timedelta(days=1).total_seconds()
    for given in (-1.0, longest + 1):
        with pytest.raises(ConfigurationError, match="rest_s"):
            validate({"name": "c", "rest_s": given}, Campaign, "c.toml")
