"""Channels of a simulated task: ranges, coupling, excitation, and settings that a device refuses."""

import numpy as np
import pytest
from nidaqmx import DaqError
from nidaqmx.constants import (
    AcquisitionType,
    ChannelType,
    Coupling,
    ExcitationSource,
    TaskMode,
    TerminalConfiguration,
    UsageTypeAI,
    VoltageUnits,
)
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import RpcError

from tests.virtual_rig.conftest import daq_error

MODULE = "cDAQ1Mod1/ai1"


@pytest.fixture
def task(daq):
    return daq.task()


def verify(task):
    task.control(TaskMode.TASK_VERIFY)


def test_a_voltage_channel_has_no_excitation_by_default(task, daq):
    channel = task.ai_channels.add_ai_voltage_chan(MODULE)
    assert channel.ai_coupling is Coupling.DC
    assert channel.ai_excit_src is ExcitationSource.NONE
    channel.ai_coupling = Coupling.AC
    channel.ai_excit_src = ExcitationSource.INTERNAL
    channel.ai_excit_val = 0.002
    task.read(10)
    assert daq.world.wirings[-1][0].iepe_current_a == 0.002


def excited_channel(task, current_a, module=MODULE):
    channel = task.ai_channels.add_ai_voltage_chan(module)
    channel.ai_excit_src = ExcitationSource.INTERNAL
    channel.ai_excit_val = current_a
    return channel


def test_turning_on_excitation_sets_ac_coupling(task, daq):
    assert excited_channel(task, 0.002).ai_coupling is Coupling.AC
    task.read(10)
    assert (daq.world.wirings[-1][0].iepe_current_a, daq.world.wirings[-1][0].coupling) == (0.002, "AC")


def test_excitation_needs_ac_coupling(task):
    excited_channel(task, 0.002).ai_coupling = Coupling.DC
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, "IEPE"):
        verify(task)


def test_an_unsupported_sensor_current_is_refused_with_the_supported_values(task):
    excited_channel(task, 0.004)
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, r"0\.004\nPossible Values: 0, 0\.002"):
        verify(task)


def test_the_smallest_sufficient_input_range_is_used(task):
    channel = task.ai_channels.add_ai_voltage_chan("Dev2/ai0", min_val=-0.7, max_val=0.5)
    assert (channel.ai_rng_low, channel.ai_rng_high) == (-1.0, 1.0)


@pytest.mark.parametrize(
    ("limits", "allowed"),
    [((-10, 10), "5 on cDAQ1Mod1/ai1"), ((1, 1), "below AI_Max"), ((2, -2), "below AI_Max")],
)
def test_limits_beyond_the_widest_input_range_are_refused_with_the_allowed_ranges(task, limits, allowed):
    task.ai_channels.add_ai_voltage_chan(MODULE, min_val=limits[0], max_val=limits[1])
    with pytest.raises(DaqError, match=allowed) as caught:
        verify(task)
    assert caught.value.error_code == DAQmxErrors.INVALID_ATTRIBUTE_VALUE


def test_sensors_with_excitation_need_a_device_that_supplies_it(task):
    excited_channel(task, 0.002, "Dev2/ai0")
    with pytest.raises(DaqError, match="0 A on Dev2/ai0"):
        verify(task)


@pytest.mark.parametrize(
    "add",
    [
        lambda inputs: inputs.add_ai_accel_chan(MODULE),
        lambda inputs: inputs.add_ai_voltage_chan_with_excit(MODULE),
        lambda inputs: inputs.add_ai_microphone_chan(MODULE),
    ],
)
def test_channel_types_other_than_voltage_are_refused_by_name(task, add):
    with pytest.raises(RpcError, match="not supported"):
        add(task.ai_channels)


def test_units_other_than_volts_are_refused(task):
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, "VOLTS"):
        task.ai_channels.add_ai_voltage_chan(
            MODULE, units=VoltageUnits.FROM_CUSTOM_SCALE, custom_scale_name="vibrometer"
        )


