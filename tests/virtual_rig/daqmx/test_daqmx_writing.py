"""Samples that a program plays through the simulated DAQ, seen on an input they are wired to."""

import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType, RegenerationMode
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqWriteError
from nidaqmx.stream_writers import AnalogMultiChannelWriter, AnalogSingleChannelWriter
from nitypes.waveform import AnalogWaveform

from tests.virtual_rig.conftest import daq_error

RATE_HZ = 20000.0
OUTPUT = "Dev1/ao0"


def ramp(samples):
    return np.linspace(-3, 3, samples)


def pair_on(daq, device):
    """Return an input task, and an output task that is wired to the input and triggered by its start."""
    inputs = daq.inputs(f"{device}/ai0", RATE_HZ, min_val=-10, max_val=10)
    outputs = daq.outputs(f"{device}/ao0", 3.5)
    outputs.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS)
    outputs.triggers.start_trigger.cfg_dig_edge_start_trig(inputs.triggers.start_trigger.term)
    return inputs, outputs


@pytest.fixture
def pair(daq):
    return pair_on(daq, "Dev1")


def play(pair, samples):
    """Write samples and start both tasks; return how many were written."""
    inputs, outputs = pair
    written = outputs.write(samples)
    outputs.start()
    inputs.start()
    return written


def test_a_triggered_output_begins_with_the_first_sample_of_the_input_and_repeats(pair):
    assert play(pair, ramp(1500)) == 1500
    np.testing.assert_allclose(pair[0].read(4500), np.tile(ramp(1500), 3), atol=1e-12)


def test_an_output_without_its_trigger_stays_silent(pair, daq):
    _, outputs = pair
    outputs.write(ramp(100))
    outputs.start()
    daq.world.advance(1.0)
    assert not outputs.is_task_done()
    assert not daq.world.played


@pytest.mark.parametrize(("device", "block"), [("Dev1", 1000), ("Dev2", 1000), ("Dev2", 7000)])
def test_a_buffer_of_the_first_block_suffices_together_with_the_memory_of_the_device(daq, device, block):
    inputs, outputs = pair_on(daq, device)
    outputs.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
    played = np.random.default_rng(block).uniform(-3, 3, 12 * block)
    outputs.write(played[:block])
    outputs.start()
    inputs.start()
    for first in range(block, played.size, block):
        outputs.write(played[first : first + block])
    np.testing.assert_allclose(inputs.read(played.size - block), played[:-block], atol=1e-12)


def test_writing_into_a_full_buffer_waits_for_the_output_to_play(pair):
    inputs, outputs = pair
    outputs.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
    outputs.out_stream.output_buf_size = 4000
    play(pair, np.zeros(4000))
    outputs.write(np.ones(10000))
    heard = np.array(inputs.read(12000))
    assert np.flatnonzero(heard)[0] == 4000


def test_samples_that_are_not_written_in_time_stop_the_output(pair, daq):
    inputs, outputs = pair
    outputs.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
    play(pair, np.ones(1000))
    heard = np.array(inputs.read(4000))
    assert np.flatnonzero(heard).tolist() == list(range(1000))
    with daq_error(DAQmxErrors.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES, kind=DaqWriteError) as caught:
        outputs.write(np.ones(10))
    assert caught.value.samps_per_chan_written == 0
    with daq_error(DAQmxErrors.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES):
        outputs.is_task_done()


def test_a_finite_output_ends_at_zero_volts(daq):
    task = daq.outputs(OUTPUT, 3.5)
    task.timing.cfg_samp_clk_timing(RATE_HZ, samps_per_chan=300)
    task.write(ramp(300), auto_start=True)
    task.wait_until_done()
    assert task.is_task_done()
    first_s = daq.world.played[OUTPUT][0].start_s
    np.testing.assert_allclose(daq.world.output(OUTPUT, first_s + np.arange(300) / RATE_HZ), ramp(300))
    afterwards = daq.world.output(OUTPUT, np.array([first_s + 301 / RATE_HZ, daq.world.time_s + 1.0]))
    assert not afterwards.any()


def test_a_buffer_can_be_rewritten_while_it_repeats(pair):
    inputs, outputs = pair
    play(pair, np.zeros(1000))
    inputs.read(1500)
    outputs.write(np.ones(1000))
    heard = np.array(inputs.read(3000))
    assert np.all(heard[-1000:] == 1.0)


def test_stopping_a_task_silences_its_output_at_once(pair, daq):
    inputs, outputs = pair
    play(pair, np.ones(1000))
    inputs.read(500)
    outputs.stop()
    heard = np.array(inputs.read(500))
    assert np.flatnonzero(heard).size <= 1


def test_a_value_beyond_the_limits_is_refused_and_nothing_is_played(pair, daq):
    _, outputs = pair
    with daq_error(DAQmxErrors.INVALID_AO_DATA_WRITE, r"3\.6", kind=DaqWriteError):
        outputs.write(np.array([0.0, 3.6]))
    with daq_error(DAQmxErrors.OUTPUT_BUFFER_EMPTY):
        outputs.start()


def test_writing_more_than_the_buffer_size_is_refused_before_the_start(pair):
    _, outputs = pair
    outputs.out_stream.output_buf_size = 100
    with daq_error(DAQmxErrors.NO_MORE_SPACE, "100 samples", kind=DaqWriteError):
        outputs.write(np.zeros(101))


def test_a_software_timed_output_holds_its_value(daq):
    inputs, outputs = daq.inputs("Dev2/ai0", min_val=-10, max_val=10), daq.outputs("Dev2/ao0", 10.0)
    outputs.write(1.25)
    assert daq.world.played["Dev2/ao0"][-1].volts.tolist() == [1.25]
    assert inputs.read() == 1.25


def test_each_of_two_outputs_plays_one_row_of_samples(daq):
    task = daq.outputs("Dev2/ao0:1", 10.0)
    task.timing.cfg_samp_clk_timing(10000, samps_per_chan=200)
    rows = np.stack([ramp(200), -ramp(200)])
    AnalogMultiChannelWriter(task.out_stream).write_many_sample(rows)
    task.start()
    task.wait_until_done()
    for channel, row in zip(("Dev2/ao0", "Dev2/ao1"), rows, strict=True):
        start_s = daq.world.played[channel][0].start_s
        np.testing.assert_allclose(daq.world.output(channel, start_s + np.arange(200) / 10000), row)


def test_a_waveform_object_is_played_sample_by_sample(pair):
    inputs, outputs = pair
    assert outputs.write_waveform(AnalogWaveform.from_array_1d(ramp(500))) == 500
    outputs.start()
    inputs.start()
    np.testing.assert_allclose(inputs.read(500), ramp(500), atol=1e-12)


def test_writing_to_a_task_with_inputs_is_refused(daq):
    task = daq.inputs("Dev1/ai0")
    with daq_error(DAQmxErrors.WRITE_NO_OUTPUT_CHANS_IN_TASK):
        AnalogSingleChannelWriter(task.out_stream).write_many_sample(np.zeros(3))
