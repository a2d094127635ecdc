"""The real pyvisa, pyvisa-py and PyUSB on the virtual USB bus."""

import errno
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import pyvisa
import usb.core
from pyvisa.errors import VisaIOError

from vibench.acquisition import ConfigurationError
from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.scpi_instrument import Quirks
from vibench.virtual_rig.generator.terminal_voltage import Terminal
from vibench.virtual_rig.usb.bus import plug_in, unplug
from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument


def ignore_discovery_warnings(test):
    """Ignore warnings of pyvisa-py about optional packages and an unclosed socket during discovery."""
    for warning in (
        "ignore:TCPIP:UserWarning",
        "ignore:unclosed <socket:ResourceWarning",
        "ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning",
    ):
        test = pytest.mark.filterwarnings(warning)(test)
    return test


class PluggedIn:
    """A generator on the bus, and a pyvisa session with it."""

    def __init__(self, serial="C010101", quirks=None):
        terminal = Terminal(noise_v_per_rt_hz=0.0)
        self.generator = AFG1022(lambda: 0.0, serial=serial, quirks=quirks or Quirks(), terminal=terminal)
        self.cable = UsbTmcInstrument(self.generator)
        plug_in(self.cable)
        self.resources = pyvisa.ResourceManager("@py")
        self.instrument = self.resources.open_resource(f"USB0::0x0699::0x0353::{serial}::INSTR")

    def close(self):
        self.instrument.close()
        self.resources.close()
        unplug(self.cable)


@pytest.fixture
def plugged():
    one = PluggedIn()
    yield one
    one.close()


@ignore_discovery_warnings
def test_a_plain_pyvisa_script_can_list_and_open_and_query_and_upload(plugged):
    # The code below does not know that the instrument is simulated.
    rm = pyvisa.ResourceManager("@py")
    (name,) = [name for name in rm.list_resources() if "::1689::851::" in name]
    plugged.instrument.close()
    afg = rm.open_resource(name)
    afg.timeout = 5000
    maker, model, serial, _ = afg.query("*IDN?").strip().split(",")
    assert (maker, model, serial) == ("TEKTRONIX", "AFG1022", "C010101")
    afg.write("*RST")
    afg.write("OUTPut1:STATe OFF")
    t = np.linspace(0, 2 * np.pi, 1024, endpoint=False)
    codes = np.round((np.sin(t) + 1) / 2 * 16383).astype(int)
    afg.write_binary_values("DATA:DATA EMEMory,", codes, datatype="H", is_big_endian=True)
    afg.write("DATA:COPY USER1,EMEM")
    afg.write("SOURce1:FUNCtion:SHAPe USER1")
    afg.write("SOURce1:FREQuency:FIXed 100Hz")
    afg.write("SOURce1:VOLTage:LEVel:IMMediate:AMPLitude 2Vpp")
    afg.write("OUTPut1:STATe ON")
    assert float(afg.query("SOURce1:FREQuency?")) == 100.0
    assert afg.query("SYSTem:ERRor?").strip() == '0,"No error"'
    volts = plugged.generator.render(0.0, 1e-5, 1000)
    afg.close()
    # The setting for 50 ohm gives 4 V peak to peak at the amplifier's 15 kohm input, not 2 V.
    assert np.ptp(volts) == pytest.approx(4.0 * 15_000 / 15_050, rel=1e-3)


@pytest.mark.parametrize("points", [2, 3, 31, 1000, 8191, 8192])
def test_an_upload_of_any_length_is_read_back_unchanged(plugged, points):
    codes = np.random.default_rng(points).integers(0, 16384, points)
    plugged.instrument.write_binary_values("DATA:DATA EMEM,", codes, datatype="H", is_big_endian=True)
    back = plugged.instrument.query_binary_values(
        "DATA:DATA? EMEM", datatype="H", is_big_endian=True, container=np.array
    )
    assert np.array_equal(back, codes)
    assert int(plugged.instrument.query("DATA:POIN? EMEM")) == points
    assert plugged.instrument.query("SYST:ERR?").startswith("0,")


