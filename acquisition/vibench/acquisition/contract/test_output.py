"""Requirements of every analogue output: start with the converter, play what is written, end at zero."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from vibench.acquisition.bench import Bench
from vibench.acquisition.contract.conftest import LEVEL, line_v, measured_v, refusal
from vibench.acquisition.errors import LimitExceeded
from vibench.acquisition.instruments import AnalogOutput, IdleOutput, PlugInKind, Samples

KIND = PlugInKind.OUTPUT
TONE_HZ = 160.0


def output_of(bench: Bench) -> AnalogOutput:
    assert bench.output is not None
    return bench.output


def tone(output: AnalogOutput, amplitude_v: float, first: int, count: int) -> Samples:
    time_s = np.arange(first, first + count) / output.sample_rate_hz
    return np.asarray(amplitude_v * np.sin(2 * np.pi * TONE_HZ * time_s))


def level_v(bench: Bench) -> float:
    assert bench.rig.daq.output is not None
    return LEVEL * bench.rig.daq.output.limit_v


@contextmanager
def playing(bench: Bench) -> Iterator[None]:
    """Play a tone that lasts as long as the samples written ahead."""
    output = output_of(bench)
    stretch = output.ahead_samples // 2
    output.write(tone(output, level_v(bench), 0, stretch))
    output.write(tone(output, level_v(bench), stretch, stretch))
    output.arm()
    bench.digitizer.start()
    yield
    output.stop()


def test_the_output_reports_its_identity_and_its_lead_time(bench: Bench) -> None:
    output = output_of(bench)
    assert output.identity.reply
    assert output.identity == output.identity
    assert bench.rig.daq.output is not None
    assert output.sample_rate_hz == pytest.approx(bench.rig.daq.output.sample_rate_hz, rel=1e-6)
    assert output.ahead_samples > 0
    assert output.idle in IdleOutput


def test_a_tone_starts_at_the_terminal_with_the_first_converter_sample(bench: Bench) -> None:
    with playing(bench):
        rate_hz = bench.digitizer.sample_rate_hz
        share = output_of(bench).ahead_samples / output_of(bench).sample_rate_hz
        row = bench.digitizer.read(int(0.8 * share * rate_hz))
        drive = bench.digitizer.roles.index("drive_voltage")
        volts = row.volts[drive] * bench.channels[drive].units_per_volt
    assert line_v(volts[len(volts) // 4 :], TONE_HZ, rate_hz) == pytest.approx(level_v(bench), rel=0.03)
    begun = int(np.argmax(np.abs(volts) > 0.3 * level_v(bench)))
    assert begun < 0.01 * rate_hz, "output and converter must start at the same sample"


@pytest.mark.parametrize("peak", [1.01, float("nan"), float("inf")])
def test_a_sample_beyond_the_limit_is_refused(bench: Bench, peak: float) -> None:
    output = output_of(bench)
    assert bench.rig.daq.output is not None
    with pytest.raises(LimitExceeded):
        output.write(np.array([0.0, peak * bench.rig.daq.output.limit_v, 0.0]))


def test_arming_without_written_samples_is_refused(bench: Bench) -> None:
    with refusal():
        output_of(bench).arm()


def test_stopping_outputs_zero_at_any_time_and_allows_another_stream(bench: Bench) -> None:
    output_of(bench).stop()
    with playing(bench):
        bench.digitizer.read(256)
    output_of(bench).stop()
    bench.digitizer.stop()
    bench.digitizer.start()
    assert float(np.ptp(measured_v(bench, 0.2))) < 0.1 * level_v(bench) + 2e-3
    bench.digitizer.stop()
    with playing(bench):
        bench.digitizer.read(256)


def test_closing_twice_is_allowed_and_later_writing_is_refused(bench: Bench) -> None:
    output = output_of(bench)
    output.close()
    output.close()
    with refusal():
        output.write(np.zeros(16))
