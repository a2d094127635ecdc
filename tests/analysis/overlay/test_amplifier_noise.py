"""The draws of a twin include the noise of an amplifier whose output is not recorded."""

from dataclasses import replace

import numpy as np
import pytest

from tests.analysis.virtual_measurements import record, sampled_at
from vibench.acquisition import open_recording
from vibench.acquisition.plan import Dwell
from vibench.acquisition.rig import load_rig, specimen_of
from vibench.analysis.overlay.draws import voltage_source

RIG = load_rig("virtual_rig_accelerometers")
WEAK = Dwell(amplitude_vpp=0.02, frequency_hz=180, settle_s=1.0, duration_s=1.0)
BETWEEN_HZ = (300.0, 900.0)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Recording of a weak dwell at 25.6 kS/s, without a channel for the amplifier's output."""
    path = tmp_path_factory.mktemp("unseen") / "dwell.h5"
    with open_recording(record(path, WEAK, sampled_at(25_600.0, RIG))) as opened:
        yield opened


def noise_power(acceleration, rate_hz):
    """Mean power of the base acceleration beside the drive frequency, during the drive."""
    part = acceleration[round(1.6 * rate_hz) : round(2.6 * rate_hz)]
    lines = np.abs(np.fft.rfft((part - part.mean()) * np.hanning(part.size))) ** 2
    return float(np.mean(lines[slice(*(round(each) for each in BETWEEN_HZ))]))


@pytest.mark.thorough
def test_simulated_draws_of_the_twin_include_amplifier_noise_that_was_not_recorded(recording):
    """Without it the simulated base has 0.7 times the noise, and limits of weak motions are too narrow."""
    source = voltage_source(recording, specimen_of(RIG), draws=8)
    rate_hz = recording.sample_rate_hz
    drawn = [noise_power(source.channels(number).base_acceleration, rate_hz) for number in range(8)]
    measured = noise_power(recording.read("base_acceleration"), rate_hz)
    # 0.1 s without drive determines the noise power within 15 %.
    assert np.mean(drawn) == pytest.approx(measured, rel=0.2)
    assert source.run.why == ""


@pytest.mark.thorough
def test_a_twin_reports_that_the_amplifier_noise_is_unknown(recording):
    unheard = replace(recording, segments=())
    assert "noise of the amplifier is unknown" in voltage_source(unheard, specimen_of(RIG)).run.why
