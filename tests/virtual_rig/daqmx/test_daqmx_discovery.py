"""Devices, features and rates of the simulated DAQmx system."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from nidaqmx import DaqError
from nidaqmx.constants import ProductCategory
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.system import System

from tests.virtual_rig.conftest import daq_error
from vibench.acquisition import ConfigurationError
from vibench.virtual_rig.daqmx.devices import NI_9234, USB_6211, catalogue_with, expand


@pytest.fixture
def system(daq):
    return System.remote(daq.options)


def test_every_device_is_listed_with_its_properties(system):
    assert {device.name: device.product_type for device in system.devices} == {
        "cDAQ1": "cDAQ-9174",
        "cDAQ1Mod1": "NI 9234",
        "Dev1": "USB-4431",
        "Dev2": "USB-6211",
    }
    assert len({device.serial_num for device in system.devices}) == 4
    module = system.devices["cDAQ1Mod1"]
    assert module.product_category is ProductCategory.C_SERIES_MODULE
    assert [channel.name for channel in module.ai_physical_chans] == [f"cDAQ1Mod1/ai{n}" for n in range(4)]
    assert not list(module.ao_physical_chans)
    assert system.devices["Dev1/ao0"].ao_voltage_rngs == [-3.5, 3.5], "by the name of what is on it"


def test_the_error_for_a_missing_feature_of_a_device_names_the_feature(system):
    with daq_error(DAQmxErrors.ATTR_NOT_SUPPORTED, r"(?s)analogue output.*cDAQ1Mod1"):
        _ = system.devices["cDAQ1Mod1"].ao_voltage_rngs
    with pytest.raises(DaqError, match=r"Device\.PCI_BUS_NUM"):
        _ = system.devices["Dev1"].pci_bus_num


@pytest.mark.parametrize(("product", "name"), [("NI 9999", "Dev1"), ("NI 9234", "dev1")])
def test_a_simulated_system_with_an_impossible_device_is_refused(product, name):
    with pytest.raises(ConfigurationError, match="nothing was started"):
        catalogue_with(product, name)


@given(st.floats(NI_9234.inputs.rates.minimum_hz, NI_9234.inputs.rates.maximum_hz))
def test_a_9234_rounds_a_rate_up_to_the_next_available_rate(rate_hz):
    rates = NI_9234.inputs.rates
    actual = rates.next_up(rate_hz)
    available = 51200 / np.arange(1, 32)
    assert np.min(np.abs(available / actual - 1)) < 1e-12
    assert actual >= rate_hz * (1 - 1e-12)
    assert not np.any((available > rate_hz * (1 + 1e-9)) & (available < actual * (1 - 1e-9)))
    assert rates.next_up(actual) == actual


def test_the_usb_6211_rate_is_its_timebase_over_an_integer():
    assert USB_6211.inputs.rates.next_up(3000.0) == 20e6 / 6666


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("Dev1/ai0", ("Dev1/ai0",)),
        ("Dev1/ai0:2", ("Dev1/ai0", "Dev1/ai1", "Dev1/ai2")),
        ("Dev1/ai0:Dev1/ai1", ("Dev1/ai0", "Dev1/ai1")),
        ("Dev1/ai2:0", ("Dev1/ai2", "Dev1/ai1", "Dev1/ai0")),
        (" Dev1/ai0 , Dev2/ai3:4", ("Dev1/ai0", "Dev2/ai3", "Dev2/ai4")),
        ("", ()),
    ],
)
def test_lists_and_ranges_of_channel_names_are_expanded(text, names):
    assert expand(text) == names
