"""The drive guard silences a stalled run; a stop is confirmed only when the output is off."""

import os
import threading
from pathlib import Path
from threading import Event
from time import monotonic

import pytest

from tests.changed import changed
from vibench.acquisition import (
    AcquisitionError,
    InstrumentLost,
    StopLevel,
    StopSwitch,
    open_bench,
    open_recording,
    run_measurement,
)
from vibench.acquisition.errors import RunStalled
from vibench.acquisition.host.beside import Beside
from vibench.acquisition.plan import Dwell, Measurement, RunState
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.run import silence_watch as drive_guard
from vibench.acquisition.run.run import Run
from vibench.acquisition.run.silence_watch import DriveGuard
from vibench.acquisition.stopping.program import (
    Program,
    announce_program,
    engines_folder,
    facts_of_this_process,
)
from vibench.acquisition.stopping.stop import DRIVES_ON, MEMORY_RESERVE, Cause, StopRequest
from vibench.sim.operating_system.this import process_start
from vibench.stop_files import Fate, answer_path, fate_of, stop_path, write_stop_file

from .ending_silent import bench_on, terminal_v, upto

PLAN = Measurement(
    name="run",
    excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.2, duration_s=60.0),
    ramp_s=0.3,
    ramp_step_s=0.03,
)
SILENT_V = 1e-2


def until(is_so, within_s=20.0):
    give_up_s, pause = monotonic() + within_s, Event()
    while not is_so():
        assert monotonic() < give_up_s
        pause.wait(0.01)


@pytest.fixture
def recording(laboratory, tmp_path, monkeypatch):
    """Yield the virtual rig and a run in its dwell that proceeds only when iterated."""
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path / "state"))
    virtual, connected = laboratory()
    with bench_on(connected) as bench, Run(bench, PLAN, tmp_path / "run.h5") as run:
        upto(run, RunState.RECORDING)
        yield virtual, run


@pytest.mark.thorough
def test_a_stalled_run_is_silenced(recording, monkeypatch):
    virtual, run = recording
    assert terminal_v(virtual) > 0.5
    monkeypatch.setattr(drive_guard, "STANDSTILL_BLOCKS", 3)
    until(lambda: terminal_v(virtual) < SILENT_V)
    assert run.switch.request.cause is Cause.FAULT
    assert not DRIVES_ON
    with pytest.raises(RunStalled, match="read no samples for 5 s"):
        list(run)
    assert run.outcome.state is RunState.FAILED
    with open_recording(run.outcome.path) as recorded:
        assert recorded.state is RecordingState.FAILED
        assert recorded.reason.startswith("the run read no samples for 5 s; its output was switched off")


@pytest.mark.thorough
def test_a_stalled_run_is_silenced_sooner_after_a_stop(recording):
    virtual, run = recording
    run.switch.ask(StopRequest(Cause.TERMINATED, StopLevel.ABORT, "SIGTERM"))
    until(lambda: terminal_v(virtual) < SILENT_V, drive_guard.STOPPED_BLOCKS * 0.1 + 3.0)


@pytest.mark.thorough
def test_a_continuing_run_is_not_silenced(recording, monkeypatch):
    virtual, run = recording
    monkeypatch.setattr(drive_guard, "STANDSTILL_BLOCKS", 5)
    began_s = monotonic()
    for _ in run:
        if monotonic() - began_s > 1.5:
            break
    assert run.switch.request is None
    assert terminal_v(virtual) > 0.5


@pytest.mark.thorough
def test_a_stop_is_not_confirmed_by_the_silence_of_another_generator(recording, rig, tmp_path):
    """One script may drive two benches, each in its own thread."""
    north, _ = recording
    other = changed(rig, generator={"resource": "USB0::0x0699::0x0353::C010001::INSTR"})
    with open_bench(other) as south:
        short = changed(PLAN, excitation={"duration_s": 0.2})
        assert run_measurement(south, short, tmp_path / "south.h5").state is RunState.FINISHED
    assert terminal_v(north) > 0.5
    assert DRIVES_ON


class Output:
    """A drive whose output fails to switch off once for each given failure."""

    def __init__(self, *failures):
        self.failures = list(failures)
        self.is_off = False

    def silence(self):
        if self.failures:
            raise self.failures.pop(0)
        self.is_off = True

    cut = silence


@pytest.fixture
def own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))


def request_stop(level="abort"):
    stop = stop_path(str(engines_folder()), *own_process(), level)
    write_stop_file(stop, "smoke")
    return stop


def own_process():
    facts = facts_of_this_process("dwell")
    return facts["pid"], process_start(facts["pid"])


@pytest.fixture
def announced(own_state):
    with announce_program(lambda level, reason: None, Program.model_validate(facts_of_this_process("dwell"))):
        yield


