"""Callbacks of a program on the events of a simulated task."""

import queue

import numpy as np
import pytest
from nidaqmx import Task
from nidaqmx.constants import AcquisitionType
from nidaqmx.error_codes import DAQmxErrors

from tests.virtual_rig.conftest import daq_error

PATIENCE_S = 20.0


@pytest.fixture
def task(daq):
    return daq.inputs("Dev1/ai1")


def test_a_callback_every_n_samples_reads_n_samples_without_a_gap(task):
    task.timing.cfg_samp_clk_timing(10000, sample_mode=AcquisitionType.CONTINUOUS)
    blocks = queue.Queue()

    def on_samples(handle, kind, count, data):
        blocks.put(task.read(count))
        return 0

    task.register_every_n_samples_acquired_into_buffer_event(1000, on_samples)
    task.start()
    read = np.concatenate([blocks.get(timeout=PATIENCE_S) for _ in range(5)])
    expected = 0.5 + 2 * np.sin(2 * np.pi * 80 * np.arange(5000) / 10000)
    np.testing.assert_allclose(read, expected, atol=1e-9)
    task.register_every_n_samples_acquired_into_buffer_event(1000, None)
    task.stop()


def test_a_callback_that_does_not_read_is_not_called_repeatedly(task):
    task.timing.cfg_samp_clk_timing(10000, sample_mode=AcquisitionType.CONTINUOUS)
    calls = queue.Queue()

    def on_samples(handle, kind, count, data):
        calls.put(count)
        return 0

    task.register_every_n_samples_acquired_into_buffer_event(100, on_samples)
    task.start()
    assert calls.get(timeout=PATIENCE_S) == 100
    assert task.read(100)
    assert calls.get(timeout=PATIENCE_S) == 100
    assert calls.empty()


def test_a_task_can_be_closed_while_a_callback_is_registered(daq):
    for number in range(3):
        task = Task(grpc_options=daq.options)
        task.ai_channels.add_ai_voltage_chan("Dev1/ai1")
        task.timing.cfg_samp_clk_timing(1000, samps_per_chan=10 + number)
        task.register_every_n_samples_acquired_into_buffer_event(5, lambda *event: 0)
        task.start()
        task.close()


def test_events_that_belong_to_the_other_direction_are_refused(task):
    task.timing.cfg_samp_clk_timing(1000)
    with daq_error(DAQmxErrors.EVERY_N_SAMPS_TRANSFERRED_FROM_BUFFER_NOT_FOR_INPUT):
        task.register_every_n_samples_transferred_from_buffer_event(10, lambda *event: 0)
