"""Runs with feedback: every way to end them, refusals, and the recording that they leave."""

import json

import numpy as np
import pytest

from vibench.acquisition import ConfigurationError, LimitExceeded
from vibench.acquisition.excitation.plan import BaseLevel, Settling
from vibench.acquisition.plan import (
    CHECK_S,
    HeldDwell,
    HeldSweep,
    Measurement,
    RunState,
    SettledSine,
    duration_s,
)
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import OutputUse, Role
from vibench.acquisition.run.run import Run
from vibench.acquisition.run.silence_watch import LowLevelCheck
from vibench.acquisition.stopping.stop import Cause, StopRequest

SETTLING = Settling(longest_wait_s=2, tolerance=0.02)
# In the loop the base follows the model at 160 Hz; m0 does not move relative to the base.
DWELL = Measurement(
    name="held",
    excitation=HeldDwell(
        amplitude_vpp=1.0,
        frequency_hz=200,
        base_level=BaseLevel(acceleration_m_per_s2=5.0),
        settling=SETTLING,
        duration_s=1,
        update_s=0.5,
    ),
    ramp_s=0.2,
    ramp_step_s=0.02,
)


def run_of(bench, tmp_path, measurement=DWELL, check=LowLevelCheck.AT_LOW_LEVEL):
    return Run(bench, measurement, tmp_path / "run.h5", check, bench.recorder.create)


@pytest.mark.parametrize("check", LowLevelCheck)
def test_a_feedback_run_records_the_held_level_and_ends_in_silence(bench, tmp_path, check):
    states = {progress.state for progress in run_of(bench, tmp_path, check=check)}
    assert states >= {RunState.RAMPING_UP, RunState.SETTLING, RunState.RECORDING, RunState.RAMPING_DOWN}
    assert not bench.world.is_on
    assert bench.recorder.ending[0] is RecordingState.COMPLETE
    (dwell,) = [each for each in bench.recorder.segments if each["label"] == "dwell"]
    row = bench.digitizer.roles.index(Role.BASE_ACCELERATION.value)
    base = (
        bench.recorder.channel(row)[dwell["first"] : dwell["last"] + 1] * bench.channels[row].units_per_volt
    )
    assert np.sqrt(2) * np.std(base) == pytest.approx(5.0, rel=0.01)
    assert dwell["last"] - dwell["first"] + 1 == 5120


def test_a_feedback_run_is_not_longer_than_its_header_states(bench, tmp_path):
    list(run_of(bench, tmp_path))
    planned = round((CHECK_S + duration_s(DWELL)) * 5120)
    assert bench.recorder.header.expected_samples == planned
    assert bench.recorder.samples <= planned


@pytest.mark.parametrize("state", [RunState.RAMPING_UP, RunState.SETTLING, RunState.RECORDING])
@pytest.mark.parametrize("cause", [Cause.OPERATOR, Cause.EMERGENCY])
def test_a_stop_in_any_state_silences_a_feedback_run(bench, tmp_path, state, cause):
    run = run_of(bench, tmp_path)
    for progress in run:
        if progress.state is state:
            run.switch.ask(StopRequest.of(cause, "enough"))
    assert run.state is RunState.STOPPED
    assert not bench.world.is_on
    assert bench.recorder.ending == (RecordingState.STOPPED, "enough")


def test_a_hold_during_settling_does_not_change_the_level(bench, tmp_path):
    run = run_of(bench, tmp_path)
    held = 0
    for progress in run:
        if progress.state is RunState.SETTLING and held == 0:
            run.switch.hold()
        if progress.state is RunState.HELD:
            held += 1
            if held == 5:
                run.switch.resume()
    assert held == 5
    assert run.state is RunState.FINISHED
    level = [json.loads(text) for _, kind, text in bench.recorder.events if kind == "level"]
    assert {each["level"] for each in level} == {"within tolerance"}


def test_a_detached_accelerometer_ends_a_feedback_run_at_low_generator_voltage(bench, tmp_path):
    run = run_of(bench, tmp_path)
    while next(iter(run)).state is not RunState.RECORDING:
        pass
    bench.world.base_factor = 1e-4
    with pytest.raises(LimitExceeded, match="check the accelerometer"):
        list(run)
    assert not bench.world.is_on
    assert bench.recorder.ending[0] is RecordingState.FAILED
    settings = [value for _, value in bench.world.amplitudes()]
    assert max(settings) < 0.5


def test_a_base_level_beyond_the_planned_voltage_is_refused_before_output(bench, tmp_path):
    loud = DWELL.excitation.model_copy(update={"base_level": BaseLevel(acceleration_m_per_s2=50.0)})
    with pytest.raises(LimitExceeded, match=r"setting needed to hold the base's level \(at 200 Hz\)"):
        list(run_of(bench, tmp_path, DWELL.model_copy(update={"excitation": loud})))
    assert bench.world.calls == []


@pytest.mark.parametrize(
    "excitation",
    [
        SettledSine(amplitude_vpp=9.9, frequencies_hz=(20, 300), base_level=BaseLevel(displacement_m=1e-6)),
        HeldSweep(
            amplitude_vpp=9.9,
            start_hz=300,
            stop_hz=20,
            duration_s=10,
            base_level=BaseLevel(displacement_m=1e-6),
        ),
    ],
)
def test_limits_are_checked_at_the_largest_voltage_of_a_feedback_plan(bench, tmp_path, excitation):
    """One micrometre needs millivolts, but the allowed ten volts exceed the stroke limit at 20 Hz."""
    with pytest.raises(LimitExceeded, match="the stroke"):
        list(run_of(bench, tmp_path, Measurement(name="loud", excitation=excitation)))


def test_feedback_through_an_analogue_output_is_refused(streaming_bench, tmp_path):
    output = streaming_bench.rig.daq.output.model_copy(update={"plays": OutputUse.TONES_AND_STREAMS})
    daq = streaming_bench.rig.daq.model_copy(update={"output": output})
    streaming_bench.rig = streaming_bench.rig.model_copy(update={"daq": daq})
    with pytest.raises(ConfigurationError, match="connect the function generator"):
        list(run_of(streaming_bench, tmp_path))
    assert "write" not in {name for name, *_ in streaming_bench.world.calls}


def test_feedback_without_a_vibrometer_channel_is_refused(bench, tmp_path):
    bench.channels = tuple(each for each in bench.channels if each.role is not Role.M0_VELOCITY)
    with pytest.raises(ConfigurationError, match="m0_velocity"):
        list(run_of(bench, tmp_path))
    assert bench.world.calls == []
