"""Every stop and every fault in every state of a run ends silent, with a readable recording and a reason.

Silence is checked in the simulated world, at the generator's terminal. Times are rig time, from the cause to
the end of the run, which is later than the silence of the drive. All combinations take minutes (``pytest -m
slow``); otherwise each state is combined with stops and faults separately.
"""

import itertools
import os
import shutil
import signal
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from time import monotonic

import numpy as np
import pytest

from vibench.acquisition import (
    AcquisitionError,
    InstrumentLost,
    RecordingError,
    StopLevel,
    open_bench,
    open_recording,
    stop_on_signal,
)
from vibench.acquisition.instruments import Block
from vibench.acquisition.plan import Dwell, Measurement, RunState, shortest_ramp_s
from vibench.acquisition.recording import RecordingState, create_recording, recover
from vibench.acquisition.run.acquisition_loop import BLOCK_S
from vibench.acquisition.run.run import Run
from vibench.acquisition.run.silence_watch import SilenceWatch
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .ending_silent import bench_on, terminal_v, upto

RAMP_S = 0.3
PLAN = Measurement(
    name="run",
    excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.5, duration_s=1.0),
    ramp_s=RAMP_S,
    ramp_step_s=0.03,
)
STATES = [
    RunState.CHECKING,
    RunState.RAMPING_UP,
    RunState.SETTLING,
    RunState.RECORDING,
    RunState.HELD,
    RunState.RAMPING_DOWN,
]
SILENT_V = 1e-2


@dataclass(frozen=True)
class Stop:
    """A way to stop, and the longest time to silence [s]; None if the plan is completed."""

    press: Callable[[Run], None]
    reason: str
    silent_within_s: float | None


def ask(level: StopLevel) -> Callable[[Run], None]:
    return lambda run: run.switch.ask(StopRequest(Cause.OPERATOR, level, f"{level} pressed"))


def send(number: signal.Signals) -> Callable[[Run], None]:
    return lambda run: os.kill(os.getpid(), number)


ABORT_S = BLOCK_S + 0.09
"""The block being read, and three periods of the loaded shaker (checked below)."""
STOPS = {
    "nothing": Stop(lambda run: None, "", None),
    "ramp": Stop(ask(StopLevel.RAMP), "ramp pressed", BLOCK_S + RAMP_S),
    "abort": Stop(ask(StopLevel.ABORT), "abort pressed", ABORT_S),
    "off": Stop(ask(StopLevel.OFF), "off pressed", BLOCK_S),
    "ramp then off": Stop(
        lambda run: (ask(StopLevel.RAMP)(run), ask(StopLevel.OFF)(run)), "off pressed", BLOCK_S
    ),
    "SIGINT": Stop(send(signal.SIGINT), "SIGINT", BLOCK_S + RAMP_S),
    "SIGTERM": Stop(send(signal.SIGTERM), "SIGTERM", ABORT_S),
    "viewer gone": Stop(
        lambda run: run.switch.ask(StopRequest.of(Cause.VIEWER_GONE, "nobody looks")), "nobody looks", ABORT_S
    ),
    "program left": Stop(lambda run: run.close(), "abandoned", ABORT_S),
}


@dataclass(frozen=True)
class Fault:
    """A fault, and whether it ends the run."""

    happens: Callable[[object], None]
    ends_the_run: bool
    is_reachable: bool = True
    """Whether commands still reach the generator."""
    is_left_in_peace: bool = True
    """Whether the bench can be closed without an error."""


FAULTS = {
    "none": Fault(lambda faults: None, ends_the_run=False),
    "usb unplugged": Fault(
        lambda faults: faults.pull_usb_cable(), ends_the_run=False, is_reachable=False, is_left_in_peace=False
    ),
    "buffer overrun": Fault(lambda faults: faults.overrun(), ends_the_run=True),
    "device reserved": Fault(lambda faults: faults.fail_daq("ReadAnalogF64", -50103), ends_the_run=True),
    "server gone": Fault(lambda faults: faults.lose_daq_server(), ends_the_run=True, is_left_in_peace=False),
    "laser dropout": Fault(lambda faults: faults.drop_laser(0.2), ends_the_run=False),
    "over-range": Fault(lambda faults: faults.over_range(0.2), ends_the_run=False),
    "disk full": Fault(lambda faults: None, ends_the_run=True),
}
SILENT_AFTER_FAULT_S = BLOCK_S
"""Instruments that still answer are silenced without another block."""


class FullDisk:
    """A recorder whose disk can be filled at any moment."""

    def __init__(self) -> None:
        self.is_full = False

    def create(self, path, header):
        writer = create_recording(path, header)
        write = writer._disk.write

        def refuse_when_full(offset, data):
            if self.is_full:
                raise OSError(28, "No space left on device")
            write(offset, data)

        writer._disk.write = refuse_when_full
        return writer


