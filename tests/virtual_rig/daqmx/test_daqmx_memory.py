"""Requests larger than the memory are refused, and unread samples use limited memory."""

import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError

from tests.virtual_rig.conftest import daq_error
from vibench.acquisition import AcquisitionError
from vibench.virtual_rig.daqmx import streams
from vibench.virtual_rig.daqmx.rig import WallPace

GIANT = 1 << 33


@pytest.fixture
def task(daq):
    return daq.inputs("Dev1/ai1")


def test_buffers_and_reads_larger_than_the_memory_are_refused(daq, task):
    task.timing.cfg_samp_clk_timing(10_000, samps_per_chan=GIANT)
    with daq_error(DAQmxErrors.PAL_MEMORY_FULL):
        task.start()
    task.timing.cfg_samp_clk_timing(10_000, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=1000)
    interpreter = task._interpreter
    with daq_error(DAQmxErrors.PAL_MEMORY_FULL):
        interpreter.read_analog_waveforms(task._handle, 1 << 30, 1.0, [], NoTiming)
    task.timing.cfg_samp_clk_timing(10_000, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=2**32 - 1)
    with daq_error(DAQmxErrors.PAL_MEMORY_FULL):
        task.start()
    output = daq.outputs("Dev1/ao0", 1)
    with pytest.raises(DaqError):
        output.out_stream.output_buf_size = 2**32 - 1


class NoTiming:
    """The client's setting for waveforms without timing information."""

    value = 0


def test_unread_samples_are_lost_when_the_memory_is_full(daq, task, monkeypatch):
    monkeypatch.setattr(streams, "MOST_SAMPLES", 50_000)
    task.timing.cfg_samp_clk_timing(10_000, sample_mode=AcquisitionType.CONTINUOUS)
    task.start()
    daq.server.let_pass(4.0)
    assert len(task.read(100)) == 100
    daq.server.let_pass(8.0)
    with daq_error(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE):
        task.read(100)


@pytest.mark.parametrize("pace", [None, WallPace(speed=5.0)])
def test_a_failed_simulation_is_reported_to_every_reader(connect, pace):
    daq = connect(pace)

    def fail(*_):
        raise AcquisitionError("The specimen's motion was lost")

    task = daq.inputs("Dev1/ai1", 10_000)
    task.start()
    assert np.size(task.read(500)) == 500
    daq.world.voltage = fail
    for _ in range(2):
        with daq_error(DAQmxErrors.DEV_CANNOT_BE_ACCESSED, "motion was lost"):
            task.read(5000)
