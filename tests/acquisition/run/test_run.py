"""The states of a run: what each state plays and records, and every way to end a run."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from vibench.acquisition import (
    CheckFailed,
    ConfigurationError,
    InstrumentLost,
    LimitExceeded,
    Overload,
    RecordingError,
    StopLevel,
    StopSwitch,
)
from vibench.acquisition.errors import DataLost, InstrumentError
from vibench.acquisition.plan import (
    CHECK_S,
    FEWEST_STAIRS,
    Dwell,
    InRunLimits,
    Measurement,
    OnOverload,
    RunState,
    SineSweep,
    SteppedSine,
    StreamedNoise,
    WhiteNoise,
    shortest_ramp_s,
    stairs,
)
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.run.acquisition_loop import BLOCK_S
from vibench.acquisition.run.phase_runner import HOLD_LONGEST_S
from vibench.acquisition.run.run import Run
from vibench.acquisition.run.silence_watch import LISTEN_S, SILENT_V, LowLevelCheck, fit_sine
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .ending_silent import upto

RATE = 5120.0
AMPLITUDE_VPP = 1.0
DWELL = Measurement(
    name="dwell",
    excitation=Dwell(amplitude_vpp=AMPLITUDE_VPP, frequency_hz=260, settle_s=0.35, duration_s=0.5),
    ramp_s=0.2,
    ramp_step_s=0.02,
)
LOUD = Dwell(amplitude_vpp=4.0, frequency_hz=260, settle_s=0.35, duration_s=0.5)
SLOW = DWELL.model_copy(update={"ramp_s": 1.0})
RECORDED_STATES = [
    RunState.CHECKING,
    RunState.RAMPING_UP,
    RunState.SETTLING,
    RunState.RECORDING,
    RunState.RAMPING_DOWN,
]
every_state = pytest.mark.parametrize("state", RECORDED_STATES)


def changed_dwell(**changes):
    return DWELL.model_copy(update=changes)


def run_of(bench, tmp_path, measurement=DWELL, check=LowLevelCheck.AT_LOW_LEVEL):
    return Run(bench, measurement, tmp_path / "run.h5", check, bench.recorder.create)


def by_operator(level):
    return StopRequest(Cause.OPERATOR, level, f"{level} pressed")


def run_upto(state, *given, **options):
    run = run_of(*given, **options)
    upto(run, state)
    return run


def assert_silent_and_finished(bench, state):
    assert not bench.world.is_on
    assert not bench.world.is_sampling
    assert bench.recorder.ending[0] is state
    generator = [name for name, _, _ in bench.world.calls if "." not in name and name != "amplitude"]
    assert generator[-1] == "stop"
    order = [name for name, _, _ in bench.world.calls]
    assert len(order) - order[::-1].index("stop") <= order.index("recorder.finish")


def assert_ended_without_a_jump(bench, state=RunState.RECORDING):
    """Require that no amplitude setting falls by more than one ramp step while the output is on."""
    if state is RunState.CHECKING:
        return
    settings = [value for _, value in bench.world.amplitudes()]
    top = max(settings)
    largest_stair = top * np.pi / 2 / 10 * 1.05
    assert np.max(-np.diff(settings[settings.index(top) :]), initial=0.0) <= largest_stair
    assert settings[-1] <= 2.5e-3 + 1e-12


@pytest.fixture(scope="module")
def played(new_bench, rig, tmp_path_factory):
    """Return a bench after a complete run; ``shown`` contains the progress."""
    bench = new_bench(rig)
    bench.shown = list(run_of(bench, tmp_path_factory.mktemp("run")))
    return bench


class TestCompleteRuns:
    def test_a_run_goes_through_all_states_in_order(self, bench, tmp_path):
        run = run_of(bench, tmp_path)
        assert run.state is RunState.IDLE
        seen = [progress.state for progress in run]
        assert list(dict.fromkeys(seen)) == RECORDED_STATES
        assert bench.recorder.states() == ["armed", "ramping_up", "settling", "recording", "ramping_down"]
        assert run.state is RunState.FINISHED
        assert_silent_and_finished(bench, RecordingState.COMPLETE)

    def test_every_segment_has_exactly_its_planned_samples(self, played):
        lengths = {each["label"]: each["last"] - each["first"] + 1 for each in played.recorder.segments}
        expected = {"check": CHECK_S, "ramp_up": 0.2, "dwell": 0.5, "ramp_down": 0.2}
        assert lengths == {label: round(seconds * RATE) for label, seconds in expected.items()}
        assert played.recorder.samples == round((CHECK_S + 0.2 + 0.35 + 0.5 + 0.2) * RATE)

    def test_every_block_states_the_elapsed_time_and_the_generator_voltage(self, played):
        shown = played.shown
        assert shown[-1].elapsed_s == pytest.approx(shown[-1].total_s)
        assert all(a.elapsed_s < b.elapsed_s for a, b in pairwise(shown))
        assert max(progress.block.volts.shape[1] for progress in shown) <= 0.1 * RATE
        settings = {progress.state: progress.amplitude_vpp for progress in shown}
        assert shown[0].amplitude_vpp == 0.0
        assert settings[RunState.CHECKING] == pytest.approx(0.02 * AMPLITUDE_VPP)
        assert settings[RunState.RECORDING] == AMPLITUDE_VPP

    def test_a_ramp_follows_a_half_cosine_in_amplitude_steps(self, played):
        ramp = next(each for each in played.recorder.segments if each["label"] == "ramp_up")
        stairs = [
            (at - ramp["first"], value) for at, value in played.world.amplitudes() if ramp["first"] <= at
        ]
        begins = np.array([at for at, _ in stairs[1:11]])
        values = np.array([value for _, value in stairs[1:11]])
        quiet = 2.5e-3
        expected = quiet + (AMPLITUDE_VPP - quiet) * (1 - np.cos(np.pi * np.arange(1, 11) / 10)) / 2
        np.testing.assert_allclose(values, expected, rtol=1e-12)
        np.testing.assert_allclose(begins, np.round(np.arange(10) * 0.02 * RATE), atol=1)
        assert stairs[0] == (0, pytest.approx(quiet))

    def test_the_output_is_turned_on_only_at_a_quiet_amplitude(self, played):
        amplitude = None
        at_start = []
        for name, value, _ in played.world.calls:
            if name == "amplitude":
                amplitude = value
            if name == "start":
                at_start.append(amplitude)
        assert at_start == [pytest.approx(0.02 * AMPLITUDE_VPP), pytest.approx(2.5e-3)]

    def test_a_run_on_a_checked_bench_skips_the_low_level_check(self, bench, tmp_path):
        list(run_of(bench, tmp_path, check=LowLevelCheck.RECENTLY_PASSED))
        assert [each["label"] for each in bench.recorder.segments] == ["ramp_up", "dwell", "ramp_down"]
        events = [event[1:] for event in bench.recorder.events]
        assert ("check", "skipped: the bench was checked shortly before") in events
        assert ("player", "function generator") in events

    def test_the_header_contains_plan_bench_and_confirmations(self, played):
        header = played.recorder.header
        assert Measurement.model_validate_json(header.plan_json) == DWELL
        assert type(played.rig).model_validate_json(header.bench_json) == played.rig
        assert header.confirmations["Bruel & Kjaer 2706 gain"] == "10 dB"
        assert header.instruments["generator"].model == "GENERATOR"
        assert header.expected_samples == played.recorder.samples


class TestSweepsAndSteps:
    def test_a_sweep_is_one_segment_of_many_frequencies(self, bench, tmp_path):
        sweep = SineSweep(
            amplitude_vpp=1, start_hz=150, stop_hz=350, duration_s=1, step_s=0.0123, settle_s=0.2
        )
        plan = changed_dwell(excitation=sweep)
        list(run_of(bench, tmp_path, plan))
        segments = [each for each in bench.recorder.segments if each["label"] == "sweep"]
        assert len(segments) == 1
        assert segments[0]["last"] - segments[0]["first"] + 1 == round(RATE)
        changes = [at for name, _, at in bench.world.calls if name == "set_frequency"]
        expected = segments[0]["first"] + np.arange(1, 82) * 0.0123 * RATE
        # Steps with a non-integer number of samples do not drift: each change is at the nearest sample.
        np.testing.assert_allclose(changes, expected, atol=0.5 + 1e-6)

    def test_a_sweep_never_jumps_in_phase_or_amplitude(self, bench, tmp_path):
        sweep = SineSweep(amplitude_vpp=2, start_hz=50, stop_hz=80, duration_s=1, step_s=0.01, settle_s=0.1)
        list(run_of(bench, tmp_path, changed_dwell(excitation=sweep)))
        segment = next(each for each in bench.recorder.segments if each["label"] == "sweep")
        volts = bench.recorder.channel(0)[segment["first"] : segment["last"] + 1]
        assert np.max(np.abs(np.diff(volts * bench.channels[0].units_per_volt))) <= 2 * np.pi * 80 / RATE

    def test_a_stepped_sine_settles_at_every_frequency(self, bench, tmp_path):
        steps = SteppedSine(amplitude_vpp=1, frequencies_hz=(100, 150, 260), settle_s=0.13, record_s=0.2)
        list(run_of(bench, tmp_path, changed_dwell(excitation=steps)))
        segments = [each for each in bench.recorder.segments if each["label"] == "step"]
        assert [each["numbers"]["frequency_hz"] for each in segments] == [100, 150, 260]
        gaps = [b["first"] - a["last"] - 1 for a, b in pairwise(segments)]
        assert all(abs(gap - 0.13 * RATE) <= 1 for gap in gaps)
        assert bench.recorder.states().count("ramping_up") == 1

    def test_a_new_waveform_is_loaded_only_while_the_drive_is_quiet(self, bench, tmp_path):
        band = {"band_start_hz": 20, "band_stop_hz": 800, "repetition_hz": 2}
        noise = WhiteNoise(amplitude_vpp=2, realisations=3, periods=1, settle_s=0.1, **band)
        list(run_of(bench, tmp_path, changed_dwell(excitation=noise)))
        amplitude, before, after = None, [], []
        for name, value, _ in bench.world.calls:
            if name == "load_waveform":
                before.append(amplitude)
            if name == "amplitude":
                if len(after) < len(before):
                    after.append(value)
                amplitude = value
        assert len(before) == 3
        assert max(before[1:] + after) < 4e-3
        realisations = [each for each in bench.recorder.segments if each["label"] == "realisation"]
        assert [each["numbers"]["realisation"] for each in realisations] == [0, 1, 2]
        assert all(each["last"] - each["first"] + 1 == RATE / 2 for each in realisations)

    @settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(settle_s=st.floats(0.0, 0.4), record_s=st.floats(0.01, 0.4))
    def test_segment_boundaries_never_drift_by_more_than_one_sample(
        self, rig, new_bench, tmp_path, settle_s, record_s
    ):
        bench = new_bench(rig)
        steps = SteppedSine(
            amplitude_vpp=1, frequencies_hz=(100, 150, 260), settle_s=settle_s, record_s=record_s
        )
        list(run_of(bench, tmp_path, changed_dwell(excitation=steps)))
        total_s = CHECK_S + 0.4 + 3 * (settle_s + record_s)
        assert abs(bench.recorder.samples - total_s * RATE) <= 0.5 + 1e-6


class TestEndsOfARun:
    @every_state
    def test_cancelling_a_run_ramps_the_drive_down(self, bench, tmp_path, state):
        run = run_upto(state, bench, tmp_path)
        run.cancel("the operator pressed stop")
        list(run)
        assert run.outcome.state is run.state is RunState.STOPPED
        assert bench.recorder.ending == (RecordingState.STOPPED, "the operator pressed stop")
        assert_silent_and_finished(bench, RecordingState.STOPPED)
        assert_ended_without_a_jump(bench, state)

    def test_cancelling_a_run_takes_effect_within_a_block(self, bench, tmp_path):
        run = run_of(bench, tmp_path)
        shown = upto(run, RunState.RECORDING)
        run.cancel()
        rest = list(run)
        assert all(progress.state is RunState.RAMPING_DOWN for progress in rest)
        assert rest[-1].elapsed_s - shown.elapsed_s == pytest.approx(DWELL.ramp_s + LISTEN_S, abs=1e-3)
        cancelled = bench.recorder.segments[-1]
        assert (cancelled["label"], cancelled["last"]) == ("dwell", None)

    def test_a_run_cancelled_before_it_begins_plays_nothing(self, bench, tmp_path):
        run = run_of(bench, tmp_path)
        run.cancel()
        list(run)
        assert run.state is RunState.STOPPED
        assert "start" not in [name for name, _, _ in bench.world.calls]

    def test_cancelling_a_run_that_has_ended_changes_nothing(self, bench, tmp_path):
        run = run_of(bench, tmp_path)
        list(run)
        run.cancel()
        assert run.outcome.state is RunState.FINISHED

    @every_state
    def test_a_run_over_a_limit_is_ramped_down_and_the_limit_is_named(self, bench, tmp_path, state):
        run = run_upto(state, bench, tmp_path)
        bench.world.base_factor, bench.world.background_m_per_s2 = 1.0, 1000.0
        with pytest.raises(LimitExceeded, match=r"base acceleration reached 1.*736 m/s2 \(4809, bare table"):
            list(run)
        assert run.state is RunState.FAILED
        assert "base acceleration" in bench.recorder.ending[1]
        assert_silent_and_finished(bench, RecordingState.FAILED)
        assert_ended_without_a_jump(bench, state)

    @every_state
    @pytest.mark.parametrize(
        ("call", "fault"),
        [
            ("digitizer.read", DataLost),
            ("digitizer.read", InstrumentLost),
            ("recorder.append", RecordingError),
            ("digitizer.read", RuntimeError),
        ],
    )
    def test_a_failure_silences_the_drive_and_records_the_reason(self, bench, tmp_path, state, call, fault):
        run = run_upto(state, bench, tmp_path)
        bench.world.faults[call] = [lambda: fault("it broke")]
        with pytest.raises(fault, match="it broke"):
            list(run)
        assert run.state is RunState.FAILED
        assert "it broke" in bench.recorder.ending[1]
        assert_silent_and_finished(bench, RecordingState.FAILED)
        assert_ended_without_a_jump(bench, state)

    @every_state
    def test_a_generator_that_was_lost_still_receives_a_stop_command(self, bench, tmp_path, state):
        run = run_upto(state, bench, tmp_path)
        for name in ("set_amplitude", "set_frequency", "load_sine"):
            bench.world.permanent[name] = lambda: InstrumentLost("no answer")
        with pytest.raises(InstrumentLost, match="no answer"):
            list(run)
        assert_silent_and_finished(bench, RecordingState.FAILED)

    @every_state
    def test_a_generator_that_does_not_stop_causes_an_alarm(self, bench, tmp_path, state):
        run = run_upto(state, bench, tmp_path)
        bench.world.permanent["stop"] = lambda: InstrumentLost("THE OUTPUT MAY STILL BE ON")
        with pytest.raises(InstrumentLost, match="MAY STILL BE ON"):
            list(run)
        assert run.state is RunState.FAILED
        assert "MAY STILL BE ON" in bench.recorder.ending[1]
        assert not bench.world.is_sampling

    @every_state
    @pytest.mark.parametrize("call", ["digitizer.read", "set_amplitude"])
    def test_a_keyboard_interrupt_inside_a_driver_silences_the_drive(self, bench, tmp_path, state, call):
        run = run_upto(state, bench, tmp_path)
        bench.world.faults[call] = [KeyboardInterrupt]
        with pytest.raises(KeyboardInterrupt):
            list(run)
        assert bench.recorder.ending == (RecordingState.STOPPED, "interrupted from the keyboard")
        assert_silent_and_finished(bench, RecordingState.STOPPED)

    @every_state
    def test_abandoning_the_iteration_of_a_run_ramps_the_drive_down(self, bench, tmp_path, state):
        with run_of(bench, tmp_path) as run:
            upto(run, state)
        assert run.state is RunState.STOPPED
        assert "abandoned the run" in bench.recorder.ending[1]
        assert_silent_and_finished(bench, RecordingState.STOPPED)
        assert_ended_without_a_jump(bench, state)

    @every_state
    def test_an_exception_in_an_observer_ends_the_run(self, bench, tmp_path, state):
        def watch():
            with run_of(bench, tmp_path) as run:
                upto(run, state)
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            watch()
        assert_silent_and_finished(bench, RecordingState.STOPPED)

    def test_a_failure_to_finish_the_recording_ends_the_run_in_silence(self, bench, tmp_path):
        bench.world.permanent["recorder.finish"] = lambda: RecordingError("disk full")
        run = run_of(bench, tmp_path)
        with pytest.raises(RecordingError, match="disk full"):
            list(run)
        assert not bench.world.is_on
        assert run.outcome.state is RunState.FAILED

    def test_the_first_of_two_failures_is_reported(self, bench, tmp_path):
        bench.world.permanent["digitizer.stop"] = lambda: InstrumentLost("cannot stop")
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        bench.world.faults["digitizer.read"] = [lambda: DataLost("a hole")]
        with pytest.raises(DataLost, match="a hole"):
            list(run)
        assert bench.recorder.ending[1] == "DataLost: a hole; then: cannot stop"

    def test_a_limit_exceeded_during_the_ramp_down_does_not_stop_the_ramp(self, bench, tmp_path):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        run.cancel()
        bench.world.background_m_per_s2 = 1000.0
        list(run)
        assert run.state is RunState.STOPPED
        assert_ended_without_a_jump(bench)


def text_of_silence(bench):
    return next(text for _, kind, text in bench.recorder.events if kind == "silence")


class TestStopLevels:
    def stop_at_levels(self, bench, tmp_path, *levels):
        """Stop a recording at each level, one block apart; return the run and the blocks from then on."""
        run = run_upto(RunState.RECORDING, bench, tmp_path, SLOW)
        shown = []
        for level in levels:
            run.switch.ask(by_operator(level))
            shown += [progress for progress in [next(iter(run), None)] if progress is not None]
        return run, [*shown, *list(run)]

    @pytest.mark.parametrize("level", [StopLevel.RAMP, StopLevel.ABORT])
    def test_a_ramp_takes_as_long_as_planned_and_an_abort_takes_three_periods(self, bench, tmp_path, level):
        run, shown = self.stop_at_levels(bench, tmp_path, level)
        ramp_s = SLOW.ramp_s if level is StopLevel.RAMP else shortest_ramp_s(bench.rig)
        took_s = shown[-1].elapsed_s - shown[0].elapsed_s - LISTEN_S
        assert took_s == pytest.approx(ramp_s * 49 / 50, abs=1e-3)
        assert run.outcome.cause is Cause.OPERATOR
        assert_ended_without_a_jump(bench)

    def test_an_immediate_stop_acts_before_the_next_read(self, bench, tmp_path, monkeypatch):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        was_on = []
        waiting = property(lambda _: was_on.append(bench.world.is_on) or 0)
        monkeypatch.setattr(type(bench.digitizer), "waiting_samples", waiting)
        run.switch.ask(by_operator(StopLevel.OFF))
        before = len(bench.world.calls)
        list(run)
        assert was_on
        assert not any(was_on)
        assert bench.world.calls[before][0] == "stop"
        assert_silent_and_finished(bench, RecordingState.STOPPED)

    def test_a_faster_stop_replaces_a_slow_ramp_down(self, bench, tmp_path):
        _, shown = self.stop_at_levels(bench, tmp_path, StopLevel.RAMP, StopLevel.ABORT)
        assert shown[-1].elapsed_s - shown[0].elapsed_s < shortest_ramp_s(bench.rig) + 2 * SLOW.ramp_s / 50
        assert_ended_without_a_jump(bench)
        assert [event[2] for event in bench.recorder.events if event[1] == "end"] == [
            "ramp pressed", "abort pressed"
        ]  # fmt: skip

    def test_a_slower_stop_does_not_replace_a_faster_stop(self):
        switch = StopSwitch()
        switch.ask(StopRequest(Cause.EMERGENCY, StopLevel.ABORT, "first"))
        switch.ask(by_operator(StopLevel.RAMP))
        assert switch.request.reason == "first"

    def test_the_time_to_silence_is_recorded(self, bench, tmp_path):
        self.stop_at_levels(bench, tmp_path, StopLevel.ABORT)
        said = text_of_silence(bench)
        took_s = float(said.removeprefix("abort: ").partition(" ")[0])
        # The last step of the ramp is below the level that counts as silence.
        assert 0.85 * shortest_ramp_s(bench.rig) < took_s <= shortest_ramp_s(bench.rig)
        assert "silence was measured" in said

    def test_unread_samples_do_not_delay_a_stop(self, bench, tmp_path, monkeypatch):
        """A busy computer reads five times as fast as real time and has ten seconds of unread samples."""
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        convert, read = bench.world.convert, bench.digitizer.read
        unread = 10 * round(bench.digitizer.sample_rate_hz)
        convert(unread)
        stopped = bench.world.samples + unread

        def read_slowly(samples):
            convert(samples // 5)
            return read(samples)

        monkeypatch.setattr(bench.digitizer, "read", read_slowly)
        run.switch.ask(by_operator(StopLevel.ABORT))
        list(run)
        loud = np.flatnonzero(np.abs(bench.recorder.channel(0)) > SILENT_V)
        took_s = (loud[-1] - stopped) / bench.digitizer.sample_rate_hz
        # One block until the stop is noticed, then the ramp.
        assert took_s <= BLOCK_S / 5 + shortest_ramp_s(bench.rig)
        assert_silent_and_finished(bench, RecordingState.STOPPED)

    @pytest.mark.parametrize("reading_s", [0.0, 0.03, 0.1])
    def test_a_ramp_keeps_enough_steps_on_a_computer_that_reads_slowly(
        self, bench, tmp_path, monkeypatch, reading_s
    ):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        convert, read, rate_hz = bench.world.convert, bench.digitizer.read, bench.digitizer.sample_rate_hz

        def read_slowly(samples):
            convert(round(reading_s * rate_hz))
            return read(samples)

        monkeypatch.setattr(bench.digitizer, "read", read_slowly)
        began, stopped = len(bench.world.amplitudes()), bench.world.samples
        run.switch.ask(by_operator(StopLevel.RAMP))
        list(run)
        loud = np.flatnonzero(np.abs(bench.recorder.channel(0)) > SILENT_V)
        took_s = (loud[-1] - stopped) / rate_hz
        assert took_s <= BLOCK_S + reading_s + max(DWELL.ramp_s + reading_s, FEWEST_STAIRS * reading_s)
        settings = [value for _, value in bench.world.amplitudes()[began:]]
        assert FEWEST_STAIRS <= len(settings) <= stairs(DWELL)
        assert np.min(np.diff([AMPLITUDE_VPP, *settings])) >= -0.36 * AMPLITUDE_VPP

    def test_a_drive_that_stays_on_is_recorded_and_causes_an_alarm(self, bench, tmp_path):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        bench.world.stays_on = True
        run.switch.ask(by_operator(StopLevel.OFF))
        with pytest.raises(InstrumentError, match="THE OUTPUT MAY STILL BE ON"):
            list(run)
        assert "not silent" in text_of_silence(bench)
        assert bench.recorder.ending[0] is RecordingState.FAILED

    def test_mains_hum_does_not_count_as_a_drive_signal(self, bench, tmp_path):
        bench.world.hum_v = 0.012
        run = run_upto(RunState.RECORDING, bench, tmp_path, changed_dwell(excitation=LOUD))
        run.switch.ask(by_operator(StopLevel.ABORT))
        list(run)
        assert "silence was measured" in text_of_silence(bench)

    @pytest.mark.parametrize("state", [RunState.RAMPING_UP, RunState.SETTLING, RunState.RECORDING])
    def test_a_held_run_keeps_its_voltage_and_resumes_in_the_same_state(self, bench, tmp_path, state):
        run = run_of(bench, tmp_path)
        before = upto(run, state)
        run.switch.hold()
        held = [next(iter(run)) for _ in range(3)]
        assert {progress.state for progress in held} == {RunState.HELD}
        assert {progress.amplitude_vpp for progress in held} == {before.amplitude_vpp}
        run.switch.resume()
        after = list(run)
        assert after[0].state is state
        assert run.state is RunState.FINISHED
        assert bench.recorder.samples == round((CHECK_S + 0.2 + 0.35 + 0.5 + 0.2 + 0.3) * RATE)

    def test_limits_are_monitored_during_a_hold(self, bench, tmp_path):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        run.switch.hold()
        next(iter(run))
        bench.world.base_factor, bench.world.background_m_per_s2 = 1.0, 1000.0
        with pytest.raises(LimitExceeded):
            list(run)
        assert_silent_and_finished(bench, RecordingState.FAILED)

    def test_a_stop_ends_a_hold(self, bench, tmp_path):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        run.switch.hold()
        next(iter(run))
        run.cancel("enough")
        list(run)
        assert bench.recorder.ending == (RecordingState.STOPPED, "enough")
        assert_ended_without_a_jump(bench)

    @pytest.mark.thorough
    def test_a_hold_ends_after_the_longest_hold_time(self, bench, tmp_path):
        run = run_upto(RunState.RECORDING, bench, tmp_path)
        run.switch.hold()
        list(run)
        assert run.outcome.state is RunState.STOPPED
        assert f"held for {HOLD_LONGEST_S:g} s" in run.outcome.reason


class TestRefusals:
    def require_refusal(self, bench, tmp_path, measurement, error):
        run = run_of(bench, tmp_path, measurement)
        with pytest.raises(error) as caught:
            list(run)
        assert run.state is RunState.FAILED
        assert "start" not in [name for name, _, _ in bench.world.calls]
        assert bench.recorder.path is None
        return str(caught.value)

    def test_a_plan_beyond_a_limit_is_refused_before_output(self, bench, tmp_path):
        hard = Dwell(amplitude_vpp=10, frequency_hz=20, duration_s=1)
        text = self.require_refusal(bench, tmp_path, changed_dwell(excitation=hard), LimitExceeded)
        assert "the stroke (at 20 Hz, peak) would be" in text

    def test_streamed_noise_needs_an_analogue_output(self, bench, tmp_path):
        noise = StreamedNoise(amplitude_vpp=1, band_start_hz=50, band_stop_hz=800, duration_s=1)
        text = self.require_refusal(bench, tmp_path, changed_dwell(excitation=noise), ConfigurationError)
        assert "use white_noise with more realisations" in text

    def test_a_bench_without_a_drive_voltage_channel_is_refused(self, bench, tmp_path):
        bench.channels = bench.channels[1:]
        assert "no drive_voltage channel" in self.require_refusal(bench, tmp_path, DWELL, CheckFailed)


class TestTheBenchCheck:
    @pytest.mark.parametrize(
        ("fault", "sentence"),
        [
            ({"drive_factor": 2.0}, "a factor of 2 means a wrong load"),
            ({"drive_factor": 0.5}, "a factor of 2 means a wrong load"),
            ({"drive_factor": 0.0}, "check the wire from the generator"),
            ({"base_factor": 1.5}, "the base acceleration is"),
            ({"base_factor": 0.6}, "check the amplifier's gain"),
            ({"background_m_per_s2": 10.0}, "before any signal is played"),
        ],
    )
    def test_a_low_level_check_that_finds_a_deviation_prevents_output(self, bench, tmp_path, fault, sentence):
        for name, value in fault.items():
            setattr(bench.world, name, value)
        run = run_of(bench, tmp_path)
        with pytest.raises(CheckFailed, match=sentence):
            list(run)
        assert_silent_and_finished(bench, RecordingState.FAILED)
        loudest = max(value for _, value in bench.world.amplitudes())
        assert loudest == pytest.approx(0.02 * AMPLITUDE_VPP)

    @pytest.mark.parametrize("fault", [{"drive_factor": 1.1}, {"base_factor": 1.35}, {"base_factor": 0.75}])
    def test_the_check_tolerates_small_differences_from_the_configuration(self, bench, tmp_path, fault):
        for name, value in fault.items():
            setattr(bench.world, name, value)
        run = run_of(bench, tmp_path)
        list(run)
        assert run.state is RunState.FINISHED

    @given(
        frequency_hz=st.floats(20, 2000),
        amplitude=st.floats(1e-3, 10),
        phase=st.floats(0, 6.28),
        offset=st.floats(-5, 5),
        drift=st.floats(-1, 1),
    )
    def test_a_sine_is_measured_despite_offset_and_drift(self, frequency_hz, amplitude, phase, offset, drift):
        time_s = np.arange(2000) / RATE
        volts = amplitude * np.sin(2 * np.pi * frequency_hz * time_s + phase) + offset + drift * time_s
        assert fit_sine(volts, frequency_hz, RATE).amplitude == pytest.approx(amplitude, rel=1e-6, abs=1e-9)


class TestOverloads:
    def test_an_overload_is_recorded_and_the_run_continues(self, bench, tmp_path):
        bench.world.overloads = (Overload("m0_velocity", 3, 5),)
        run = run_of(bench, tmp_path)
        list(run)
        assert run.state is RunState.FINISHED
        assert bench.recorder.blocks[0].overloads == bench.world.overloads

    def test_an_overload_ends_the_run_if_the_plan_says_so(self, bench, tmp_path):
        strict = changed_dwell(limits=InRunLimits(on_overload=OnOverload.STOP))
        run = run_upto(RunState.RECORDING, bench, tmp_path, strict)
        bench.world.overloads = (Overload("m0_velocity", 3, 5),)
        with pytest.raises(LimitExceeded, match="m0_velocity was overloaded at sample 3"):
            list(run)
        assert_ended_without_a_jump(bench)

    @pytest.mark.parametrize(
        ("limits", "named"),
        [
            (InRunLimits(base_acceleration=0.005), "the base acceleration"),
            (InRunLimits(amplifier_voltage=0.05), "the amplifier voltage"),
            (InRunLimits(current=0.05), "the coil current"),
        ],
    )
    def test_a_plan_may_set_tighter_limits_than_the_rig(self, bench, tmp_path, limits, named):
        run = run_of(bench, tmp_path, changed_dwell(limits=limits))
        with pytest.raises(LimitExceeded, match=named):
            list(run)
        assert_silent_and_finished(bench, RecordingState.FAILED)
