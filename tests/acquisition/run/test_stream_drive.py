"""The states of a run on an analogue output, sample by sample, and every way to end it."""

import numpy as np
import pytest

from vibench.acquisition import InstrumentLost, LimitExceeded, Overload, RecordingError, StopLevel
from vibench.acquisition.errors import DataLost
from vibench.acquisition.plan import (
    CHECK_S,
    InRunLimits,
    Measurement,
    OnOverload,
    RunState,
    StreamedNoise,
    shortest_ramp_s,
)
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.run.run import Run
from vibench.acquisition.run.silence_watch import LowLevelCheck
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .ending_silent import upto

RATE = 5120.0
AHEAD = 2560
RAMP = 1024
NOISE = Measurement(
    name="noise",
    excitation=StreamedNoise(
        amplitude_vpp=1.0, band_start_hz=50, band_stop_hz=600, settle_s=0.35, duration_s=1.0, seed=7
    ),
    ramp_s=RAMP / RATE,
    ramp_step_s=0.02,
)
HEARD_STATES = [RunState.RAMPING_UP, RunState.SETTLING, RunState.RECORDING, RunState.RAMPING_DOWN]
every_state = pytest.mark.parametrize("state", [RunState.CHECKING, *HEARD_STATES])
heard_state = pytest.mark.parametrize("state", HEARD_STATES)


def run_of(bench, tmp_path, measurement=NOISE, check=LowLevelCheck.AT_LOW_LEVEL):
    return Run(bench, measurement, tmp_path / "run.h5", check, bench.recorder.create)


def run_upto(state, *given, **options):
    run = run_of(*given, **options)
    upto(run, state)
    return run


def drive(bench):
    return bench.recorder.channel(0) * bench.channels[0].units_per_volt


def planned_v(bench, count):
    """Return the planned noise at full level [V], from the first sample of the ramp on."""
    full_v = 0.5 * bench.rig.generator.terminal_factor()
    return full_v * NOISE.excitation.source.samples(0, count, RATE)


def ramp_first(bench):
    return next(each["first"] for each in bench.recorder.segments if each["label"] == "ramp_up")


def envelope(bench, first):
    """Return the samples whose source is large enough, and the level of the noise there."""
    heard = drive(bench)[first:]
    source = planned_v(bench, heard.size)
    telling = np.flatnonzero(np.abs(source) > 0.05)
    return telling, heard[telling] / source[telling]


def shortest_ramp(bench):
    return shortest_ramp_s(bench.rig) * RATE


def half_cosine(samples):
    return 0.5 * (1 - np.cos(np.pi * np.arange(samples) / samples))


def assert_silent_and_finished(bench, state):
    assert not bench.world.streams
    assert not bench.world.is_sampling
    assert bench.recorder.ending[0] is state
    order = [name for name, _, _ in bench.world.calls]
    assert order.index("output.stop") < order.index("recorder.finish")


def assert_faded_without_a_step(bench, ramp=RAMP):
    """Require that no level changes faster than on the half cosine of a ramp of ``ramp`` samples."""
    at, level = envelope(bench, ramp_first(bench))
    steepest = np.pi / 2 / ramp
    assert np.max(np.abs(np.diff(level)) / np.diff(at)) <= 1.01 * steepest
    assert level[-1] < 0.01