def test_a_reply_later_than_the_timeout_is_a_visa_timeout_and_arrives_afterwards(plugged):
    plugged.instrument.timeout = 500
    plugged.generator.delay_next_reply(0.8)
    with pytest.raises(VisaIOError) as error:
        plugged.instrument.query("*OPC?")
    assert error.value.error_code == pyvisa.constants.StatusCode.error_timeout
    assert plugged.instrument.read().strip() == "1"


@pytest.mark.parametrize("how", ["cable", "bus"])
def test_a_lost_device_raises_an_error_on_every_call_and_keeps_its_output(plugged, how):
    plugged.instrument.write("OUTP ON")
    if how == "cable":
        plugged.cable.fail(errno.ENODEV)
    else:
        unplug(plugged.cable)
    for call in (
        lambda: plugged.instrument.write("OUTP OFF"),
        lambda: plugged.instrument.query("*IDN?"),
        plugged.instrument.read,
    ):
        with pytest.raises(ValueError, match="No such device"):
            call()
    assert plugged.generator.execute(b"OUTP?").data == b"1\n"


def test_a_reconnected_cable_works_with_the_open_session(plugged):
    plugged.cable.fail(errno.ENODEV)
    plugged.cable.mend(errno.ENODEV)
    assert plugged.instrument.query("*OPC?").strip() == "1"


@ignore_discovery_warnings
def test_several_generators_on_one_bus_are_independent(plugged):
    other = PluggedIn(serial="C020202")
    try:
        plugged.instrument.write("FREQ 111")
        other.instrument.write("FREQ 222")
        assert float(plugged.instrument.query("FREQ?")) == 111
        assert float(other.instrument.query("FREQ?")) == 222
        names = plugged.resources.list_resources()
        assert [name.split("::")[3] for name in names if name.startswith("USB")] == ["C010101", "C020202"]
    finally:
        other.close()


def test_one_serial_number_cannot_be_plugged_in_twice(plugged):
    twin = UsbTmcInstrument(AFG1022(lambda: 0.0))
    with pytest.raises(ConfigurationError, match=r"C010101.*already on the virtual USB bus"):
        plug_in(twin)


def test_a_second_session_is_refused_while_the_first_is_open(plugged):
    name = plugged.instrument.resource_name
    with pytest.raises(usb.core.USBError, match="busy"):
        plugged.resources.open_resource(name)
    plugged.instrument.close()
    plugged.instrument = plugged.resources.open_resource(name)
    assert plugged.instrument.query("*OPC?").strip() == "1"


def test_pyusb_reads_the_manufacturer_the_product_and_the_serial_number(plugged):
    device = usb.core.find(idVendor=0x0699, idProduct=0x0353)
    assert (device.manufacturer, device.product, device.serial_number) == ("TEKTRONIX", "AFG1022", "C010101")
    assert "Bulk OUT" in str(device) or "bulk" in str(device).lower()


def test_the_usb_bus_works_if_pyvisa_was_imported_first_without_libusb():
    program = """
        import warnings
        warnings.simplefilter("ignore")
        import usb.backend.libusb0, usb.backend.libusb1, usb.backend.openusb
        for module in (usb.backend.libusb0, usb.backend.libusb1, usb.backend.openusb):
            module.get_backend = lambda find_library=None: None  # a machine without libusb
        import pyvisa
        rm = pyvisa.ResourceManager("@py")
        name = "USB0::0x0699::0x0353::C010101::INSTR"
        try:
            rm.open_resource(name)
        except ValueError as error:
            print("before:", type(error).__name__)
        from vibench.virtual_rig.usb.bus import plug_in
        from vibench.virtual_rig.generator.afg1022 import AFG1022
        from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument
        plug_in(UsbTmcInstrument(AFG1022(lambda: 0.0)))
        print("after:", rm.open_resource(name).query("*IDN?").split(",")[1])
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout.split() == ["before:", "ValueError", "after:", "AFG1022"], done.stderr
