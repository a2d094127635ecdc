"""The streamed output through the real nidaqmx client, measured by inputs of the virtual rig."""

from contextlib import ExitStack

import nidaqmx
import numpy as np
import pytest

from vibench.acquisition import ConfigurationError, InstrumentError, InstrumentLost, LimitExceeded
from vibench.acquisition.drivers import DaqmxDigitizer, DaqmxOutput
from vibench.acquisition.drivers._daqmx import daqmx_session
from vibench.acquisition.drivers._daqmx_output import _set_idle_output
from vibench.acquisition.errors import DataLost, InstrumentBusy, SettingRefused
from vibench.acquisition.instruments import AnalogOutput, IdleOutput
from vibench.acquisition.rig import OutputConfig, load_rig
from vibench.virtual_rig import VirtualRig

RATE_HZ = 12_800.0
CONFIG = OutputConfig(physical="ao0", limit_v=2.0, sample_rate_hz=RATE_HZ, ahead_s=0.5, source="test")
NOISE_V = 5e-3


@pytest.fixture
def virtual(rig):
    with VirtualRig(rig) as running:
        yield running


@pytest.fixture
def rig():
    rig = load_rig("virtual_rig")
    # Only the drive channel is used: the sensor current of the USB-4431 differs from that of the NI 9234.
    daq = rig.daq.model_copy(
        update={
            "device": "Dev1",
            "product": "USB-4431",
            "sample_rate_hz": RATE_HZ,
            "channels": rig.daq.channels[:1],
        }
    )
    generator = rig.generator.model_copy(update={"resource": "USB0::0x0699::0x0353::AO1::INSTR"})
    return rig.model_copy(update={"daq": daq, "generator": generator})


@pytest.fixture
def digitizer(rig, virtual):
    daq = rig.daq.model_copy(update={"server": virtual.daq_address})
    with ExitStack() as closing:
        opened = DaqmxDigitizer.open(rig.model_copy(update={"daq": daq}))
        closing.callback(opened.close)
        yield opened


def open_output(digitizer, **changes):
    return DaqmxOutput.open("Dev1/ao0", CONFIG.model_copy(update=changes), digitizer)


@pytest.fixture
def output(digitizer):
    opened = open_output(digitizer)
    yield opened
    opened.close()


def tone(first, count, amplitude_v=1.0):
    return amplitude_v * np.sin(2 * np.pi * 100.0 * (first + np.arange(count)) / RATE_HZ)


def test_a_stream_is_played_from_its_first_sample_without_gaps(digitizer, output):
    written = 0
    output.write(tone(0, 6400))
    written += 6400
    output.arm()
    digitizer.start()
    heard = []
    for _ in range(20):
        heard.append(digitizer.read(1280).volts[0])
        output.write(tone(written, 1280))
        written += 1280
    drive_v = 2.0 * np.concatenate(heard)  # divider of the channel
    angle = 2 * np.pi * 100.0 * np.arange(drive_v.size) / RATE_HZ
    late = slice(256, None)  # after the delay of the converter's filter
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=1)[late]
    fitted = np.linalg.lstsq(basis, drive_v[late])[0]
    assert np.hypot(*fitted) == pytest.approx(1.0, rel=2e-2)
    assert np.max(np.abs(drive_v[late] - basis @ fitted)) < NOISE_V


def test_an_output_underflow_is_reported_as_lost_data_and_the_output_ends_at_zero(digitizer, output):
    output.write(np.full(1280, 1.0))
    output.arm()
    digitizer.start()
    digitizer.read(6400)
    with pytest.raises(DataLost, match=r"ran out of samples"):
        output.write(np.zeros(1280))
    output.stop()
    assert np.max(np.abs(digitizer.read(2560).volts[0][-640:])) < NOISE_V


@pytest.mark.parametrize(
    ("device", "idle"), [("Dev1", IdleOutput.ZERO), ("Dev2", IdleOutput.HELD)], ids=["USB-4431", "USB-6211"]
)
def test_an_output_idles_at_zero_or_reports_that_it_cannot(virtual, device, idle):
    with nidaqmx.Task(grpc_options=daqmx_session(virtual.daq_address).options) as task:
        channel = task.ao_channels.add_ao_voltage_chan(f"{device}/ao0", min_val=-2, max_val=2)
        assert _set_idle_output(channel) is idle


def test_the_output_of_a_usb_4431_idles_at_zero(output):
    assert output.idle is IdleOutput.ZERO


@pytest.mark.parametrize("volts", [np.array([0.0, 2.01]), np.array([-2.01]), np.array([np.nan])])
def test_samples_beyond_the_limit_are_refused_before_writing(output, volts):
    with pytest.raises(LimitExceeded, match=r"2 V are allowed"):
        output.write(volts)
    with pytest.raises(InstrumentError, match=r"nothing to play"):
        output.arm()


def test_an_output_can_be_stopped_and_closed_at_any_time_and_is_then_free(digitizer, output):
    output.stop()
    output.stop()
    output.close()
    output.close()
    with pytest.raises(InstrumentError, match=r"closed"):
        output.write(np.zeros(10))
    open_output(digitizer).close()


def test_a_stopped_output_streams_again_from_sample_0(digitizer, output):
    for amplitude_v in (0.5, 1.0):
        output.write(tone(0, 6400, amplitude_v))
        output.arm()
        digitizer.start()
        heard = 2.0 * digitizer.read(6400).volts[0]
        output.stop()
        digitizer.stop()
        delay = 40  # delay of the converter's filter
        expected = tone(0, 6400 - delay, amplitude_v)
        np.testing.assert_allclose(heard[delay + 256 :], expected[256:], atol=0.03 * amplitude_v)


def test_an_output_that_another_program_left_high_is_set_to_zero_when_it_is_opened(digitizer, virtual):
    virtual.world.play("Dev1/ao0", np.full(51_200, 1.0), 51_200.0)
    digitizer.start()
    open_output(digitizer).close()
    assert np.max(np.abs(digitizer.read(2560).volts[0][-640:])) < NOISE_V


def test_an_output_in_use_is_reported_as_busy_to_a_second_program(digitizer, output):
    with pytest.raises(InstrumentBusy, match=r"Dev1/ao0"):
        open_output(digitizer)


def test_the_output_is_refused_and_released_if_it_would_change_the_requested_rate(digitizer):
    # The USB-6211 divides 20 MHz by an integer, which cannot give 12 345.6 Hz.
    with pytest.raises(SettingRefused, match=r"daq\.output\.sample_rate_hz"):
        DaqmxOutput.open("Dev2/ao0", CONFIG.model_copy(update={"sample_rate_hz": 12_345.6}), digitizer)
    DaqmxOutput.open("Dev2/ao0", CONFIG.model_copy(update={"sample_rate_hz": 12_500.0}), digitizer).close()


@pytest.mark.parametrize(
    ("physical", "changes", "kind", "said"),
    [
        ("Dev1/ao7", {}, ConfigurationError, r"Dev1/ao7 .*no such channel"),
        ("Dev9/ao0", {}, ConfigurationError, r"Dev9/ao0 .*no device with this name"),
        ("Dev1/ao0", {"limit_v": 5.0}, ConfigurationError, r"range.* not supported .*-3\.5 to 3\.5 V"),
        ("Dev1/ao0", {"sample_rate_hz": 2e5}, ConfigurationError, r"the requested rate.*1000 to 96000"),
    ],
)
def test_an_unsupported_setting_is_refused_with_a_readable_message(digitizer, physical, changes, kind, said):
    with pytest.raises(kind, match=said) as failure:
        DaqmxOutput.open(physical, CONFIG.model_copy(update=changes), digitizer)
    assert "\n" not in str(failure.value)
    open_output(digitizer).close()  # no device stays reserved


def test_the_error_for_a_lost_server_warns_that_the_output_may_still_play(digitizer, output, virtual):
    output.write(np.full(6400, 1.0))
    output.arm()
    digitizer.start()
    digitizer.read(1280)
    virtual.faults.lose_daq_server()
    for _ in range(2):  # a repeated attempt does not count as silence
        with pytest.raises(InstrumentLost, match=r"MAY STILL BE PLAYING.*0\.5 s.*switch the amplifier off"):
            output.stop()
    virtual.faults.heal()
    with pytest.raises(InstrumentLost, match="no longer knows the task"):
        digitizer.close()


def test_the_daqmx_output_reports_its_rate_its_lead_and_its_identity(output):
    promised: AnalogOutput = output
    assert (promised.sample_rate_hz, promised.ahead_samples) == (RATE_HZ, 6400)
    assert promised.identity.model == "USB-4431"
    assert promised.identity.reply.startswith("Dev1/ao0 of Dev1: USB-4431")
