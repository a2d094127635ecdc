"""Runs with a generator that needs time for each command while samples are converted."""

from collections import deque
from contextlib import suppress

import numpy as np
import pytest

from vibench.acquisition.errors import ConfigurationError, DriveLate
from vibench.acquisition.plan import Dwell, Measurement, SineSweep, SteppedSine
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.run.run import Run

RATE = 5120.0
DRIVE = 0
RAMP = {"ramp_s": 0.4, "ramp_step_s": 0.1}


def dwell():
    excitation = Dwell(amplitude_vpp=1.0, frequency_hz=260.0, settle_s=0.3, duration_s=0.5)
    return Measurement(name="dwell", excitation=excitation, **RAMP)


def sweep(step_s, **changes):
    ends = {"start_hz": 150.0, "stop_hz": 250.0, **changes}
    excitation = SineSweep(amplitude_vpp=1.0, duration_s=4.0, step_s=step_s, settle_s=0.3, **ends)
    return Measurement(name="sweep", excitation=excitation, **RAMP)


def segment_drive(bench, label):
    """Return the drive voltage of a segment."""
    found = next(each for each in bench.recorder.segments if each["label"] == label)
    return bench.recorder.channel(DRIVE)[found["first"] : found["last"] + 1]


def run_of(bench, plan, tmp_path):
    return Run(bench, plan, tmp_path / "run.h5", create=bench.recorder.create)


def carry_out(bench, plan, tmp_path):
    with run_of(bench, plan, tmp_path) as run:
        deque(run, maxlen=0)
    return bench.recorder


def cycles(drive):
    """Return the number of cycles of a sine with constant amplitude, including fractions at both ends."""
    up = np.flatnonzero((drive[:-1] < 0) & (drive[1:] >= 0))
    exact = up + drive[up] / (drive[up] - drive[up + 1])
    first, last = exact[1] - exact[0], exact[-1] - exact[-2]
    return len(exact) - 1 + exact[0] / first + (drive.size - exact[-1]) / last


@pytest.mark.parametrize("latency_s", [0.02, 0.1, 0.2, 0.35])
def test_the_low_level_check_waits_until_commands_have_taken_effect(bench, tmp_path, latency_s):
    bench.world.latency_s = latency_s
    recorder = carry_out(bench, dwell(), tmp_path)
    assert recorder.ending[0] is RecordingState.COMPLETE
    # The recorded dwell contains only its tone, from the first to the last sample.
    drive = segment_drive(bench, "dwell")
    assert drive.size == pytest.approx(0.5 * RATE, abs=1)
    assert cycles(drive) == pytest.approx(130.0, abs=0.05)


@pytest.mark.parametrize("latency_s", [0.0, 0.05, 0.3])
def test_settling_starts_when_the_tone_plays(bench, tmp_path, latency_s):
    bench.world.latency_s = latency_s
    grid = {"start_hz": 200.0, "stop_hz": 260.0, "step_hz": 20.0}
    excitation = SteppedSine(amplitude_vpp=1.0, grid=grid, settle_s=0.2, record_s=0.3)
    recorder = carry_out(bench, Measurement(name="steps", excitation=excitation, **RAMP), tmp_path)
    steps = [each for each in recorder.segments if each["label"] == "step"]
    assert len(steps) == 4
    for each in steps:
        drive = recorder.channel(DRIVE)[each["first"] : each["last"] + 1]
        assert cycles(drive) == pytest.approx(0.3 * each["numbers"]["frequency_hz"], abs=0.1)