def bring_to(run, state):
    upto(run, RunState.RECORDING if state is RunState.HELD else state)
    if state is RunState.HELD:
        run.switch.hold()
        upto(run, state)


def press_stop(stop, run):
    """Stop the run; return the error that leaving the run raised, if any."""
    try:
        stop.press(run)
    except AcquisitionError as error:
        return error
    return None


def run_to_end(run):
    """Iterate to the end of the run; return the error that it raised, if any."""
    try:
        for _ in run:
            if run.state is RunState.HELD:
                run.switch.resume()
    except AcquisitionError as error:
        return error
    return None


def carry_out(laboratory, tmp_path, state, stop, fault_name):
    fault = FAULTS[fault_name]
    virtual, connected = laboratory()
    disk = FullDisk()
    run, error, cause_s, end_s = None, None, 0.0, 0.0
    try:
        with bench_on(connected) as bench:
            run = Run(bench, PLAN, tmp_path / "run.h5", create=disk.create)
            with stop_on_signal(run.switch), run:
                bring_to(run, state)
                fault.happens(virtual.faults)
                disk.is_full = fault_name == "disk full"
                cause_s = virtual.world.time_s
                error = press_stop(stop, run) or run_to_end(run)
            end_s = virtual.world.time_s
            if fault.is_reachable:
                assert terminal_v(virtual) < SILENT_V
    except InstrumentLost as lost:
        assert not fault.is_left_in_peace
        error = error or lost
    check_silence(virtual, fault, error)
    check_time(stop, fault, error, state, end_s - cause_s)
    check_recording(tmp_path / "run.h5", run, stop, error, disk)


def check_silence(virtual, fault, error):
    """Require silence, or an error that says that the output may still be on."""
    if not fault.is_reachable and error is not None:
        said = "".join([str(error), *getattr(error, "__notes__", [])])
        assert "MAY STILL BE ON" in said or terminal_v(virtual) < SILENT_V
    if not fault.is_reachable:
        virtual.faults.heal()


def check_time(stop, fault, error, state, took_s):
    if error is not None and fault.ends_the_run:
        assert took_s <= SILENT_AFTER_FAULT_S + 1e-3
    elif stop.silent_within_s is not None and fault.is_reachable:
        # A ramp down that has begun is completed first, unless a faster stop is requested.
        under_way_s = RAMP_S if state is RunState.RAMPING_DOWN else 0.0
        assert took_s <= stop.silent_within_s + under_way_s + 1e-3


def check_recording(path, run, stop, error, disk):
    if disk.is_full and not path.exists():
        # No end could be written to the full disk: the committed samples are recovered.
        disk.is_full = False
        recover(path)
        with open_recording(path) as recording:
            assert recording.samples >= 0
        return
    with open_recording(path) as recording:
        assert recording.samples > 0
        match run.outcome.state:
            case RunState.FINISHED:
                assert recording.state is RecordingState.COMPLETE
            case RunState.STOPPED:
                assert recording.state is RecordingState.STOPPED
                assert stop.reason in recording.reason or stop.reason in str(recording.events)
            case RunState.FAILED:
                assert recording.state is RecordingState.FAILED
                assert error is not None
                assert type(error).__name__ in recording.reason or str(error)[:40] in recording.reason


def third_of_pairs(ways):
    """Return each stop in a third of the states and each state with a third of the stops."""
    pairs = [(i, j) for i in range(len(ways)) for j in range(len(STATES)) if (i + j) % 3 == 0]
    return [(STATES[j], ways[i]) for i, j in pairs]


@pytest.mark.thorough
@pytest.mark.parametrize(("state", "stop"), third_of_pairs(list(STOPS)))
def test_every_stop_in_every_state_ends_in_silence_with_a_reason(laboratory, tmp_path, state, stop):
    carry_out(laboratory, tmp_path, state, STOPS[stop], "none")


@pytest.mark.thorough
@pytest.mark.parametrize(("state", "fault"), third_of_pairs([name for name in FAULTS if name != "none"]))
def test_every_fault_in_every_state_ends_in_silence_and_states_a_reason(laboratory, tmp_path, state, fault):
    carry_out(laboratory, tmp_path, state, STOPS["nothing"], fault)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("state", "stop", "fault"),
    list(itertools.product(STATES, STOPS, FAULTS)),
)
def test_every_stop_with_and_without_a_fault_ends_in_silence(laboratory, tmp_path, state, stop, fault):
    carry_out(laboratory, tmp_path, state, STOPS[stop], fault)


def test_the_stated_time_to_silence_of_an_abort_matches_the_shipped_rig(rig):
    assert shortest_ramp_s(rig) + BLOCK_S < ABORT_S