class TestCompleteRuns:
    @pytest.mark.parametrize("check", list(LowLevelCheck))
    def test_streamed_noise_is_played_as_planned_and_recorded_in_segments(
        self, streaming_bench, tmp_path, check
    ):
        shown = list(run_of(streaming_bench, tmp_path, check=check))
        assert shown[-1].elapsed_s == pytest.approx(shown[-1].total_s)
        assert streaming_bench.recorder.header.expected_samples == streaming_bench.recorder.samples
        begin = round(CHECK_S * RATE) + AHEAD if check is LowLevelCheck.AT_LOW_LEVEL else 0
        hold = round(1.35 * RATE)
        level = np.concatenate([half_cosine(RAMP), np.ones(hold), 1 - half_cosine(RAMP)])
        np.testing.assert_allclose(
            drive(streaming_bench)[begin:], level * planned_v(streaming_bench, level.size), atol=1e-12
        )

        found = {
            each["label"]: (each["first"], each["last"] + 1) for each in streaming_bench.recorder.segments
        }
        found.pop("check", None)
        noise = begin + RAMP + round(0.35 * RATE)
        end = noise + round(RATE)
        ramps = {"ramp_up": (begin, begin + RAMP), "ramp_down": (end, end + RAMP)}
        assert found == {**ramps, "noise": (noise, end)}

    def test_a_streamed_run_goes_through_the_same_states_as_a_generator_run(self, streaming_bench, tmp_path):
        run = run_of(streaming_bench, tmp_path)
        settings = {progress.state: progress.amplitude_vpp for progress in run}
        seen = list(settings)
        # Arming an output takes as long as the samples that are written ahead.
        assert seen == [RunState.CHECKING, RunState.ARMED, *HEARD_STATES]
        assert streaming_bench.recorder.states() == ["armed", *(state.value for state in HEARD_STATES)]
        assert run.state is RunState.FINISHED
        assert_silent_and_finished(streaming_bench, RecordingState.COMPLETE)
        assert settings[RunState.CHECKING] == pytest.approx(0.02)
        assert settings[RunState.RECORDING] == 1.0
        assert settings[RunState.RAMPING_DOWN] == pytest.approx(0.0, abs=1e-12)
        calls = {name for name, _, _ in streaming_bench.world.calls}
        assert calls.isdisjoint({"load_sine", "load_waveform", "start", "set_amplitude"})

    def test_only_the_check_level_is_written_before_the_check_passes(self, streaming_bench, tmp_path):
        run = run_upto(RunState.ARMED, streaming_bench, tmp_path)
        assert np.max(np.abs(streaming_bench.world.streamed)) <= 0.5 * 0.02
        run.close()

    def test_an_unarmed_output_plays_nothing(self, streaming_bench, tmp_path):
        streaming_bench.world.permanent["arm"] = lambda: InstrumentLost("no answer")
        with pytest.raises(InstrumentLost, match="no answer"):
            list(run_of(streaming_bench, tmp_path))
        assert "digitizer.start" not in [name for name, _, _ in streaming_bench.world.calls]
        assert_silent_and_finished(streaming_bench, RecordingState.FAILED)


