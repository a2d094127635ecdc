"""Samples that a program reads from the simulated DAQ."""

from datetime import UTC, datetime

import numpy as np
import pytest
from nidaqmx.constants import (
    READ_ALL_AVAILABLE,
    AcquisitionType,
    FillMode,
    SampleTimingType,
    TaskMode,
)
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.stream_readers import AnalogMultiChannelReader, AnalogUnscaledReader

from tests.virtual_rig.conftest import daq_error

RATE_HZ = 10240.0


def closed_form(numbers, first, count, rate_hz=RATE_HZ):
    """Return the closed form of the sines of these channels, from a sample on."""
    time_s = (first + np.arange(count)) / rate_hz
    return np.stack([0.5 + (n + 1) * np.sin(2 * np.pi * 40 * (n + 1) * time_s) for n in numbers])


@pytest.fixture
def task(daq):
    task = daq.inputs("cDAQ1Mod1/ai1:3")
    task.timing.cfg_samp_clk_timing(10000, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=5000)
    return task


@pytest.mark.parametrize("samples", [1, 512, 5120, 51200])
def test_no_sample_is_lost_or_repeated_between_reads_of_any_size(task, samples):
    reader = AnalogMultiChannelReader(task.in_stream)
    block = np.empty((3, samples))
    for number in range(4):
        reader.read_many_sample(block, samples)
        np.testing.assert_allclose(block, closed_form((1, 2, 3), number * samples, samples), atol=1e-7)


def test_samples_are_read_in_the_requested_layout(task, daq):
    by_channel, by_scan = np.empty((3, 10)), np.empty((10, 3))
    interpreter = task._interpreter
    interpreter.read_analog_f64(task._handle, 10, 1.0, FillMode.GROUP_BY_CHANNEL.value, by_channel)
    interpreter.read_analog_f64(task._handle, 10, 1.0, FillMode.GROUP_BY_SCAN_NUMBER.value, by_scan)
    np.testing.assert_allclose(by_channel, closed_form((1, 2, 3), 0, 10), atol=1e-9)
    np.testing.assert_allclose(by_scan.T, closed_form((1, 2, 3), 10, 10), atol=1e-9)


def test_a_finite_task_gives_exactly_the_requested_number_of_samples(daq):
    task = daq.inputs("Dev1/ai1", RATE_HZ, samples=200)
    task.start()
    task.wait_until_done()
    assert task.is_task_done()
    assert task.in_stream.avail_samp_per_chan == 200
    np.testing.assert_allclose(task.read(READ_ALL_AVAILABLE), closed_form((1,), 0, 200)[0], atol=1e-9)
    with daq_error(DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE):
        task.read(1)


def test_a_finite_task_started_by_a_read_can_be_read_repeatedly(daq):
    task = daq.inputs("Dev1/ai1", RATE_HZ, samples=200)
    first = task.read(200)
    second = task.read(200)
    np.testing.assert_allclose(first, closed_form((1,), 0, 200)[0], atol=1e-9)
    np.testing.assert_allclose(second, closed_form((1,), 200, 200)[0], atol=1e-9)


def test_polling_for_samples_advances_the_simulated_time(task):
    task.start()
    questions = 0
    while task.in_stream.avail_samp_per_chan < 100:
        questions += 1
        assert questions < 5
    assert len(task.read(READ_ALL_AVAILABLE)[0]) >= 100


def test_polling_for_the_end_of_a_task_advances_the_simulated_time(daq):
    task = daq.inputs("Dev1/ai1", 1000, samples=500)
    task.start()
    questions = 0
    while not task.is_task_done():
        questions += 1
        assert questions < 10


def test_a_task_without_a_clock_reads_single_samples_on_demand(daq):
    task = daq.inputs("Dev2/ai1:2")
    assert task.timing.samp_timing_type is SampleTimingType.ON_DEMAND
    assert task.read() == pytest.approx([0.5, 0.5])
    assert np.shape(task.read(5)) == (2, 5)


def test_a_delta_sigma_device_without_timing_samples_at_its_lowest_rate(daq):
    task = daq.inputs("cDAQ1Mod1/ai1")
    assert task.timing.samp_timing_type is SampleTimingType.SAMPLE_CLOCK
    assert task.timing.samp_clk_rate == pytest.approx(51200 / 31)
    assert task.read() == pytest.approx(0.5)


def test_raw_counts_can_be_converted_back_to_volts(daq):
    task = daq.task()
    channel = task.ai_channels.add_ai_voltage_chan("cDAQ1Mod1/ai1")
    task.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS)
    counts = np.empty((1, 50), dtype=np.int32)
    AnalogUnscaledReader(task.in_stream).read_int32(counts, 50)
    step_v = channel.ai_dev_scaling_coeff[1]
    assert step_v == 5 / 2**23
    np.testing.assert_allclose(counts * step_v, closed_form((1,), 0, 50), atol=step_v)


def test_a_waveform_contains_its_name_its_unit_its_times_and_its_samples(task):
    waveforms = task.read_waveform(64)
    np.testing.assert_allclose([w.scaled_data for w in waveforms], closed_form((1, 2, 3), 0, 64), atol=1e-9)
    later = task.read_waveform(10)[0].timing
    timing = waveforms[0].timing
    assert timing.sample_interval.total_seconds() == pytest.approx(1 / RATE_HZ)
    assert (later.start_time - timing.start_time).total_seconds() == pytest.approx(64 / RATE_HZ, abs=1e-5)
    assert abs((timing.start_time - datetime.now(UTC)).total_seconds()) < 60
    assert [(w.channel_name, w.units) for w in waveforms] == [
        (f"cDAQ1Mod1/ai{n}", "Volts") for n in (1, 2, 3)
    ]


def test_restarting_a_task_begins_at_sample_zero(task):
    task.start()
    task.read(100)
    task.stop()
    task.stop()
    task.start()
    np.testing.assert_allclose(task.read(10), closed_form((1, 2, 3), 100, 10), atol=1e-9)


def test_a_committed_task_stays_reserved_after_a_stop(task, daq):
    task.control(TaskMode.TASK_COMMIT)
    task.start()
    task.stop()
    rival = daq.inputs("cDAQ1Mod1/ai0")
    with daq_error(DAQmxErrors.PAL_RESOURCE_RESERVED):
        rival.start()
    task.control(TaskMode.TASK_UNRESERVE)
    rival.start()


def test_stopping_a_task_stops_its_conversion(task, daq):
    task.read(10)
    assert len(daq.world.conversions) == 1
    task.stop()
    assert not daq.world.conversions


def test_two_devices_sample_the_same_interval_of_simulated_time(daq):
    tasks = []
    for name in ("Dev1/ai1", "cDAQ1Mod1/ai1"):
        task = daq.inputs(name, 25600)
        tasks.append(task)
    for task in tasks:
        task.start()
    for _ in range(3):
        first, second = (task.read(2560) for task in tasks)
        np.testing.assert_allclose(first, second, atol=1e-9)
    assert daq.world.time_s == pytest.approx(0.3)