@pytest.mark.thorough
@pytest.mark.parametrize("state", [RunState.RAMPING_UP, RunState.RECORDING, RunState.RAMPING_DOWN])
@pytest.mark.parametrize("what", ["removed", "moved"])
def test_a_removed_folder_ends_the_run_in_silence_with_an_error(laboratory, tmp_path, state, what):
    virtual, connected = laboratory()
    folder = tmp_path / "recordings"
    folder.mkdir()
    with bench_on(connected) as bench:
        run = Run(bench, PLAN, folder / "run.h5")
        upto(run, state)
        shutil.rmtree(folder) if what == "removed" else folder.rename(tmp_path / "elsewhere")
        with pytest.raises(RecordingError, match="was removed") as told:
            deque(run, maxlen=0)
        assert terminal_v(virtual) < SILENT_V
    assert "\n" not in str(told.value)
    assert run.outcome.state is RunState.FAILED
    if what == "moved":  # and moved back, so that nothing is lost
        assert recover(tmp_path / "elsewhere" / "run.h5").exists()


def slow_rig(rig):
    """Return the rig with a generator that needs 0.1 s for a setting, as real ones may."""
    return rig.model_copy(update={"generator": rig.generator.model_copy(update={"settle_s": 0.1})})


LOST_WITHIN_S, ABORTED_WITHIN_S = 1.1, 1.17
"""Real time, as stated in docs/safety.md."""


@pytest.mark.thorough
def test_a_slow_generator_is_silenced_in_time_when_samples_are_lost(laboratory, tmp_path):
    """A ramp of 20 steps with a setting each would take two seconds."""
    virtual, connected = laboratory()
    with bench_on(slow_rig(connected)) as bench:
        stop, off_s = bench.generator.stop, []
        bench.generator.stop = lambda: (stop(), off_s.append(monotonic()))
        with Run(bench, PLAN.model_copy(update={"ramp_step_s": 0.015}), tmp_path / "run.h5") as run:
            upto(run, RunState.RECORDING)
            virtual.faults.overrun()
            off_s.clear()
            lost_s = monotonic()
            assert run_to_end(run) is not None
        assert off_s[0] - lost_s < LOST_WITHIN_S
        assert terminal_v(virtual) < SILENT_V


@pytest.mark.thorough
def test_a_run_with_a_slow_generator_is_silent_within_the_stated_time_after_an_abort(rig, tmp_path):
    assert rig.virtual is not None
    on_the_wall = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": "wall"})})
    plan = PLAN.model_copy(update={"ramp_step_s": 0.015})
    with open_bench(slow_rig(on_the_wall)) as bench, Run(bench, plan, tmp_path / "run.h5") as run:
        upto(run, RunState.RECORDING)
        run.switch.ask(StopRequest(Cause.OPERATOR, StopLevel.ABORT, "abort"))
        for _ in run:
            pass
    with open_recording(tmp_path / "run.h5") as recording:
        said = next(each.text for each in recording.events if each.kind == "silence")
    assert float(said.removeprefix("abort: ").partition(" ")[0]) < ABORTED_WITHIN_S


@pytest.mark.parametrize("offset_v", [0.0, 0.3])
def test_the_time_to_silence_does_not_depend_on_the_length_of_the_block_in_which_the_drive_ends(
    rig, offset_v
):
    with open_bench(rig) as bench:
        watch = SilenceWatch(bench.channels, 1000.0)
        volts = np.full((len(bench.channels), 400), offset_v)
    volts[:, :50] += np.linspace(1.0, 0.1, 50)
    watch.begin(0)
    watch.take(Block(first_sample=0, volts=volts))
    watch.take(Block(first_sample=400, volts=volts[:, 380:]))
    assert watch.text().startswith("0.050 s after the stop was seen, silence was measured")


@pytest.mark.thorough
def test_after_an_abort_in_real_time_recording_continues_until_the_drive_is_silent(rig, tmp_path):
    assert rig.virtual is not None
    on_the_wall = rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"pace": "wall"})})
    with open_bench(on_the_wall) as bench, Run(bench, PLAN, tmp_path / "run.h5") as run:
        upto(run, RunState.RECORDING)
        Event().wait(0.7)  # a stalled process later reads samples of the past
        run.switch.ask(StopRequest(Cause.OPERATOR, StopLevel.ABORT, "abort"))
        for _ in run:
            pass
    with open_recording(tmp_path / "run.h5") as recording:
        drive = recording.read("drive_voltage")
        stopped = next(each.sample for each in recording.events if each.kind == "end")
        said = next(each.text for each in recording.events if each.kind == "silence")
        rate_hz = recording.sample_rate_hz
    assert np.max(np.abs(drive[-round(0.01 * rate_hz) :])) < SILENT_V
    measured_s = (np.flatnonzero(np.abs(drive) > SILENT_V)[-1] - stopped) / rate_hz
    told_s = float(said.removeprefix("abort: ").partition(" ")[0])
    assert told_s > 0.6  # the delay until the stop was noticed
    assert told_s == pytest.approx(measured_s, abs=0.02)
