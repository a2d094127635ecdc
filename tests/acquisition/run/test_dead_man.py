"""A drive that ends by itself: bursts that the run triggers again while it lives."""

from collections import deque
from itertools import pairwise

import numpy as np
import pytest

from vibench.acquisition import ConfigurationError, StopLevel, open_bench, open_recording
from vibench.acquisition.plan import Dwell, Measurement, RunState, SineSweep
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import CalibrationRule, confirm_simulated
from vibench.acquisition.run._generator_drive import GUARD_S
from vibench.acquisition.run._run import Run
from vibench.acquisition.stopping import Cause, StopRequest

DEAD_MAN_S = 0.5
FREQUENCY_HZ = 263.0
PLAN = Measurement(
    name="run",
    excitation=Dwell(amplitude_vpp=1.5, frequency_hz=FREQUENCY_HZ, settle_s=0.3, duration_s=3.0),
    ramp_s=0.3,
    ramp_step_s=0.03,
)
LOUD_V = 5e-3


@pytest.fixture
def guarded(laboratory):
    """A virtual rig, and a bench on it whose drive has a dead man."""
    virtual, connected = laboratory()
    generator = connected.generator.model_copy(update={"dead_man_s": DEAD_MAN_S})
    connected = connected.model_copy(update={"generator": generator})
    with open_bench(connected, confirm_simulated, CalibrationRule.WAIVED) as bench:
        yield virtual, bench


def terminal(virtual, duration_s):
    """What the generator gives while nobody does anything."""
    start_s = virtual.world.time_s
    return virtual.generator.render(start_s, 1e-4, round(duration_s / 1e-4))


def test_a_run_that_stands_still_is_silent_after_its_burst(guarded, tmp_path):
    virtual, bench = guarded
    with Run(bench, PLAN, tmp_path / "run.h5") as run:
        next(progress for progress in run if progress.state is RunState.RECORDING)
        volts = terminal(virtual, 2 * DEAD_MAN_S)
        loud = np.flatnonzero(np.abs(volts) > LOUD_V)
        assert loud.size  # it was playing
        assert loud[-1] * 1e-4 <= DEAD_MAN_S
    assert run.outcome.state is RunState.STOPPED


def test_the_bursts_are_whole_periods_with_short_gaps_between(guarded, tmp_path):
    _, bench = guarded
    with Run(bench, PLAN, tmp_path / "run.h5") as run:
        deque(run, maxlen=0)
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.state is RecordingState.COMPLETE
        dwell = next(each for each in recording.segments if each.label == "dwell")
        drive = recording.read("drive_voltage", dwell.first_sample, dwell.last_sample + 1)
        rate_hz = recording.sample_rate_hz
    loud = np.flatnonzero(np.abs(drive) > LOUD_V) / rate_hz
    gaps = [(a, b) for a, b in pairwise(loud) if b - a > 0.25 / FREQUENCY_HZ]
    assert len(gaps) >= 4
    for (_, begin_s), (end_s, _) in pairwise(gaps):
        assert (end_s - begin_s) * FREQUENCY_HZ == pytest.approx(int(DEAD_MAN_S * FREQUENCY_HZ), abs=0.1)
    assert max(b - a for a, b in gaps) < GUARD_S + 1e-3


def test_the_generator_plays_on_after_the_run(guarded, tmp_path):
    virtual, bench = guarded
    with Run(bench, PLAN, tmp_path / "run.h5") as run:
        next(progress for progress in run if progress.state is RunState.RECORDING)
        run.switch.ask(StopRequest(Cause.OPERATOR, StopLevel.ABORT, "enough"))
        deque(run, maxlen=0)
    bench.generator.load_sine(100.0, 1.0)
    bench.generator.start()
    volts = terminal(virtual, 2.0)
    bench.generator.stop()
    assert np.max(np.abs(volts[-100:])) > LOUD_V


def test_what_is_no_sine_of_one_frequency_is_refused_before_anything_plays(guarded, tmp_path):
    _, bench = guarded
    sweep = SineSweep(amplitude_vpp=1.0, start_hz=100, stop_hz=300, duration_s=2)
    with pytest.raises(ConfigurationError, match="no sine of one frequency"):
        deque(Run(bench, PLAN.model_copy(update={"excitation": sweep}), tmp_path / "run.h5"), maxlen=0)
    assert list(tmp_path.iterdir()) == []


def test_it_needs_the_channel_that_has_bursts(rig):
    content = rig.generator.model_dump() | {"dead_man_s": 1.0, "channel": 2}
    with pytest.raises(ValueError, match="channel 1 alone"):
        type(rig.generator).model_validate(content)
