"""The virtual rig used by another program: pyvisa sets, nidaqmx reads."""

from contextlib import ExitStack

import grpc
import nidaqmx
import numpy as np
import pytest
import pyvisa
import usb.core
from nidaqmx.constants import AcquisitionType, Coupling, ExcitationSource
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.stream_readers import AnalogMultiChannelReader

from tests.changed import changed
from tests.virtual_rig.conftest import daq_error
from vibench.acquisition import AcquisitionError, ConfigurationError
from vibench.acquisition.rig import BaseQuantity, RigModel, load_rig
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.generator.scpi_instrument import Quirks
from vibench.virtual_rig.usb.bus import RemoteUsbDevice

SHIPPED = load_rig("virtual_rig")
RIG = changed(SHIPPED, generator={"resource": "USB0::0x0699::0x0353::C060606::INSTR"})
RATE_HZ = 12_800.0
DRIVE, AMPLIFIER, BASE, LASER = range(4)


class Program:
    """A user's program: a VISA session and a DAQ task on a virtual rig."""

    def __init__(self, rig, resources):
        self.rig = rig
        self.manager = pyvisa.ResourceManager("@py")
        resources.callback(self.manager.close)
        self.generator = self.manager.open_resource(rig.visa_resource)
        unlimited = [("grpc.max_receive_message_length", -1)]
        channel = resources.enter_context(grpc.insecure_channel(rig.daq_address, options=unlimited))
        self.options = nidaqmx.GrpcSessionOptions(channel, "")
        self._resources = resources

    def play(self, frequency_hz, amplitude_vpp, load="INF"):
        for command in (
            f"OUTP1:IMP {load}",
            "SOUR1:FUNC:SHAP SIN",
            f"SOUR1:FREQ {frequency_hz}",
            f"SOUR1:VOLT {amplitude_vpp}VPP",
            "OUTP1:STAT ON",
        ):
            self.generator.write(command)

    def task(self):
        task = self._resources.enter_context(nidaqmx.Task(grpc_options=self.options))
        for number, channel in enumerate(RIG.daq.channels):
            made = task.ai_channels.add_ai_voltage_chan(
                f"{RIG.daq.device}/{channel.physical}", min_val=-5, max_val=5
            )
            made.ai_coupling = Coupling[channel.coupling]
            if number == BASE:
                made.ai_excit_src = ExcitationSource.INTERNAL
                made.ai_excit_val = 0.002
        task.timing.cfg_samp_clk_timing(
            RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=128_000
        )
        return task

    def read(self, task, count):
        reader = AnalogMultiChannelReader(task.in_stream)
        reader.verify_array_shape = False
        volts = np.empty((len(RIG.daq.channels), count))
        reader.read_many_sample(volts, count, timeout=20.0)
        return volts


@pytest.fixture
def switch_on():
    """Return a function that switches a virtual rig on and connects a program to it."""
    with ExitStack() as resources:

        def connect(rig=RIG, **options):
            return Program(resources.enter_context(VirtualRig(rig, **options)), resources)

        yield connect


def serials_on_the_bus():
    return [device.serial_number for device in usb.core.find(find_all=True)]


def amplitude(volts):
    """Return the amplitude of a sine with nearly an integer number of periods in the samples."""
    return np.std(volts) * np.sqrt(2)


def test_a_sine_set_through_pyvisa_is_read_through_nidaqmx_over_the_whole_signal_chain(switch_on):
    program = switch_on()
    program.play(160, 0.2)
    task = program.task()
    program.read(task, 25_600)
    volts = program.read(task, 12_800)
    into_amplifier = 0.1 * RIG.generator.connected_ohm / (RIG.generator.connected_ohm + 50)
    model = RigModel(RIG)
    drive = amplitude(volts[DRIVE]) * RIG.daq.channels[DRIVE].attenuation
    assert drive == pytest.approx(into_amplifier, rel=2e-3)
    voltage = abs(complex(model.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, 160.0)))
    amplifier = amplitude(volts[AMPLIFIER]) * RIG.daq.channels[AMPLIFIER].attenuation
    assert amplifier == pytest.approx(voltage * into_amplifier, rel=5e-3)
    acceleration = abs(complex(model.transfer(BaseQuantity.ACCELERATION, 160.0)))
    base = amplitude(volts[BASE]) / RIG.accelerometer.sensitivity_v_per_m_per_s2
    assert base == pytest.approx(acceleration * into_amplifier, rel=0.01)
    assert amplitude(volts[LASER]) > 100 * np.std(volts[LASER][:-1] - volts[LASER][1:]) / RATE_HZ


