"""Errors of the simulated driver: those of a wrong state, and injected ones."""

import grpc
import numpy as np
import pytest
from nidaqmx import DaqError, Task
from nidaqmx._stubs import nidaqmx_pb2, nidaqmx_pb2_grpc
from nidaqmx.constants import AcquisitionType, TaskMode
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqReadError, RpcError
from session_pb2 import Session

from tests.virtual_rig.conftest import daq_error


@pytest.fixture
def task(daq):
    task = daq.task("measure")
    task.ai_channels.add_ai_voltage_chan("Dev1/ai0:1")
    task.timing.cfg_samp_clk_timing(1000, sample_mode=AcquisitionType.CONTINUOUS)
    return task


def test_a_device_in_use_is_refused_with_the_name_of_its_task(daq, task):
    task.start()
    rival = daq.task("rival")
    rival.ai_channels.add_ai_voltage_chan("Dev1/ai3")
    with daq_error(DAQmxErrors.PAL_RESOURCE_RESERVED, r"(?s)measure.*rival"):
        rival.start()
    task.stop()
    rival.start()


def test_a_task_without_channels_cannot_be_started_or_timed(daq):
    empty = daq.task()
    with daq_error(DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK):
        empty.start()
    with daq_error(DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK):
        empty.timing.cfg_samp_clk_timing(1000)


def test_a_running_task_cannot_be_changed(task):
    task.start()
    for change in (
        task.start,
        lambda: task.timing.cfg_samp_clk_timing(2000),
        lambda: task.ai_channels.add_ai_voltage_chan("Dev1/ai3"),
        lambda: setattr(task.ai_channels.all, "ai_max", 2.0),
    ):
        with daq_error(DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING):
            change()


def test_a_second_task_with_the_same_name_is_refused(daq, task):
    with daq_error(DAQmxErrors.DUPLICATE_TASK):
        Task("measure", grpc_options=daq.options)


def test_waiting_for_a_task_that_does_not_end_times_out(task):
    task.start()
    with daq_error(DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE):
        task.wait_until_done(timeout=0.01)


def test_an_unknown_trigger_terminal_is_refused(task):
    task.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI12")
    with daq_error(DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING):
        task.start()


def test_a_missing_trigger_times_out_without_samples(daq, task):
    task.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
    with daq_error(DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE, kind=DaqReadError) as caught:
        task.read(10, timeout=0.01)
    assert caught.value.samps_per_chan_read == 0
    daq.server.edge("/Dev1/PFI0")
    assert np.shape(task.read(10)) == (2, 10)


def test_a_task_on_the_clock_of_another_task_starts_with_that_task(daq, task):
    output = daq.outputs("Dev1/ao0", 1)
    output.timing.cfg_samp_clk_timing(1000, source="/Dev1/ai/SampleClock")
    output.write(np.ones(1000), auto_start=True)
    daq.world.advance(0.25)
    task.start()
    assert daq.world.played["Dev1/ao0"][0].start_s == 0.25


def test_a_read_past_the_end_returns_the_remaining_samples_with_an_error(daq):
    task = daq.inputs("Dev1/ai1", 1000, samples=30)
    with daq_error(DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE, kind=DaqReadError) as caught:
        task.read(50)
    assert caught.value.samps_per_chan_read == 30


def test_a_chassis_shows_its_trigger_terminal_once_its_task_is_reserved(daq):
    task = daq.inputs("cDAQ1Mod1/ai0")
    with daq_error(DAQmxErrors.CANNOT_GET_PROPERTY_WHEN_TASK_NOT_RESERVED_COMMITTED_OR_RUNNING):
        _ = task.triggers.start_trigger.term
    task.control(TaskMode.TASK_RESERVE)
    assert task.triggers.start_trigger.term == "/cDAQ1/ai/StartTrigger"


def test_a_simulation_that_cannot_start_leaves_the_device_free(daq):
    daq.world.slowest_hz = 2000.0
    task = daq.inputs("Dev1/ai0")
    task.timing.cfg_samp_clk_timing(1000)
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, "2000 Hz"):
        task.start()
    rival = daq.inputs("Dev1/ai0")
    rival.timing.cfg_samp_clk_timing(4000)
    rival.start()


