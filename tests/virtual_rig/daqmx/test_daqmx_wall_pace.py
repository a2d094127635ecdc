"""A simulated DAQ in real time: samples become available in time, and late readers lose samples."""

import threading

import numpy as np
import pytest
from nidaqmx.constants import READ_ALL_AVAILABLE, AcquisitionType
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqReadError

from tests.virtual_rig.conftest import daq_error
from vibench.virtual_rig.daqmx.rig import WallPace


class HandClock:
    """A clock that the test advances."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock():
    return HandClock()


def continuous(daq, rate_hz=1000.0, samples=1000):
    task = daq.inputs("Dev1/ai1")
    task.timing.cfg_samp_clk_timing(rate_hz, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=samples)
    return task


def wait_for(daq, samples, task):
    """Wait until the server has produced this number of samples."""
    rig = daq.server._rig
    with rig.changed:
        assert rig.changed.wait_for(lambda: rig._acquisitions[0].transferred >= samples, 10.0)


def test_samples_become_available_only_after_their_time(connect, clock):
    daq = connect(WallPace(clock=clock))
    task = continuous(daq)
    task.start()
    assert task.in_stream.avail_samp_per_chan == 0
    with daq_error(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE, kind=DaqReadError):
        task.read(1, timeout=0.0)
    clock.now_s += 0.25
    wait_for(daq, 250, task)
    assert task.in_stream.avail_samp_per_chan == 250


def test_a_timeout_returns_the_samples_so_far(connect, clock):
    daq = connect(WallPace(clock=clock))
    task = continuous(daq)
    task.start()
    clock.now_s += 0.1
    wait_for(daq, 100, task)
    with daq_error(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE, kind=DaqReadError) as caught:
        task.read(150, timeout=0.02)
    assert caught.value.samps_per_chan_read == 100
    assert task.in_stream.avail_samp_per_chan == 0


def test_a_partial_read_of_two_channels_fills_both_rows_from_the_start(connect, clock):
    daq = connect(WallPace(clock=clock))
    task = daq.inputs("Dev1/ai1:2", 1000)
    task.start()
    clock.now_s += 0.05
    wait_for(daq, 50, task)
    block = np.full((2, 80), np.nan)
    with pytest.raises(DaqReadError):
        task._interpreter.read_analog_f64(task._handle, 80, 0.01, 0, block)
    time_s = np.arange(50) / 1000
    np.testing.assert_allclose(block[0, :50], 0.5 + 2 * np.sin(2 * np.pi * 80 * time_s), atol=1e-9)
    np.testing.assert_allclose(block[1, :50], 0.5 + 3 * np.sin(2 * np.pi * 120 * time_s), atol=1e-9)


def test_a_reader_that_is_too_late_gets_a_lost_samples_error(connect, clock):
    daq = connect(WallPace(clock=clock))
    task = continuous(daq)
    task.start()
    clock.now_s += 0.5
    wait_for(daq, 500, task)
    assert len(task.read(READ_ALL_AVAILABLE)) == 500
    clock.now_s += 10.5  # the buffer holds ten seconds
    rig = daq.server._rig
    with rig.changed:
        assert rig.changed.wait_for(lambda: rig._acquisitions[0].failure is not None, 10.0)
    with daq_error(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE, kind=DaqReadError):
        task.read(10)
    with daq_error(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE):
        task.is_task_done()


def test_a_reader_waits_for_samples_in_real_time(connect, clock):
    daq = connect(WallPace(clock=clock))
    task = continuous(daq)
    task.start()
    brought = []
    reader = threading.Thread(target=lambda: brought.append(task.read(100, timeout=20.0)))
    reader.start()
    clock.now_s += 0.1
    reader.join(20.0)
    assert len(brought[0]) == 100


def test_a_reader_that_waits_gets_an_error_when_its_task_is_stopped(connect, clock, monkeypatch):
    pace, asked, ended = WallPace(clock=clock), threading.Event(), []
    daq = connect(pace)
    task = continuous(daq)
    task.start()

    def read():
        with daq_error(DAQmxErrors.RUNTIME_ABORTED_ROUTING):
            task.read(100, timeout=20.0)
        ended.append(True)

    reader, ask = threading.Thread(target=read), pace.ask
    # The reader holds the rig's lock from here until it waits, so that the stop comes during the wait.
    monkeypatch.setattr(pace, "ask", lambda *given: (asked.set(), ask(*given))[1])
    reader.start()
    assert asked.wait(20.0)
    task.stop()
    reader.join(20.0)
    assert ended == [True]


def test_the_speed_setting_makes_simulated_time_pass_faster(connect, clock):
    daq = connect(WallPace(speed=20.0, clock=clock))
    task = continuous(daq, samples=10000)
    task.start()
    clock.now_s += 0.1
    wait_for(daq, 2000, task)
    assert task.in_stream.avail_samp_per_chan == 2000


def test_real_time_samples_have_no_gap(connect):
    daq = connect(WallPace(speed=2.0))
    task = continuous(daq, rate_hz=51200.0)
    read = np.concatenate([task.read(5120, timeout=10.0) for _ in range(10)])
    first_s = np.asarray(daq.world.conversions[0].start_s)
    time_s = first_s + np.arange(read.size) / 51200
    np.testing.assert_allclose(read, 0.5 + 2 * np.sin(2 * np.pi * 80 * time_s), atol=1e-6)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("inf"), float("nan")])
def test_a_clock_that_does_not_run_forward_is_refused(speed):
    with pytest.raises(ValueError, match="above 0"):
        WallPace(speed)