def test_a_wrong_load_that_only_the_panel_can_set_doubles_the_voltage(switch_on):
    program = switch_on(quirks=Quirks(panel_load_ohm=50.0))
    program.play(160, 0.2)
    volts = program.read(program.task(), 6400)
    assert amplitude(volts[DRIVE]) * RIG.daq.channels[DRIVE].attenuation == pytest.approx(0.2, rel=0.01)


def test_a_stuck_output_is_reported_as_off_and_stays_on(switch_on):
    program = switch_on()
    program.play(160, 0.2)
    program.rig.faults.stick_output()
    program.generator.write("OUTP1:STAT OFF")
    assert program.generator.query("OUTP1:STAT?").strip() in ("0", "OFF")
    task = program.task()
    assert amplitude(program.read(task, 6400)[DRIVE]) == pytest.approx(0.05, rel=0.02)
    program.rig.faults.heal()
    program.read(task, 128)
    assert amplitude(program.read(task, 1280)[DRIVE]) < 1e-3


def test_the_usb_cable_is_served_on_the_daq_port_and_the_socket_answers(switch_on):
    program = switch_on()
    remote = RemoteUsbDevice(program.rig.daq_address)
    assert remote.identification.serial == "C060606"
    remote.close()
    socket = program.manager.open_resource(
        program.rig.socket_resource, read_termination="\n", write_termination="\n"
    )
    assert socket.query("*IDN?").startswith("TEKTRONIX,AFG1022,C060606")
    socket.close()


def test_a_rig_that_is_switched_off_has_no_address():
    with pytest.raises(AcquisitionError, match="switched off"):
        VirtualRig(RIG).daq_address  # noqa: B018 - asking is the test


@pytest.mark.parametrize(
    ("resource", "said"),
    [
        ("GPIB0::10::INSTR", "the virtual generator is a USB device"),
        ("USB0::0x1234::0x0001::C1::INSTR", "'0x1234' is not in .*; give one of 0x0699, "),
    ],
)
def test_a_generator_that_is_unknown_or_not_on_usb_cannot_be_simulated(resource, said):
    generator = RIG.generator.model_copy(update={"resource": resource})
    with pytest.raises(ConfigurationError, match=f"generator.resource = '{resource}': {said}"):
        VirtualRig(RIG.model_copy(update={"generator": generator}))


def test_a_rig_on_an_address_in_use_is_refused_and_starts_nothing():
    with VirtualRig(RIG) as first:
        other = changed(RIG, generator={"resource": "USB0::0x0699::0x0353::C2::INSTR"})
        with pytest.raises(ConfigurationError, match="cannot listen"), VirtualRig(other, first.daq_address):
            pass
        assert serials_on_the_bus() == ["C060606"]
    assert "C060606" not in serials_on_the_bus()


def test_every_kind_of_read_fails_after_an_overrun(switch_on):
    program = switch_on(RIG)
    task = program.task()
    task.start()
    program.rig.faults.overrun()
    for read in (task.read, task.read_waveform):
        with daq_error(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE):
            read(10)


def test_the_devices_have_the_names_that_the_rig_gives_them(switch_on):
    named = changed(RIG, daq={"device": "ShakerDaq"})
    program = switch_on(named)
    system = nidaqmx.system.System.remote(program.options)
    assert "ShakerDaq" in system.devices.device_names
    program.play(160, 0.2)
    task = program._resources.enter_context(nidaqmx.Task(grpc_options=program.options))
    task.ai_channels.add_ai_voltage_chan("ShakerDaq/ai0", min_val=-5, max_val=5)
    task.timing.cfg_samp_clk_timing(RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS)
    assert amplitude(np.array(task.read(6400, timeout=20.0))) == pytest.approx(0.05, rel=0.02)