def test_the_refusal_of_an_unknown_attribute_gives_its_name_or_number(daq, task):
    channel = task.ai_channels.all
    with daq_error(DAQmxErrors.ATTR_NOT_SUPPORTED, r"Channel\.AI_LOWPASS_CUTOFF_FREQ"):
        _ = channel.ai_lowpass_cutoff_freq
    with pytest.raises(DaqError, match=r"Read\.0x7FFF"):
        task._interpreter.get_read_attribute_uint32(task._handle, 0x7FFF)
    with pytest.raises(DaqError, match="only be read"):
        task._interpreter.set_chan_attribute_double(task._handle, "Dev1/ai0", 0x1815, 3.0)  # AI_RNG_HIGH


def test_the_refusal_of_a_call_that_is_not_simulated_names_the_call(daq):
    stub = nidaqmx_pb2_grpc.NiDAQmxStub(daq.options.grpc_channel)
    for name, request in [
        ("CreateDIChan", nidaqmx_pb2.CreateDIChanRequest()),
        ("ReadCounterF64", nidaqmx_pb2.ReadCounterF64Request()),
        ("CfgAnlgEdgeRefTrig", nidaqmx_pb2.CfgAnlgEdgeRefTrigRequest(task=Session(name="x"))),
    ]:
        with pytest.raises(grpc.RpcError, match=name) as caught:
            getattr(stub, name)(request)
        assert caught.value.code() is grpc.StatusCode.UNIMPLEMENTED


def test_the_text_of_an_error_code_can_be_looked_up(daq, task):
    assert task._interpreter.get_error_string(-200018) == "Dac underflow."


@pytest.mark.parametrize("code", [-200361, -201003, -200279, -88710])
def test_an_injected_fault_reaches_the_reader_with_its_code(daq, task, code):
    task.read(10)
    end = daq.server.faults.add(code, "ReadAnalogF64")
    with daq_error(code, kind=DaqReadError):
        task.read(10)
    end()
    task.read(10)


def test_a_restarted_server_has_no_tasks(daq, task):
    end = daq.server.faults.add(None)
    with pytest.raises(RpcError) as caught:
        task.read(1)
    assert caught.value.rpc_code is grpc.StatusCode.UNAVAILABLE
    end()
    with daq_error(DAQmxErrors.INVALID_TASK):
        task.read(1)
    task._close_on_exit, task._handle = False, None


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("CreateAIVoltageChan", {"terminal_config_raw": 77, "units_raw": 10348}),
        (
            "CfgSampClkTiming",
            {"active_edge_raw": 77, "sample_mode_raw": 10123, "rate": 1e3, "samps_per_chan": 9},
        ),
        ("TaskControl", {"action_raw": 77}),
    ],
)
def test_an_invalid_enum_number_is_refused_with_the_number(daq, task, name, fields):
    request = getattr(nidaqmx_pb2, f"{name}Request")(task=Session(name="measure"), **fields)
    if hasattr(request, "physical_channel"):
        request.physical_channel = "Dev1/ai2"
    with pytest.raises(grpc.RpcError) as daq_error:
        getattr(nidaqmx_pb2_grpc.NiDAQmxStub(daq.options.grpc_channel), name)(request)
    assert ("ni-error", str(DAQmxErrors.INVALID_ATTRIBUTE_VALUE.value)) in daq_error.value.trailing_metadata()
    assert "Requested Value: 77" in daq_error.value.details()


def test_invalid_waveforms_are_refused(daq):
    output = daq.task("play")
    output.ao_channels.add_ao_voltage_chan("Dev1/ao0", min_val=-1, max_val=1)
    request = nidaqmx_pb2.WriteAnalogWaveformsRequest(task=Session(name="play"))
    with pytest.raises(grpc.RpcError) as daq_error:
        nidaqmx_pb2_grpc.NiDAQmxStub(daq.options.grpc_channel).WriteAnalogWaveforms(request)
    assert "number of waveforms" in daq_error.value.details()