def test_a_terminal_configuration_that_the_device_lacks_is_refused(task):
    task.ai_channels.add_ai_voltage_chan(MODULE, terminal_config=TerminalConfiguration.RSE)
    with pytest.raises(DaqError, match="PSEUDO_DIFF"):
        verify(task)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 100.0, 51201.0])
def test_an_unreachable_rate_is_refused_with_the_available_rates(task, rate_hz):
    task.ai_channels.add_ai_voltage_chan(MODULE)
    task.timing.cfg_samp_clk_timing(rate_hz)
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, r"1651\.61 to 51200"):
        verify(task)


def test_a_multiplexer_shares_its_rate_among_the_channels(task):
    task.ai_channels.add_ai_voltage_chan("Dev2/ai0:4")
    task.timing.cfg_samp_clk_timing(60e3)
    with pytest.raises(DaqError, match="50000"):
        verify(task)


@pytest.mark.parametrize(
    ("names", "code"),
    [
        ("Dev1/ai9", DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST),
        ("cDAQ1Mod1/ao0", DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST),
        ("Dev9/ai0", DAQmxErrors.INVALID_DEVICE_ID),
        ("Dev1/ao0", DAQmxErrors.INVALID_PHYS_CHAN_TYPE),
        ("Dev1/ai0, Dev2/ai0", DAQmxErrors.MULTI_DEVS_IN_TASK),
        ("Dev1/ai0, Dev1/ai0", DAQmxErrors.VIRTUAL_CHAN_NAME_USED),
    ],
)
def test_missing_inputs_and_invalid_combinations_are_refused(task, names, code):
    with daq_error(code):
        task.ai_channels.add_ai_voltage_chan(names)


def test_later_channels_of_a_list_may_leave_out_the_device(task):
    task.ai_channels.add_ai_voltage_chan("Dev1/ai0, ai2")
    assert task.channel_names == ["Dev1/ai0", "Dev1/ai2"]


def test_channels_have_the_names_given_by_the_program(task):
    task.ai_channels.add_ai_voltage_chan("Dev1/ai0:1", name_to_assign_to_channel="base")
    assert task.channel_names == ["base0", "base1"]
    channel = task.ai_channels["base1"]
    assert channel.physical_channel.name == "Dev1/ai1"
    assert channel.chan_type is ChannelType.ANALOG_INPUT
    assert channel.ai_meas_type is UsageTypeAI.VOLTAGE
    assert [device.name for device in task.devices] == ["Dev1"]


def test_a_setting_made_on_a_list_of_channels_reaches_every_channel(task):
    both = task.ai_channels.add_ai_voltage_chan("Dev1/ai0:1")
    both.ai_coupling = Coupling.AC
    assert [task.ai_channels[name].ai_coupling for name in task.channel_names] == [Coupling.AC] * 2


def test_overloads_can_only_be_read_while_the_task_is_running(task, daq):
    daq.world.gain = 6.0  # 12 V on ai1
    task.ai_channels.add_ai_voltage_chan("Dev1/ai0:1", min_val=-10, max_val=10)
    task.timing.cfg_samp_clk_timing(25600, sample_mode=AcquisitionType.CONTINUOUS)
    with daq_error(DAQmxErrors.CANT_GET_PROPERTY_TASK_NOT_RUNNING):
        _ = task.in_stream.overloaded_chans_exist
    assert np.max(task.read(2560)) == 10.0
    assert task.in_stream.overloaded_chans_exist
    assert task.in_stream.overloaded_chans == ["Dev1/ai1"]
    assert not task.in_stream.overloaded_chans_exist


def test_the_ni_9234_refuses_queries_about_overloads(task):
    task.ai_channels.add_ai_voltage_chan(MODULE)
    task.timing.cfg_samp_clk_timing(25600, sample_mode=AcquisitionType.CONTINUOUS)
    task.start()
    with daq_error(DAQmxErrors.ATTR_NOT_SUPPORTED, "NI 9234"):
        _ = task.in_stream.overloaded_chans_exist
