"""Channels of a simulated task: ranges, coupling, excitation, and settings that a device refuses."""

import numpy as np
import pytest
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

from tests.virtual_rig.conftest import daq_error

MODULE = "cDAQ1Mod1/ai1"


@pytest.fixture
def task(daq):
    return daq.task()


def test_sensor_excitation_is_off_by_default_and_turning_it_on_sets_ac_coupling(task, daq):
    channel = task.ai_channels.add_ai_voltage_chan(MODULE)
    assert channel.ai_coupling is Coupling.DC
    assert channel.ai_excit_src is ExcitationSource.NONE
    channel.ai_excit_src = ExcitationSource.INTERNAL
    channel.ai_excit_val = 0.002
    assert channel.ai_coupling is Coupling.AC
    task.read(10)
    assert (daq.world.wirings[-1][0].iepe_current_a, daq.world.wirings[-1][0].coupling) == (0.002, "AC")


IEPE = {"ai_excit_src": ExcitationSource.INTERNAL, "ai_excit_val": 0.002}


@pytest.mark.parametrize(
    ("channels", "options", "settings", "rate_hz", "allowed"),
    [
        (MODULE, {}, {**IEPE, "ai_coupling": Coupling.DC}, None, "IEPE"),
        (MODULE, {}, {**IEPE, "ai_excit_val": 0.004}, None, r"0\.004\nPossible Values: 0, 0\.002"),
        ("Dev2/ai0", {}, IEPE, None, "0 A on Dev2/ai0"),
        (MODULE, {"min_val": -10, "max_val": 10}, {}, None, "5 on cDAQ1Mod1/ai1"),
        (MODULE, {"min_val": 1, "max_val": 1}, {}, None, "below AI_Max"),
        (MODULE, {"min_val": 2, "max_val": -2}, {}, None, "below AI_Max"),
        (MODULE, {"terminal_config": TerminalConfiguration.RSE}, {}, None, "PSEUDO_DIFF"),
        *((MODULE, {}, {}, rate_hz, r"1651\.61 to 51200") for rate_hz in (0.0, -1.0, 100.0, 51201.0)),
        ("Dev2/ai0:4", {}, {}, 60e3, "50000"),
    ],
)
def test_settings_that_a_device_does_not_have_are_refused_with_the_allowed_values(
    task, channels, options, settings, rate_hz, allowed
):
    channel = task.ai_channels.add_ai_voltage_chan(channels, **options)
    for name, value in settings.items():
        setattr(channel, name, value)
    if rate_hz is not None:
        task.timing.cfg_samp_clk_timing(rate_hz)
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, allowed):
        task.control(TaskMode.TASK_RESERVE)


@pytest.mark.parametrize(
    ("limits", "allowed"),
    [((-10, 10), r"-3\.5 to 3\.5 V"), ((1, 1), "below AO_Max")],
)
def test_output_limits_beyond_the_range_of_the_device_are_refused(task, limits, allowed):
    task.ao_channels.add_ao_voltage_chan("Dev1/ao0", min_val=limits[0], max_val=limits[1])
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, allowed):
        task.control(TaskMode.TASK_RESERVE)


def test_the_smallest_sufficient_input_range_is_used(task):
    channel = task.ai_channels.add_ai_voltage_chan("Dev2/ai0", min_val=-0.7, max_val=0.5)
    assert (channel.ai_rng_low, channel.ai_rng_high) == (-1.0, 1.0)


def test_units_other_than_volts_are_refused(task):
    with daq_error(DAQmxErrors.INVALID_ATTRIBUTE_VALUE, "VOLTS"):
        task.ai_channels.add_ai_voltage_chan(
            MODULE, units=VoltageUnits.FROM_CUSTOM_SCALE, custom_scale_name="vibrometer"
        )


@pytest.mark.parametrize(
    ("names", "code"),
    [
        ("Dev1/ai9", DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST),
        ("cDAQ1Mod1/ao0", DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST),
        ("Dev9/ai0", DAQmxErrors.INVALID_DEVICE_ID),
        ("Dev1/ao0", DAQmxErrors.INVALID_PHYS_CHAN_TYPE),
        ("Dev1/ai0, Dev2/ai0", DAQmxErrors.MULTI_DEVS_IN_TASK),
        ("Dev1/ai0, Dev1/ai0", DAQmxErrors.VIRTUAL_CHAN_NAME_USED),
        ("Dev1/ai0:Dev2/ai1", DAQmxErrors.INVALID_RANGE_OF_OBJECTS_SYNTAX_IN_STRING),
        ("Dev1/ai0:20000", DAQmxErrors.INVALID_RANGE_OF_OBJECTS_SYNTAX_IN_STRING),
    ],
)
def test_missing_inputs_and_invalid_combinations_are_refused(task, names, code):
    with daq_error(code):
        task.ai_channels.add_ai_voltage_chan(names)


def test_the_device_may_be_left_out_after_the_first_channel_of_a_list(task):
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


def test_overloads_can_be_read_only_while_the_task_is_running(task, daq):
    daq.world.gain = 6.0  # 12 V on ai1
    task.ai_channels.add_ai_voltage_chan("Dev1/ai0:1", min_val=-10, max_val=10)
    task.timing.cfg_samp_clk_timing(25600, sample_mode=AcquisitionType.CONTINUOUS)
    with daq_error(DAQmxErrors.CANT_GET_PROPERTY_TASK_NOT_RUNNING):
        _ = task.in_stream.overloaded_chans_exist
    assert np.max(task.read(2560)) == 10.0
    assert task.in_stream.overloaded_chans_exist
    assert task.in_stream.overloaded_chans == ["Dev1/ai1"]
    assert not task.in_stream.overloaded_chans_exist
