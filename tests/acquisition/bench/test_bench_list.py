"""Finding instruments: available ones are listed, and buses that cannot be searched are reported."""

import pytest

from vibench.acquisition import list_instruments
from vibench.acquisition.rig import load_rig
from vibench.virtual_rig import VirtualRig


@pytest.fixture
def virtual():
    rig = load_rig("virtual_rig")
    generator = rig.generator.model_copy(update={"resource": "USB0::0x0699::0x0353::L0001::INSTR"})
    with VirtualRig(rig.model_copy(update={"generator": generator})) as running:
        yield running


@pytest.mark.thorough
def test_the_generator_and_the_converter_are_listed_under_the_names_used_in_configurations(virtual):
    found = list_instruments(server=virtual.daq_address)
    assert any("1689::851::L0001" in resource for resource in found.visa_resources)
    module = next(device for device in found.daq_devices if device.name == "cDAQ1Mod1")
    assert module.product == "NI 9234"
    assert module.inputs == tuple(f"cDAQ1Mod1/ai{number}" for number in range(4))
    assert found.remarks == ()


@pytest.mark.thorough
def test_a_missing_daq_driver_is_reported_and_other_instruments_are_listed(virtual):
    found = list_instruments()
    assert found.visa_resources
    assert found.daq_devices == ()
    assert any("no NI-DAQmx driver" in remark for remark in found.remarks)


@pytest.mark.thorough
def test_a_server_that_does_not_answer_is_named_in_the_remarks(virtual):
    assert any("127.0.0.1:9" in remark for remark in list_instruments(server="127.0.0.1:9").remarks)
