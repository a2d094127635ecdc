"""A drive with a dead man's switch: bursts that end by themselves unless the run triggers them again."""

from collections import deque
from itertools import pairwise

import numpy as np
import pytest

from vibench.acquisition import ConfigurationError, StopLevel, open_bench, open_recording, run_campaign
from vibench.acquisition.bench import Verdict
from vibench.acquisition.check.bench_report import bench_report
from vibench.acquisition.plan import CHECK_FREQUENCY_HZ, Campaign, Dwell, Measurement, RunState
from vibench.acquisition.plan._schedule import CHECK_LISTEN_S, CHECK_SETTLE_S
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import OutputUse, load_rig
from vibench.acquisition.run.generator_drive import CHECK_MARGIN_S, GUARD_S
from vibench.acquisition.run.run import Run
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .ending_silent import bench_on, upto

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
    """Yield a virtual rig, and a bench on it whose generator has a dead man's switch."""
    virtual, connected = laboratory()
    generator = connected.generator.model_copy(update={"dead_man_s": DEAD_MAN_S})
    connected = connected.model_copy(update={"generator": generator})
    with bench_on(connected) as bench:
        yield virtual, bench


def terminal(virtual, duration_s):
    """Return the voltage at the generator's terminal while the program is idle."""
    start_s = virtual.world.time_s
    return virtual.generator.render(start_s, 1e-4, round(duration_s / 1e-4))


def test_a_stalled_run_is_silent_after_the_last_burst(guarded, tmp_path):
    virtual, bench = guarded
    with Run(bench, PLAN, tmp_path / "run.h5") as run:
        upto(run, RunState.RECORDING)
        volts = terminal(virtual, 2 * DEAD_MAN_S)
        loud = np.flatnonzero(np.abs(volts) > LOUD_V)
        assert loud.size  # the output was playing
        assert loud[-1] * 1e-4 <= DEAD_MAN_S
    assert run.outcome.state is RunState.STOPPED


def test_the_low_level_check_is_silent_after_its_burst(guarded, tmp_path):
    virtual, bench = guarded
    with Run(bench, PLAN, tmp_path / "run.h5") as run:
        next(progress for progress in run if progress.state is RunState.CHECKING and progress.amplitude_vpp)
        volts = terminal(virtual, 3.0)
        loud = np.flatnonzero(np.abs(volts) > 1e-3)
        assert loud.size
        assert loud[-1] * 1e-4 <= CHECK_SETTLE_S + CHECK_LISTEN_S + CHECK_MARGIN_S


@pytest.mark.thorough
@pytest.mark.parametrize("dead_man_s", [0.2, 5.0])
def test_a_dead_man_switch_does_not_change_the_value_of_the_low_level_check(laboratory, tmp_path, dead_man_s):
    _, connected = laboratory()
    found = []
    for each_s in (None, dead_man_s):
        generator = connected.generator.model_copy(update={"dead_man_s": each_s})
        with bench_on(connected.model_copy(update={"generator": generator})) as bench:
            path = tmp_path / f"{each_s}.h5"
            with Run(bench, PLAN, path) as run:
                upto(run, RunState.RAMPING_UP)
            with open_recording(path) as recording:
                text = next(each.text for each in recording.events if each.kind == "check")
            found.append(float(text.split()[1]))
    assert found[1] == pytest.approx(found[0], rel=0.01)


def test_the_bench_check_plays_one_burst_that_ends_by_itself(guarded, monkeypatch, tmp_path):
    _, bench = guarded
    cycles = []
    arm, trigger = bench.generator.arm_burst, bench.generator.trigger
    monkeypatch.setattr(bench.generator, "arm_burst", lambda count: (cycles.append(count), arm(count)))
    monkeypatch.setattr(bench.generator, "trigger", lambda: (cycles.append("trigger"), trigger()))
    report = bench_report(bench, tmp_path)
    assert len(cycles) == 2
    assert cycles[1] == "trigger"
    assert 3.5 * CHECK_FREQUENCY_HZ < cycles[0] <= (3.5 + CHECK_MARGIN_S) * CHECK_FREQUENCY_HZ
    assert report.verdict is Verdict.OK


@pytest.mark.thorough
def test_bursts_contain_whole_periods_and_are_separated_by_short_gaps(guarded, tmp_path):
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


def test_the_generator_can_play_continuously_again_after_a_run_with_bursts(guarded, tmp_path):
    virtual, bench = guarded
    with Run(bench, PLAN, tmp_path / "run.h5") as run:
        upto(run, RunState.RECORDING)
        run.switch.ask(StopRequest(Cause.OPERATOR, StopLevel.ABORT, "enough"))
        deque(run, maxlen=0)
    bench.generator.load_sine(100.0, 1.0)
    bench.generator.start()
    volts = terminal(virtual, 2.0)
    bench.generator.stop()
    assert np.max(np.abs(volts[-100:])) > LOUD_V


REFUSED = {
    "sweep": {"kind": "sine_sweep", "start_hz": 100, "stop_hz": 300, "duration_s": 2},
    "noise": {"kind": "multisine_noise", "band_start_hz": 20, "band_stop_hz": 400},
    "held level": {
        "kind": "held_dwell", "base_level": {"displacement_m": 1e-7}, "frequency_hz": 180, "duration_s": 2,
    },
    "slow sine": {"kind": "dwell", "frequency_hz": 1.5, "duration_s": 2},
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_plans_that_cannot_be_played_in_bursts_are_refused_before_the_campaign(kind, guarded, tmp_path):
    virtual, bench = guarded
    before_s = virtual.world.time_s
    refused = {"name": "second", "excitation": {"amplitude_vpp": 1.0, **REFUSED[kind]}}
    campaign = Campaign.model_validate({"name": "trial", "measurements": [PLAN.model_dump(), refused]})
    with pytest.raises(ConfigurationError, match="allows only sines of one frequency"):
        run_campaign(bench, campaign, tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert virtual.world.time_s == before_s


def test_a_dead_man_switch_with_an_analogue_output_is_refused(tmp_path):
    rig = load_rig("virtual_rig_streaming")
    generator = rig.generator.model_copy(update={"dead_man_s": DEAD_MAN_S})
    output = rig.daq.output.model_copy(update={"plays": OutputUse.TONES_AND_STREAMS})
    guarded = {"generator": generator, "daq": rig.daq.model_copy(update={"output": output})}
    with (
        open_bench(rig.model_copy(update=guarded)) as bench,
        pytest.raises(ConfigurationError, match="is played by the analogue output"),
    ):
        deque(Run(bench, PLAN, tmp_path / "run.h5"), maxlen=0)


def test_a_dead_man_switch_needs_a_channel_with_bursts(rig):
    content = rig.generator.model_dump() | {"dead_man_s": 1.0, "channel": 2}
    with pytest.raises(ValueError, match="only channel 1 has"):
        type(rig.generator).model_validate(content)
