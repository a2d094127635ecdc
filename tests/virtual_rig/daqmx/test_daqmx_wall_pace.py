"""A simulated DAQ in real time: samples become available in time, and late readers lose samples."""

import threading

import numpy as np
import pytest
from nidaqmx.constants import READ_ALL_AVAILABLE
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqReadError

from tests.virtual_rig.conftest import daq_error
from vibench.virtual_rig.daqmx.rig import WallPace


class HandClock:
    """The clock of a rig, which the test advances."""

    def __init__(self, connect):
        self.now_s = 100.0
        self.pace = WallPace(clock=lambda: self.now_s)
        self.daq = connect(self.pace)

    def advance(self, by_s, *, until=None):
        """Advance, and wait until the server has acquired all samples, or until an acquisition is so."""
        self.now_s += by_s
        rig, wanted = self.daq.server._rig, round(1000 * self.pace.speed * (self.now_s - 100.0))
        is_there = until or (lambda acquisition: acquisition.transferred >= wanted)
        with rig.changed:
            assert rig.changed.wait_for(lambda: is_there(rig._acquisitions[0]), 10.0)


@pytest.fixture
def clock(connect):
    return HandClock(connect)


@pytest.fixture
def task(clock):
    """A running task of 1000 samples per second."""
    task = clock.daq.inputs("Dev1/ai1", 1000)
    task.start()
    return task


def test_samples_become_available_only_after_their_time(task, clock):
    assert task.in_stream.avail_samp_per_chan == 0
    with daq_error(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE, kind=DaqReadError):
        task.read(1, timeout=0.0)
    clock.advance(0.25)
    assert task.in_stream.avail_samp_per_chan == 250


def test_a_read_that_times_out_returns_the_samples_so_far(task, clock):
    clock.advance(0.1)
    with daq_error(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE, kind=DaqReadError) as caught:
        task.read(150, timeout=0.02)
    assert caught.value.samps_per_chan_read == 100
    assert task.in_stream.avail_samp_per_chan == 0


def test_a_partial_read_of_two_channels_fills_both_rows_from_their_beginning(clock):
    task = clock.daq.inputs("Dev1/ai1:2", 1000)
    task.start()
    clock.advance(0.05)
    block = np.full((2, 80), np.nan)
    with pytest.raises(DaqReadError):
        task._interpreter.read_analog_f64(task._handle, 80, 0.01, 0, block)
    time_s = np.arange(50) / 1000
    np.testing.assert_allclose(block[0, :50], 0.5 + 2 * np.sin(2 * np.pi * 80 * time_s), atol=1e-9)
    np.testing.assert_allclose(block[1, :50], 0.5 + 3 * np.sin(2 * np.pi * 120 * time_s), atol=1e-9)


def test_a_reader_that_is_too_late_gets_a_lost_samples_error(task, clock):
    clock.advance(0.5)
    assert len(task.read(READ_ALL_AVAILABLE)) == 500
    clock.advance(10.5, until=lambda acquisition: acquisition.failure is not None)  # the buffer holds 10 s
    with daq_error(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE, kind=DaqReadError):
        task.read(10)
    with daq_error(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE):
        task.is_task_done()


def test_a_reader_waits_for_samples_in_real_time(task, clock):
    brought = []
    reader = threading.Thread(target=lambda: brought.append(task.read(100, timeout=20.0)))
    reader.start()
    clock.now_s += 0.1
    reader.join(20.0)
    assert len(brought[0]) == 100


def test_a_reader_that_waits_gets_an_error_when_its_task_is_stopped(task, clock, monkeypatch):
    asked, ended = threading.Event(), []

    def read():
        with daq_error(DAQmxErrors.RUNTIME_ABORTED_ROUTING):
            task.read(100, timeout=20.0)
        ended.append(True)

    reader, ask = threading.Thread(target=read), clock.pace.ask
    # The reader holds the rig's lock from here until it waits, so that the stop comes during the wait.
    monkeypatch.setattr(clock.pace, "ask", lambda *given: (asked.set(), ask(*given))[1])
    reader.start()
    assert asked.wait(20.0)
    task.stop()
    reader.join(20.0)
    assert ended == [True]


def test_the_speed_setting_makes_simulated_time_pass_faster(task, clock):
    clock.pace.speed = 20.0
    clock.advance(0.1)
    assert task.in_stream.avail_samp_per_chan == 2000


def test_real_time_samples_have_no_gap(connect):
    daq = connect(WallPace(speed=2.0))
    task = daq.inputs("Dev1/ai1", 51200.0)
    read = np.concatenate([task.read(5120, timeout=10.0) for _ in range(10)])
    first_s = np.asarray(daq.world.conversions[0].start_s)
    time_s = first_s + np.arange(read.size) / 51200
    np.testing.assert_allclose(read, 0.5 + 2 * np.sin(2 * np.pi * 80 * time_s), atol=1e-6)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("inf"), float("nan")])
def test_a_clock_that_does_not_run_forward_is_refused(speed):
    with pytest.raises(ValueError, match="above 0"):
        WallPace(speed)
