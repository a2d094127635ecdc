"""Campaigns with simulated instruments in a loop, recorded into real files."""

import signal

import pytest

from vibench.acquisition import (
    InstrumentLost,
    LimitExceeded,
    RecordingError,
    open_recording,
    run_campaign,
    run_measurement,
)
from vibench.acquisition.campaign import (
    AfterFailure,
    ExistingRecordings,
    PointOutcome,
    _opening,
    _run_campaign,
)
from vibench.acquisition.errors import DataLost
from vibench.acquisition.plan import Campaign, RunState
from vibench.acquisition.recording import RecordingState

from .small_campaigns import campaign, dwell, fail_one_read, outcomes

CAMPAIGN = campaign("one", "two", "three")


def test_a_file_with_the_name_of_the_campaign_folder_is_refused_before_output(bench, tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("mine")
    with pytest.raises(RecordingError, match=r"taken cannot be created .* Nothing was played"):
        run_campaign(bench, CAMPAIGN, taken)
    assert taken.read_text() == "mine"
    assert not any(name == "start" for name, _, _ in bench.world.calls)


@pytest.mark.thorough
def test_limits_are_checked_once_for_points_with_equal_excitation(bench, tmp_path, monkeypatch):
    checked = []
    monkeypatch.setattr(
        _opening, "require_within_limits", lambda measurement, rig: checked.append(measurement) or ()
    )
    repeated = CAMPAIGN.measurements[0].model_copy(update={"repeats": 3})
    planned = (repeated, CAMPAIGN.measurements[1], dwell("louder", amplitude_vpp=1.2))
    run_campaign(bench, Campaign(name="c", measurements=planned), tmp_path / "out")
    assert [each.name for each in checked] == ["one", "louder"]


@pytest.mark.thorough
def test_a_complete_recording_can_be_moved_during_the_campaign(bench, tmp_path, monkeypatch):
    def measure_and_move(*arguments, **named):
        outcome = run_measurement(*arguments, **named)
        if outcome.path.name == "two.h5":
            outcome.path.rename(tmp_path / "elsewhere.h5")
        return outcome

    monkeypatch.setattr(_run_campaign, "run_measurement", measure_and_move)
    point_results = run_campaign(bench, CAMPAIGN, tmp_path / "out")
    assert [each.outcome for each in point_results] == [PointOutcome.RECORDED] * 3
    monkeypatch.undo()
    again = run_campaign(bench, CAMPAIGN, tmp_path / "out", existing=ExistingRecordings.RESUME)
    assert [each.outcome for each in again] == [PointOutcome.KEPT, PointOutcome.RECORDED, PointOutcome.KEPT]


@pytest.fixture(scope="module")
def recordings(new_bench, rig, tmp_path_factory):
    """Return the folder of a finished campaign, and the set of (name, number, count) of its progress."""
    folder, seen = tmp_path_factory.mktemp("recorded"), set()
    run_campaign(
        new_bench(rig), CAMPAIGN, folder, on_progress=lambda p: seen.add((p.name, p.number, p.count))
    )
    return folder, seen


@pytest.mark.thorough
def test_the_progress_of_a_campaign_counts_its_recordings(recordings):
    assert recordings[1] == {("one", 1, 3), ("two", 2, 3), ("three", 3, 3)}


@pytest.mark.thorough
def test_a_second_campaign_in_the_same_folder_is_refused_and_changes_nothing(bench, recordings):
    folder, _ = recordings
    before = {path: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(RecordingError, match="give another folder, or resume the campaign"):
        run_campaign(bench, CAMPAIGN, folder)
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.thorough
def test_a_resume_keeps_complete_points_and_records_the_remaining_points(bench, tmp_path):
    with pytest.raises(DataLost):
        run_campaign(bench, CAMPAIGN, tmp_path, on_progress=fail_one_read(bench, DataLost("a hole"), "two"))
    point_results = run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert outcomes(point_results) == [("one", "kept"), ("two", "recorded"), ("three", "recorded")]
    assert sorted(path.name for path in tmp_path.glob("*.h5")) == ["one.h5", "three.h5", "two.2.h5", "two.h5"]
    with open_recording(tmp_path / "two.h5") as first:
        assert first.state is RecordingState.FAILED
        assert "a hole" in first.reason
    kept = run_campaign(bench, CAMPAIGN, tmp_path, ExistingRecordings.RESUME)
    assert {outcome for _, outcome in outcomes(kept)} == {"kept"}


def test_a_resume_with_another_plan_is_refused(bench, recordings):
    changed = Campaign(name="c", measurements=(dwell("one", amplitude_vpp=2.0),))
    with pytest.raises(RecordingError, match=r"has changed since .*c\.campaign\.sqlite was written"):
        run_campaign(bench, changed, recordings[0], ExistingRecordings.RESUME)


@pytest.mark.thorough
def test_a_campaign_can_skip_a_failed_measurement(bench, tmp_path):
    fault = fail_one_read(bench, DataLost("a hole"), "one")
    point_results = run_campaign(
        bench, CAMPAIGN, tmp_path, after_failure=AfterFailure.GO_ON, on_progress=fault
    )
    assert outcomes(point_results) == [("one", "failed"), ("two", "recorded"), ("three", "recorded")]
    assert point_results[0].reason == "a hole"


@pytest.mark.parametrize("lost", [InstrumentLost("gone"), RecordingError("the disk is full")])
def test_a_lost_instrument_or_disk_always_ends_a_campaign(bench, tmp_path, lost):
    fault = fail_one_read(bench, lost, "one")
    with pytest.raises(type(lost)):
        run_campaign(bench, CAMPAIGN, tmp_path, after_failure=AfterFailure.GO_ON, on_progress=fault)
    assert [path.name for path in tmp_path.glob("*.h5*")] == ["one.h5"]


def test_a_campaign_does_not_start_if_one_plan_exceeds_a_limit(bench, tmp_path):
    measurements = (dwell("one"), dwell("hard", 20.0, 10), dwell("harder", 21.0, 10))
    with pytest.raises(LimitExceeded, match=r"hard: the stroke.*exceed a limit: harder"):
        run_campaign(bench, Campaign(name="c", measurements=measurements), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert bench.world.calls == []


@pytest.mark.thorough
def test_ctrl_c_ramps_down_the_drive_and_ends_the_campaign(bench, tmp_path):
    def press_once(progress):
        if progress.name == "two" and progress.run.state is RunState.SETTLING:
            signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    point_results = run_campaign(bench, CAMPAIGN, tmp_path, on_progress=press_once)
    assert outcomes(point_results) == [("one", "recorded"), ("two", "stopped")]
    assert not bench.world.is_on
    assert signal.getsignal(signal.SIGINT) is before
    with open_recording(tmp_path / "two.h5") as recording:
        assert recording.state is RecordingState.STOPPED
        assert recording.reason.startswith("SIGINT")


def test_a_second_ctrl_c_stops_faster_and_further_presses_have_no_effect(bench, tmp_path):
    def press_repeatedly(progress):
        if progress.state is RunState.RECORDING or progress.state is RunState.RAMPING_DOWN:
            signal.raise_signal(signal.SIGINT)

    original = bench.generator.stop

    def stop_with_ctrl_c():
        signal.raise_signal(signal.SIGINT)
        original()

    bench.generator.stop = stop_with_ctrl_c
    with pytest.raises(KeyboardInterrupt):
        run_measurement(bench, dwell("one"), tmp_path / "one.h5", on_progress=press_repeatedly)
    assert not bench.world.is_on
    with open_recording(tmp_path / "one.h5") as recording:
        assert recording.state is RecordingState.STOPPED
