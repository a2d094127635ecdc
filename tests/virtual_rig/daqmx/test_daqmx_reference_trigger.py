"""Samples from before and after an edge: on a line, or of an input."""

import threading

import numpy as np
import pytest
from nidaqmx.constants import READ_ALL_AVAILABLE, AcquisitionType, ReadRelativeTo, Slope, TriggerType
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError, DaqReadError

from tests.virtual_rig.conftest import signal
from vibench.virtual_rig.daqmx import WallPace

RATE_HZ, SAMPLES, BEFORE = 10_000.0, 300, 120


@pytest.fixture
def task(daq):
    task = daq.task()
    task.ai_channels.add_ai_voltage_chan("Dev1/ai1:2")
    task.timing.cfg_samp_clk_timing(RATE_HZ, samps_per_chan=SAMPLES)
    return task


def by_line(task, line="/Dev1/PFI1"):
    task.triggers.reference_trigger.cfg_dig_edge_ref_trig(line, BEFORE)


def by_level(task, level, slope=Slope.RISING, source="Dev1/ai2"):
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig(source, BEFORE, slope, level)


def refused(call):
    with pytest.raises(DaqError) as caught:
        call()
    return caught.value.error_code


def test_the_samples_around_an_edge_on_a_line_are_kept_whenever_it_comes(daq, task):
    by_line(task)
    for passed_s in (0.0137, 0.4):
        task.start()
        began_s = daq.world.time_s
        daq.server.let_pass(passed_s)
        daq.server.edge("/Dev1/PFI1")
        volts = task.read(READ_ALL_AVAILABLE)
        time_s = began_s + (round(passed_s * RATE_HZ) - BEFORE + np.arange(SAMPLES)) / RATE_HZ
        np.testing.assert_allclose(volts, [signal("ai1", time_s), signal("ai2", time_s)], atol=1e-9)
        assert task.is_task_done()
        task.stop()


def test_an_edge_that_comes_before_there_is_enough_to_keep_is_ignored(daq, task):
    by_line(task)
    task.start()
    daq.server.let_pass((BEFORE - 1) / RATE_HZ)
    daq.server.edge("/Dev1/PFI1")
    with pytest.raises(DaqReadError) as caught:
        task.read(SAMPLES, timeout=0.02)
    assert caught.value.error_code == DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE
    assert caught.value.samps_per_chan_read == 0
    daq.server.edge("/Dev1/PFI1")
    assert np.shape(task.read(SAMPLES)) == (2, SAMPLES)


@pytest.mark.parametrize("slope", list(Slope))
def test_the_first_sample_after_a_level_is_crossed_stands_behind_those_kept(task, slope):
    rng = np.random.default_rng(len(slope.name))
    for level in rng.uniform(-2.0, 3.0, 5):
        by_level(task, level, slope)
        volts = np.array(task.read(READ_ALL_AVAILABLE))[1]
        sign = 1 if slope is Slope.RISING else -1
        assert volts.size == SAMPLES
        assert sign * (volts[BEFORE - 1] - level) < 0 <= sign * (volts[BEFORE] - level)


def test_waiting_for_the_end_waits_for_the_level_first(task):
    by_level(task, 1.0)
    task.start()
    task.wait_until_done()
    assert len(task.read(READ_ALL_AVAILABLE)[0]) == SAMPLES


def test_a_level_that_is_never_reached_leaves_the_task_to_be_stopped(daq, task):
    by_level(task, 9.0)
    task.start()
    caught = []

    def read():
        try:
            task.read(SAMPLES, timeout=60.0)
        except DaqError as error:
            caught.append(error.error_code)

    reader = threading.Thread(target=read)
    reader.start()
    rig = daq.server._rig
    with rig.changed:
        assert rig.changed.wait_for(lambda: daq.world.time_s > 1.0, 20.0), "it is being waited for"
    task.stop()
    reader.join(20.0)
    assert caught == [DAQmxErrors.RUNTIME_ABORTED_ROUTING]


def test_samples_can_be_read_from_the_trigger_on(task):
    by_level(task, 1.0)
    task.start()
    whole = np.array(task.read(READ_ALL_AVAILABLE))
    for origin, first in (
        (ReadRelativeTo.FIRST_PRETRIGGER_SAMPLE, 0),
        (ReadRelativeTo.REFERENCE_TRIGGER, BEFORE),
    ):
        task.in_stream.relative_to = origin
        np.testing.assert_array_equal(task.read(20), whole[:, first : first + 20])


def test_at_the_walls_pace_it_waits_for_somebody_to_raise_the_line(connect):
    daq = connect(WallPace(speed=20.0))
    task = daq.task()
    task.ai_channels.add_ai_voltage_chan("Dev1/ai1")
    task.timing.cfg_samp_clk_timing(RATE_HZ, samps_per_chan=SAMPLES)
    by_line(task)
    task.start()
    stop = threading.Event()

    def raise_line():
        while not stop.wait(0.05):
            daq.server.edge("/Dev1/PFI1")

    raiser = threading.Thread(target=raise_line)
    raiser.start()
    volts = task.read(SAMPLES)
    stop.set()
    raiser.join()
    assert np.std(volts) > 1.0


def test_what_was_set_is_read_back_and_taken_back(task):
    trigger = task.triggers.reference_trigger
    by_level(task, 1.5, Slope.FALLING)
    assert (trigger.trig_type, trigger.anlg_edge_lvl) == (TriggerType.ANALOG_EDGE, 1.5)
    assert (trigger.anlg_edge_slope, trigger.pretrig_samples) == (Slope.FALLING, BEFORE)
    by_line(task)
    assert (trigger.trig_type, trigger.dig_edge_src) == (TriggerType.DIGITAL_EDGE, "/Dev1/PFI1")
    trigger.disable_ref_trig()
    assert trigger.trig_type is TriggerType.NONE
    assert len(task.read(READ_ALL_AVAILABLE)[0]) == SAMPLES


def test_what_cannot_be_waited_for_is_refused(daq, task):
    reference = task.triggers.reference_trigger
    for kept in (1, SAMPLES - 1, SAMPLES + 5):
        reference.cfg_dig_edge_ref_trig("PFI1", kept)
        assert refused(task.start) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE
    by_line(task, "/Dev1/PFI8")
    assert refused(task.start) == DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING
    assert refused(lambda: by_level(task, 1.0, source="Dev1/ai3")) == DAQmxErrors.INVALID_CHAN_NAME
    by_line(task)
    task.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS)
    assert refused(task.start) == DAQmxErrors.REF_TRIG_WHEN_CONTINUOUS
    multiplexed = daq.task()
    multiplexed.ai_channels.add_ai_voltage_chan("Dev2/ai0")
    multiplexed.timing.cfg_samp_clk_timing(RATE_HZ, samps_per_chan=SAMPLES)
    by_level(multiplexed, 1.0, source="Dev2/ai0")
    assert refused(multiplexed.start) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE
    multiplexed.triggers.reference_trigger.disable_ref_trig()
    multiplexed.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev2/PFI12")
    assert refused(multiplexed.start) == DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING
