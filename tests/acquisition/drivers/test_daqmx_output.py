"""The streamed output over the real nidaqmx client, heard through the virtual rig's own inputs."""

from contextlib import ExitStack, suppress
from pathlib import Path

import numpy as np
import pytest

from acquisition.drivers.daqmx import DaqmxDigitizer
from acquisition.drivers.daqmx_output import DaqmxOutput, OutputConfig
from acquisition.errors import DataLost, InstrumentError, LimitExceeded
from acquisition.rig.configuration import load_rig
from acquisition.virtual.rig import VirtualRig

ROOT = Path(__file__).parents[3]
RATE_HZ = 12_800.0
CONFIG = OutputConfig("Dev1/ao0", limit_v=2.0, sample_rate_hz=RATE_HZ, ahead_s=0.5)
NOISE_V = 5e-3


@pytest.fixture
def digitizer():
    rig = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")
    # Only the drive is wanted, and the USB-4431 feeds sensors with another current than the NI 9234.
    daq = rig.daq.model_copy(
        update={
            "device": "Dev1",
            "product": "USB-4431",
            "sample_rate_hz": RATE_HZ,
            "channels": rig.daq.channels[:1],
        }
    )
    generator = rig.generator.model_copy(update={"resource": "USB0::0x0699::0x0353::AO1::INSTR"})
    rig = rig.model_copy(update={"daq": daq, "generator": generator})
    with VirtualRig(rig) as virtual, ExitStack() as closing:
        served = rig.model_copy(update={"daq": daq.model_copy(update={"server": virtual.daq_address})})
        opened = DaqmxDigitizer.open(served)
        closing.callback(opened.close)
        yield opened


@pytest.fixture
def output(digitizer):
    opened = DaqmxOutput.open(CONFIG, digitizer)
    yield opened
    opened.close()


def tone(first, count, amplitude_v=1.0):
    return amplitude_v * np.sin(2 * np.pi * 100.0 * (first + np.arange(count)) / RATE_HZ)


def test_what_is_streamed_is_heard_from_the_first_sample_on_without_a_gap(digitizer, output):
    written = 0
    output.write(tone(0, 6400))
    written += 6400
    output.arm()
    digitizer.start()
    heard = []
    for _ in range(20):
        heard.append(digitizer.read(1280).volts[0])
        count = min(1280, output.space)
        output.write(tone(written, count))
        written += count
    drive_v = 2.0 * np.concatenate(heard)  # the channel's divider
    angle = 2 * np.pi * 100.0 * np.arange(drive_v.size) / RATE_HZ
    late = slice(256, None)  # past the filter of the converter
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=1)[late]
    fitted = np.linalg.lstsq(basis, drive_v[late])[0]
    assert np.hypot(*fitted) == pytest.approx(1.0, rel=2e-2)
    assert np.max(np.abs(drive_v[late] - basis @ fitted)) < NOISE_V


def test_an_output_that_runs_dry_is_lost_data_and_ends_at_zero(digitizer, output):
    output.write(np.full(1280, 1.0))
    output.arm()
    digitizer.start()
    digitizer.read(6400)
    with pytest.raises(DataLost, match=r"ran out of samples"):
        output.write(np.zeros(1280))
    with suppress(DataLost):  # some drivers tell it again when the task is stopped
        output.stop()
    assert np.max(np.abs(digitizer.read(2560).volts[0][-640:])) < NOISE_V


def test_stopping_goes_to_zero_at_once(digitizer, output):
    output.write(np.full(6400, 1.0))
    output.arm()
    digitizer.start()
    assert np.median(digitizer.read(1280).volts[0]) == pytest.approx(0.5, rel=5e-2)
    output.stop()
    assert np.max(np.abs(digitizer.read(2560).volts[0][-640:])) < NOISE_V


@pytest.mark.parametrize("volts", [np.array([0.0, 2.01]), np.array([-2.01]), np.array([np.nan])])
def test_samples_past_the_limit_are_refused_before_they_are_written(output, volts):
    with pytest.raises(LimitExceeded, match=r"2 V are allowed"):
        output.write(volts)
    assert output.space == output.ahead_samples


def test_nothing_can_be_armed_before_something_is_written(output):
    with pytest.raises(InstrumentError, match=r"nothing to play"):
        output.arm()


def test_stop_and_close_are_legal_at_any_time_and_free_the_output(digitizer, output):
    output.stop()
    output.close()
    with pytest.raises(InstrumentError, match=r"stopped"):
        output.write(np.zeros(10))
    DaqmxOutput.open(CONFIG, digitizer).close()
