"""Slow, full and missing disks, and clock jumps: the run ends silent with an error and a recording."""

import errno
import os
import time
from collections import deque
from dataclasses import dataclass, field
from threading import Event, enumerate as threads
from types import SimpleNamespace

import numpy as np
import pytest

from vibench.acquisition import AcquisitionError, StopLevel, open_recording
from vibench.acquisition.plan import RunState
from vibench.acquisition.recording import RecordingState, _committer, create_recording, part_of, recover
from vibench.acquisition.run.run import Run
from vibench.acquisition.stopping.stop import Cause, StopRequest

from .ending_silent import bench_on, terminal_v, upto
from .test_stop_matrix import PLAN, SILENT_V

PAUSE = Event()


@dataclass
class BadDisk:
    """A recorder whose disk calls ``meet`` before every write and sync once ``is_bad`` is set."""

    meet: object
    is_bad: bool = False
    back: Event = field(default_factory=Event)

    def create(self, path, header):
        writer = create_recording(path, header)
        writer._committer._closing_patience_s = 0.5
        write, sync = writer._disk.write, writer._disk.sync

        def bad_write(offset, data):
            if self.is_bad:
                self.meet(self, memoryview(data).nbytes)
            write(offset, data)

        def bad_sync():
            if self.is_bad:
                self.meet(self, 0)
            sync()

        writer._disk.write, writer._disk.sync = bad_write, bad_sync
        return writer


def write_at_1_mb_per_s(disk, count):
    PAUSE.wait(count / 1e6)


def refuse_with(number):
    def refuse(disk, count):
        raise OSError(number, os.strerror(number))

    return refuse


def hang(disk, count):
    disk.back.wait()


DISKS = {
    "1 MB/s": write_at_1_mb_per_s,
    "full": refuse_with(errno.ENOSPC),
    "quota": refuse_with(errno.EDQUOT),
    "network gone": refuse_with(errno.ESTALE),
    "input/output error": refuse_with(errno.EIO),
    "network hangs": hang,
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", DISKS)
def test_every_disk_fault_ends_in_silence_with_an_error_and_a_recording(laboratory, tmp_path, name):
    virtual, connected = laboratory()
    disk, path, said = BadDisk(DISKS[name]), tmp_path / "run.h5", ""
    with bench_on(connected) as bench:
        try:
            with Run(bench, PLAN, path, create=disk.create) as run:
                upto(run, RunState.RECORDING)
                PAUSE.wait(0.6)  # long enough for one commit
                disk.is_bad = True
                deque(run, maxlen=0)
        except AcquisitionError as error:
            said = str(error)
        assert terminal_v(virtual) < SILENT_V
    disk.is_bad = False
    disk.back.set()
    assert said or run.outcome.state is RunState.FINISHED
    assert "\n" not in said
    if not path.exists():
        if name == "network hangs":  # the thread closes the file when the folder is back
            give_up_s = time.monotonic() + 20
            while any("committer" in each.name for each in threads()) and time.monotonic() < give_up_s:
                PAUSE.wait(0.01)
        assert part_of(path).exists()
        recover(path)
    with open_recording(path) as recording:
        assert recording.samples > 0
        assert np.isfinite(recording.read("drive_voltage")).all()


@pytest.mark.parametrize("by_s", [3600.0, -3600.0])
def test_a_jump_of_the_computer_clock_changes_only_time_labels(laboratory, tmp_path, monkeypatch, by_s):
    """Deadlines use a monotonic clock, which cannot be set."""
    virtual, connected = laboratory()
    now = time.time
    with bench_on(connected) as bench:
        with Run(bench, PLAN, tmp_path / "run.h5") as run:
            upto(run, RunState.RECORDING)
            # Replace the clock of the recording only: the clock of gRPC must agree with that of its core.
            clock = SimpleNamespace(time=lambda: now() + by_s, monotonic=time.monotonic)
            monkeypatch.setattr(_committer, "time", clock)
            run.switch.ask(StopRequest(Cause.OPERATOR, StopLevel.ABORT, "enough"))
            deque(run, maxlen=0)
        assert terminal_v(virtual) < SILENT_V
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.state is RecordingState.STOPPED
        assert recording.gaps == ()
        times = [each.unix_time_s for each in recording.events]
        assert max(times) - min(times) > 3500  # the labels follow the changed clock
        samples = [each.sample for each in recording.events]
        assert samples == sorted(samples)