class TestEndsOfARun:
    @every_state
    def test_a_cancelled_run_fades_out_after_the_written_samples(self, streaming_bench, tmp_path, state):
        run = run_of(streaming_bench, tmp_path)
        shown = upto(run, state)
        run.cancel("the operator pressed stop")
        rest = list(run)
        assert run.outcome.state is RunState.STOPPED
        assert streaming_bench.recorder.ending == (RecordingState.STOPPED, "the operator pressed stop")
        assert_silent_and_finished(streaming_bench, RecordingState.STOPPED)
        took_s = rest[-1].elapsed_s - shown.elapsed_s if rest else 0.0
        assert took_s <= (AHEAD + RAMP) / RATE + 0.1 + 1e-3
        if state is not RunState.CHECKING:
            assert_faded_without_a_step(streaming_bench)

    @every_state
    def test_an_abandoned_run_fades_out(self, streaming_bench, tmp_path, state):
        with run_of(streaming_bench, tmp_path) as run:
            upto(run, state)
        assert run.state is RunState.STOPPED
        assert_silent_and_finished(streaming_bench, RecordingState.STOPPED)
        if state is not RunState.CHECKING:
            assert_faded_without_a_step(streaming_bench, shortest_ramp(streaming_bench))

    @every_state
    def test_a_stream_over_a_limit_fades_out_and_the_limit_is_named(self, streaming_bench, tmp_path, state):
        run = run_upto(state, streaming_bench, tmp_path)
        streaming_bench.world.base_factor, streaming_bench.world.background_m_per_s2 = 1.0, 1000.0
        with pytest.raises(LimitExceeded, match=r"base acceleration reached 1.*736 m/s2 \(4809, bare table"):
            list(run)
        assert_silent_and_finished(streaming_bench, RecordingState.FAILED)
        if state is not RunState.CHECKING:
            assert_faded_without_a_step(streaming_bench, shortest_ramp(streaming_bench))

    def test_a_hold_request_ramps_down_a_stream_and_the_reason_is_stated(self, streaming_bench, tmp_path):
        run = run_upto(RunState.RECORDING, streaming_bench, tmp_path)
        assert "cannot be held" in run.switch.refusal_to_hold()
        run.switch.hold()
        list(run)
        assert run.outcome.state is RunState.STOPPED
        assert "cannot be held" in run.outcome.reason
        assert run.switch.request.reason == run.outcome.reason  # in a campaign this counts as a stop
        assert not run.switch.refusal_to_hold()
        assert_faded_without_a_step(streaming_bench)

    @heard_state
    def test_an_immediate_stop_discards_samples_already_written(self, streaming_bench, tmp_path, state):
        run = run_upto(state, streaming_bench, tmp_path)
        run.switch.ask(StopRequest(Cause.OPERATOR, StopLevel.OFF, "off"))
        (listened,) = list(run)  # until the silence after the cut
        assert listened.amplitude_vpp == 0.0
        assert_silent_and_finished(streaming_bench, RecordingState.STOPPED)

    def test_an_overload_fades_the_stream_out_if_the_plan_says_so(self, streaming_bench, tmp_path):
        strict = NOISE.model_copy(update={"limits": InRunLimits(on_overload=OnOverload.STOP)})
        run = run_upto(RunState.RECORDING, streaming_bench, tmp_path, strict)
        streaming_bench.world.overloads = (Overload("m0_velocity", 3, 5),)
        with pytest.raises(LimitExceeded, match="m0_velocity was overloaded at sample 3"):
            list(run)
        assert_faded_without_a_step(streaming_bench, shortest_ramp(streaming_bench))

    @heard_state
    @pytest.mark.parametrize(
        ("call", "fault"),
        [
            ("digitizer.read", DataLost),
            ("recorder.append", RecordingError),
            ("digitizer.read", KeyboardInterrupt),
        ],
    )
    def test_a_failing_input_fades_the_output_out_quickly(
        self, streaming_bench, tmp_path, state, call, fault
    ):
        world = streaming_bench.world
        run = run_upto(state, streaming_bench, tmp_path)
        world.faults[call] = [lambda: fault("it broke")]
        with pytest.raises(fault, match="it broke"):
            list(run)
        assert_silent_and_finished(
            streaming_bench,
            RecordingState.STOPPED if fault is KeyboardInterrupt else RecordingState.FAILED,
        )
        # The fade of 0.1 s had been played when the output was stopped.
        begin = round(CHECK_S * RATE) + AHEAD
        written = np.array(world.streamed)[begin:]
        source = planned_v(streaming_bench, written.size)
        telling = np.flatnonzero(np.abs(source) > 0.05)
        level = written[telling] / source[telling]
        assert np.max(np.abs(np.diff(level)) / np.diff(telling)) <= 1.01 * np.pi / 2 / (0.1 * RATE)
        sounding = np.flatnonzero(world.streamed)
        assert world.played > sounding[-1]

    @heard_state
    def test_a_failed_write_to_the_output_stops_the_output_at_once(self, streaming_bench, tmp_path, state):
        world = streaming_bench.world
        run = run_upto(state, streaming_bench, tmp_path)
        world.permanent["write"] = lambda: DataLost("the output ran out of samples")
        with pytest.raises(DataLost, match="ran out"):
            list(run)
        assert_silent_and_finished(streaming_bench, RecordingState.FAILED)

    @heard_state
    def test_an_output_that_does_not_stop_causes_an_alarm(self, streaming_bench, tmp_path, state):
        run = run_upto(state, streaming_bench, tmp_path)
        streaming_bench.world.permanent["output.stop"] = lambda: InstrumentLost("MAY STILL BE PLAYING")
        with pytest.raises(InstrumentLost, match="MAY STILL BE PLAYING"):
            list(run)
        assert run.state is RunState.FAILED
        assert "MAY STILL BE PLAYING" in streaming_bench.recorder.ending[1]
        assert not streaming_bench.world.is_sampling
