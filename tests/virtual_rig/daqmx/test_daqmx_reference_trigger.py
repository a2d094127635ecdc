"""Reference triggers keep samples before and after an edge on a digital line."""

import threading

import numpy as np
import pytest
from nidaqmx.constants import READ_ALL_AVAILABLE, AcquisitionType
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError, DaqReadError

from tests.virtual_rig.conftest import daq_error, signal

RATE_HZ, SAMPLES, BEFORE = 10_000.0, 300, 120


@pytest.fixture
def task(daq):
    return daq.inputs("Dev1/ai1:2", RATE_HZ, samples=SAMPLES)


def by_line(task, line="/Dev1/PFI1"):
    task.triggers.reference_trigger.cfg_dig_edge_ref_trig(line, BEFORE)


def test_a_reference_trigger_keeps_the_samples_around_its_edge(daq, task):
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


def test_a_trigger_before_the_pretrigger_samples_are_complete_is_ignored(daq, task):
    by_line(task)
    task.start()
    daq.server.let_pass((BEFORE - 1) / RATE_HZ)
    daq.server.edge("/Dev1/PFI1")
    with daq_error(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE, kind=DaqReadError) as caught:
        task.read(SAMPLES, timeout=0.02)
    assert caught.value.samps_per_chan_read == 0
    daq.server.edge("/Dev1/PFI1")
    assert np.shape(task.read(SAMPLES)) == (2, SAMPLES)


def test_a_task_waiting_for_its_trigger_can_be_stopped(daq, task):
    by_line(task)
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
        assert rig.changed.wait_for(lambda: daq.world.time_s >= BEFORE / RATE_HZ, 20.0), "it is waited for"
    task.stop()
    reader.join(20.0)
    assert caught == [DAQmxErrors.RUNTIME_ABORTED_ROUTING]


def test_unsupported_reference_triggers_are_refused(daq, task):
    reference = task.triggers.reference_trigger
    for kept in (1, SAMPLES - 1, SAMPLES + 5):
        reference.cfg_dig_edge_ref_trig("PFI1", kept)
        with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE):
            task.start()
    by_line(task, "/Dev1/PFI8")
    with daq_error(DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING):
        task.start()
    by_line(task)
    task.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS)
    with daq_error(DAQmxErrors.REF_TRIG_WHEN_CONTINUOUS):
        task.start()
    other = daq.inputs("Dev2/ai0", RATE_HZ, samples=SAMPLES)
    other.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev2/PFI12")
    with daq_error(DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING):
        other.start()
