"""Unattended campaigns: retries, reopened and changed benches, follow-up measurements."""

import json
import sys

import pytest

from vibench.acquisition import (
    CheckFailed,
    Identity,
    InstrumentLost,
    RecordingError,
    StopSwitch,
    run_campaign,
)
from vibench.acquisition.campaign import (
    AfterFailure,
    ChangedBench,
    CommandMessenger,
    ExistingRecordings,
    ReasonCode,
)
from vibench.acquisition.campaign._journal import journal_path
from vibench.acquisition.errors import DataLost
from vibench.acquisition.plan import Retryable
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .small_campaigns import campaign, dwell, fail_one_read, outcomes, points, states


def log(folder):
    return [json.loads(line) for line in (folder / "c.log.jsonl").read_text().splitlines()]


class TestRetries:
    @pytest.mark.thorough
    def test_a_measurement_with_lost_data_is_repeated_in_a_new_file(self, bench, tmp_path):
        fault = fail_one_read(bench, DataLost("a hole"))
        point_results = run_campaign(bench, campaign("one", "two", attempts=2), tmp_path, on_progress=fault)
        assert outcomes(point_results) == [("one", "recorded"), ("two", "recorded")]
        assert [each.path.name for each in point_results] == ["one.2.h5", "two.h5"]
        assert states(tmp_path) == ["done", "done"]
        assert [point.attempts for point in points(tmp_path)] == [2, 1]
        assert [line["why"] for line in log(tmp_path) if line["event"] == "fault"] == ["data_lost"]

    def test_a_measurement_is_not_repeated_after_a_fault_outside_the_retry_policy(self, bench, tmp_path):
        fault = fail_one_read(bench, DataLost("a hole"))
        with pytest.raises(DataLost):
            run_campaign(
                bench, campaign("one", attempts=3, on=[Retryable.CHECK_FAILED]), tmp_path, on_progress=fault
            )
        (point,) = points(tmp_path)
        assert (point.state.value, point.reason_code, point.attempts) == ("failed", ReasonCode.DATA_LOST, 1)
        assert point.reason == "a hole"

    @pytest.mark.thorough
    def test_a_campaign_reopens_its_bench_after_an_instrument_was_lost(self, bench, new_bench, rig, tmp_path):
        opened = []

        def reopen():
            opened.append(new_bench(rig))
            return opened[-1]

        fault = fail_one_read(bench, InstrumentLost("gone"))
        point_results = run_campaign(
            bench, campaign("one", "two", attempts=2), tmp_path, on_progress=fault, reopen=reopen
        )
        assert outcomes(point_results) == [("one", "recorded"), ("two", "recorded")]
        assert len(opened) == 1
        assert any(name == "start" for name, _, _ in opened[0].world.calls)
        assert "bench_reopened" in [line["event"] for line in log(tmp_path)]

    def test_a_permanently_lost_instrument_ends_the_campaign(self, bench, tmp_path):
        def reopen():
            raise InstrumentLost("still gone")

        fault = fail_one_read(bench, InstrumentLost("gone"))
        with pytest.raises(InstrumentLost, match="gone") as ended:
            run_campaign(
                bench,
                campaign("one", "two", attempts=2, reopen_for_s=0),
                tmp_path,
                after_failure=AfterFailure.GO_ON,
                on_progress=fault,
                reopen=reopen,
            )
        assert any("still gone" in note for note in ended.value.__notes__)
        assert states(tmp_path) == ["failed", "queued"]

    def test_a_bench_that_reopens_with_other_instruments_is_not_used(self, bench, new_bench, rig, tmp_path):
        other = new_bench(rig)
        other.identities = {**other.identities, "generator": with_other_serial(other.identities["generator"])}
        fault = fail_one_read(bench, InstrumentLost("gone"))
        with pytest.raises(CheckFailed, match=r"instruments\.generator\.serial was"):
            run_campaign(
                bench, campaign("one", attempts=2), tmp_path, on_progress=fault, reopen=lambda: other
            )
        assert not any(name == "start" for name, _, _ in other.world.calls)


def with_other_serial(identity):
    return Identity(identity.maker, identity.model, "another", identity.firmware, identity.reply)


class TestAnotherBench:
    @pytest.fixture
    def begun(self, bench, tmp_path):
        fault = fail_one_read(bench, DataLost("a hole"))
        with pytest.raises(DataLost):
            run_campaign(bench, campaign("one", "two"), tmp_path, on_progress=fault)
        return tmp_path

    def test_a_resume_on_a_changed_bench_is_refused_with_the_differences(self, begun, new_bench, rig):
        heavier = rig.model_copy(update={"shaker": rig.shaker.model_copy(update={"fixture_mass_kg": 0.2})})
        bench = new_bench(heavier)
        with pytest.raises(CheckFailed, match=r"rig\.shaker\.fixture_mass_kg was 0\.07 and is now 0\.2"):
            run_campaign(bench, campaign("one", "two"), begun, ExistingRecordings.RESUME)
        assert not any(name == "start" for name, _, _ in bench.world.calls)

    @pytest.mark.thorough
    def test_a_changed_bench_must_be_accepted_only_once(self, begun, new_bench, rig):
        bench = new_bench(rig)
        bench.identities = {**bench.identities, "generator": with_other_serial(bench.identities["generator"])}
        point_results = run_campaign(
            bench, campaign("one", "two"), begun, ExistingRecordings.RESUME, changed_bench=ChangedBench.ACCEPT
        )
        assert outcomes(point_results) == [("one", "recorded"), ("two", "recorded")]
        run_campaign(bench, campaign("one", "two"), begun, ExistingRecordings.RESUME)


class TestFurtherMeasurements:
    @pytest.mark.thorough
    def test_follow_up_measurements_are_requested_once_and_run_next(self, bench, tmp_path):
        asked = []

        def after(finished, recording):
            asked.append((finished.point.name, [each.name for each in finished.done], recording.samples > 0))
            return [dwell("more")] if finished.point.name == "one" else []

        stop = StopSwitch()

        def stop_at_two(progress):
            if progress.name == "two":
                stop.ask(StopRequest.of(Cause.OPERATOR, "enough"))

        run_campaign(
            bench, campaign("one", "two"), tmp_path, after=after, on_progress=stop_at_two, switch=stop
        )
        point_results = run_campaign(
            bench, campaign("one", "two"), tmp_path, ExistingRecordings.RESUME, after=after
        )
        assert outcomes(point_results) == [("one", "kept"), ("more", "kept"), ("two", "recorded")]
        assert asked == [
            ("one", ["one"], True),
            ("more", ["one", "more"], True),
            ("two", ["one", "more", "two"], True),
        ]

    @pytest.mark.thorough
    def test_a_resume_repeats_a_follow_up_analysis_that_was_not_stored(self, bench, tmp_path):
        def failing_analysis(finished, recording):
            raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            run_campaign(bench, campaign("one"), tmp_path, after=failing_analysis)
        assert states(tmp_path) == ["done"]
        names = iter([[dwell("more")], []])
        point_results = run_campaign(
            bench,
            campaign("one"),
            tmp_path,
            ExistingRecordings.RESUME,
            after=lambda finished, recording: next(names),
        )
        assert outcomes(point_results) == [("one", "kept"), ("more", "recorded")]


class TestResuming:
    @pytest.mark.thorough
    def test_a_lost_journal_is_rebuilt_from_the_recordings(self, bench, tmp_path):
        run_campaign(bench, campaign("one", "two"), tmp_path)
        journal_path(tmp_path, "c").unlink()
        point_results = run_campaign(bench, campaign("one", "two"), tmp_path, ExistingRecordings.RESUME)
        assert outcomes(point_results) == [("one", "kept"), ("two", "kept")]
        assert [point.reason_code for point in points(tmp_path)] == [ReasonCode.FOUND, ReasonCode.FOUND]

    def test_two_programs_cannot_run_one_campaign(self, bench, tmp_path):
        def run_second_campaign(progress):
            with pytest.raises(RecordingError, match="another program is running"):
                run_campaign(bench, campaign("one"), tmp_path, ExistingRecordings.RESUME)

        run_campaign(bench, campaign("one"), tmp_path, on_progress=run_second_campaign)
        assert states(tmp_path) == ["done"]

    def test_a_stop_between_two_points_leaves_the_remaining_points_queued(self, bench, tmp_path):
        stop = StopSwitch()
        point_results = run_campaign(
            bench,
            campaign("one", "two"),
            tmp_path,
            on_result=lambda point_result: stop.ask(StopRequest.of(Cause.OPERATOR, "enough")),
            switch=stop,
        )
        assert [point_result.name for point_result in point_results] == ["one"]
        assert states(tmp_path) == ["done", "queued"]
        assert log(tmp_path)[-1]["text"] == "c was stopped: enough"


class TestWatching:
    @pytest.mark.thorough
    def test_the_log_and_the_status_line_show_the_events_of_a_campaign(self, bench, tmp_path):
        run_campaign(bench, campaign("one", "two"), tmp_path)
        of_points = ["point_begun", "point_done"]
        assert [line["event"] for line in log(tmp_path)] == ["begun", *of_points, *of_points, "ended"]
        last = (tmp_path / "c.status").read_text().splitlines()[-1]
        assert "c is finished (2 done, about 0:00:00 left)" in last

    def test_control_characters_sent_by_instruments_do_not_reach_the_status_line(self, bench, tmp_path):
        lost = fail_one_read(bench, DataLost("it replied \x1b[2J\udcff\nc is finished"))
        with pytest.raises(DataLost):
            run_campaign(bench, campaign("one", attempts=1), tmp_path, on_progress=lost)
        text = (tmp_path / "c.status").read_text()
        assert r"it replied \x1b[2J\udcff\nc is finished" in text
        assert "\x1b" not in text

    def test_an_incomplete_log_line_does_not_damage_the_next_line(self, bench, tmp_path):
        (tmp_path / "c.log.jsonl").write_text('{"utc": "2026-01-01T00:00:00", "eve')
        run_campaign(bench, campaign("one"), tmp_path)
        lines = (tmp_path / "c.log.jsonl").read_text().splitlines()
        assert json.loads(lines[1])["event"] == "begun"

    @pytest.mark.thorough
    def test_a_notification_command_is_run_after_a_fault_and_at_the_end_and_may_fail(self, bench, tmp_path):
        told = tmp_path / "told.jsonl"
        keep = "import sys; open(sys.argv[1], 'a').write(sys.stdin.read() + chr(10))"
        messengers = (
            CommandMessenger((sys.executable, "-c", keep, str(told))),
            CommandMessenger(("/no/such/program", "--now")),
        )
        fault = fail_one_read(bench, DataLost("a hole"))
        run_campaign(bench, campaign("one", attempts=2), tmp_path, on_progress=fault, messengers=messengers)
        fault, end = (json.loads(line) for line in told.read_text().splitlines())
        assert (fault["event"], fault["why"], fault["reason"]) == ("fault", "data_lost", "one: a hole")
        assert (end["event"], end["recorded"], end["campaign"]) == ("ended", 1, "c")
        notices = [line["text"] for line in log(tmp_path) if line["event"] == "notice"]
        assert notices[1] == "/no/such/program could not be run (No such file or directory)"