@pytest.mark.parametrize("latency_s", [0.0, 0.02, 0.05, 0.1])
@pytest.mark.parametrize("step_s", [0.02, 0.05, 0.1, 0.2, 0.5])
def test_a_sweep_on_a_slow_generator_is_played_correctly_or_refused(bench, tmp_path, latency_s, step_s):
    bench.world.latency_s = latency_s
    plan = sweep(step_s)
    if step_s < 1.25 * latency_s:
        with pytest.raises(ConfigurationError, match=f"step_s = {step_s:g} s is too short.*for each setting"):
            carry_out(bench, plan, tmp_path)
        assert not bench.world.calls
        return
    carry_out(bench, plan, tmp_path)
    # A command takes effect when it ends. The sweep lags by the duration of a command, also at its end.
    late = latency_s * (plan.excitation.stop_hz - plan.excitation.start_hz) * (1 - step_s / 4.0)
    assert cycles(segment_drive(bench, "sweep")) == pytest.approx(plan.excitation.cycles(4.0) - late, abs=0.1)


def test_a_ramp_is_extended_to_the_time_that_its_commands_take(bench, tmp_path):
    bench.world.latency_s = 0.25
    with run_of(bench, dwell(), tmp_path) as run:
        most = [bench.digitizer.waiting_samples / RATE for _ in run]
    assert max(most) <= 3 * 0.25
    up = segment_drive(bench, "ramp_up")
    # one command for the tone, one for its output, and four amplitude steps
    assert up.size / RATE == pytest.approx(6 * 0.25, abs=0.01)


def test_a_drive_that_lags_its_plan_ends_the_run_with_an_error(bench, tmp_path):
    plan = sweep(0.05)
    bench.world.latency_s = 0.02
    with run_of(bench, plan, tmp_path) as run:
        next(each for each in run if each.frequency_hz is not None and each.frequency_hz > 180.0)
        bench.world.latency_s = 0.2
        with pytest.raises(
            DriveLate, match=r"^the drive was 1.* s behind the plan at 1.* Hz, .* lasts 0.05 s"
        ):
            deque(run, maxlen=0)
    assert bench.recorder.ending[0] is RecordingState.FAILED
    assert not bench.world.is_on
    late = [text for _, kind, text in bench.recorder.events if kind == "late"]
    assert len(late) > 4, "what is over sooner was a busy computer"


@pytest.mark.parametrize("stall_s", [0.25, 0.8])
def test_a_single_late_command_is_noted_and_the_run_continues(bench, tmp_path, stall_s):
    bench.world.latency_s = 0.02
    plan = sweep(0.1)
    with run_of(bench, plan, tmp_path) as run:
        next(each for each in run if each.frequency_hz is not None and each.frequency_hz > 180.0)
        bench.world.convert(round(stall_s * RATE))
        deque(run, maxlen=0)
    assert bench.recorder.ending[0] is RecordingState.COMPLETE
    assert [kind for _, kind, _ in bench.recorder.events].count("late") in range(2, round(stall_s / 0.1) + 5)
    # The sweep catches up after the pause; at its end it lags by the time of one command, which is noted.
    late = 0.02 * (plan.excitation.stop_hz - plan.excitation.start_hz)
    assert cycles(segment_drive(bench, "sweep")) == pytest.approx(plan.excitation.cycles(4.0) - late, abs=0.1)
    *_, last = (text for _, kind, text in bench.recorder.events if kind == "late")
    assert "cycles off the planned phase" in last


@pytest.mark.parametrize("seed", range(6))
def test_a_sweep_stays_within_its_frequencies_despite_computer_stalls(bench, tmp_path, seed):
    """Stalls once led to set frequencies of -186 Hz and 1,451 Hz in a sweep from 20 Hz to 600 Hz."""
    chance = np.random.default_rng(seed)
    bench.world.latency_s = 0.005
    with suppress(DriveLate), run_of(bench, sweep(0.1, start_hz=20.0), tmp_path) as run:
        for progress in run:
            if progress.frequency_hz is not None and chance.uniform() < 0.1:
                bench.world.convert(round(chance.uniform(0.05, 1.2) * RATE))
    asked = [each[1] for each in bench.world.calls if each[0] == "set_frequency"]
    assert min(asked) > 10.0
    assert max(asked) < 270.0