def test_a_stop_is_confirmed_only_after_the_output_is_off(announced):
    with DriveGuard(Output(), StopSwitch()) as guard:
        guard.begin()
        stop = request_stop()
        until(lambda: not Path(stop).exists())
        assert Path(answer_path(stop, "taken")).exists()
        guard.silence()
        assert fate_of(stop) is Fate.SILENT


def test_a_stop_is_not_confirmed_if_the_output_was_not_read_back(announced, monkeypatch):
    monkeypatch.setattr("vibench.stop_files.HEEDED_S", 0.5)
    guard = DriveGuard(Output(*[InstrumentLost("gone")] * 1000), StopSwitch())
    with guard:
        guard.begin()
        stop = request_stop()
        with pytest.raises(InstrumentLost):
            guard.silence()
    assert fate_of(stop) is Fate.UNCONFIRMED
    DRIVES_ON.confirm_silence(guard)


def test_a_stop_is_not_confirmed_while_the_drive_is_still_measured(announced, monkeypatch):
    monkeypatch.setattr("vibench.stop_files.HEEDED_S", 0.5)
    guard = DriveGuard(Output(), StopSwitch(), is_heard=lambda: True)
    with guard:
        guard.begin()
        stop = request_stop()
        guard.silence()
    assert fate_of(stop) is Fate.UNCONFIRMED
    DRIVES_ON.confirm_silence(guard)


def test_a_stop_is_not_confirmed_by_an_emptied_state_folder(announced, monkeypatch):
    monkeypatch.setattr("vibench.stop_files.HEEDED_S", 0.5)
    with DriveGuard(Output(), StopSwitch()) as guard:
        guard.begin()
        stop = request_stop()
        until(lambda: not Path(stop).exists())
        for each in engines_folder().iterdir():
            each.unlink()
        assert fate_of(stop) is Fate.UNCONFIRMED
        guard.silence()
        assert fate_of(stop) is Fate.SILENT


def test_the_confirmation_of_an_earlier_stop_does_not_confirm_a_later_stop(own_state, monkeypatch):
    monkeypatch.setattr("vibench.stop_files.HEEDED_S", 0.5)
    stop = stop_path(str(engines_folder()), *own_process(), "abort")
    Path(answer_path(stop, "silent")).touch()
    os.utime(answer_path(stop, "silent"), (1.0, 1.0))
    write_stop_file(stop, "smoke")
    removing = threading.Timer(0.1, Path(stop).unlink)
    removing.start()
    assert fate_of(stop) is Fate.UNCONFIRMED
    removing.join()


@pytest.mark.thorough
def test_a_stop_is_confirmed_after_a_ramp_longer_than_the_timeout(announced, monkeypatch):
    monkeypatch.setattr("vibench.stop_files.HEEDED_S", 0.5)
    with DriveGuard(Output(), StopSwitch()) as guard:
        guard.begin()
        stop, pause = request_stop("ramp"), Event()

        def ramp_down():
            for _ in range(20):
                guard.advance()
                pause.wait(0.1)
            guard.silence()

        ramp = threading.Thread(target=ramp_down)
        ramp.start()
        assert fate_of(stop) is Fate.SILENT
        ramp.join()


def test_a_memory_error_frees_the_memory_reserve_and_switches_the_output_off():
    output = Output(MemoryError())
    with DriveGuard(output, StopSwitch()) as guard:
        guard.begin()
        assert MEMORY_RESERVE._held is not None
        guard.silence()
    assert output.is_off
    assert MEMORY_RESERVE._held is None
    assert not DRIVES_ON


def test_a_run_without_a_memory_reserve_is_refused(monkeypatch):
    MEMORY_RESERVE.release()

    def refuse_memory(*_):
        raise OSError(12, "Cannot allocate memory")

    monkeypatch.setattr("mmap.mmap", refuse_memory)
    with pytest.raises(AcquisitionError, match="can get no more memory"):
        DriveGuard(Output(), StopSwitch())


def test_background_jobs_of_a_run_start_no_new_thread(monkeypatch):
    beside, done = Beside("test"), []
    monkeypatch.setattr(threading.Thread, "start", lambda self: pytest.fail("a thread was started"))
    beside.do(lambda: done.append(1))
    beside.wait(20)
    beside.do(lambda: done.append(2))
    beside.close(20)
    assert done == [1, 2]


@pytest.mark.thorough
def test_a_drive_guard_that_fails_to_silence_a_drive_warns_once_and_tries_again(monkeypatch, caplog):
    monkeypatch.setattr(drive_guard, "STANDSTILL_BLOCKS", 1)
    output = Output(*[InstrumentLost("THE OUTPUT MAY STILL BE ON")] * 3)
    with caplog.at_level("INFO"), DriveGuard(output, StopSwitch()) as guard:
        guard.begin()
        until(lambda: output.is_off)
        until(lambda: not DRIVES_ON)
    assert [record.getMessage() for record in caplog.records] == ["THE OUTPUT MAY STILL BE ON"]
    assert not caplog.records[0].exc_info
