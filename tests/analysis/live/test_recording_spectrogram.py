"""The spectrogram of a part of a recording has the right densities at the right places."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.acquisition import Block
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)
from vibench.analysis import NotEnoughData
from vibench.analysis.live import RowSpacing, SpectrogramRequest, recording_spectrogram

RATE = 4000.0
SIGMA = 0.01


@pytest.fixture(scope="module")
def request_(tmp_path_factory):
    """Request for a recording of 3 s of a 250 Hz sine and 3 s of white noise of known density."""
    path = tmp_path_factory.mktemp("spectrogram") / "a.h5"
    time_s = np.arange(int(3 * RATE)) / RATE
    noise = SIGMA * np.random.default_rng(1).standard_normal(time_s.size)
    signal = np.concatenate((0.5 * np.sin(2 * np.pi * 250 * time_s), noise))
    header = RecordingHeader(
        channels=(ChannelHeader("m0_velocity", "dev/ai0", "velocity", "m s-1", 1.0, 1.0),),
        sample_rate_hz=RATE,
        expected_samples=signal.size,
        origin=Origin.SIMULATED,
        plan_json="{}",
        bench_json="{}",
    )
    writer = create_recording(path, header)
    writer.append(Block(0, signal[np.newaxis], ()))
    writer.finish(RecordingState.COMPLETE, "made")
    return SpectrogramRequest(path, "m0_velocity", 0, signal.size, 1000.0, RowSpacing.LINEAR)


def level_db(found, time_s, frequency_hz):
    """Level [dB] of the spectrogram at a time and frequency."""
    rows, columns = found.decibel.shape
    low, high = found.frequency_hz
    if found.request.spacing is RowSpacing.LOGARITHMIC:
        low, high, frequency_hz = np.log10([low, high, frequency_hz])
    row = int((frequency_hz - low) / (high - low) * rows)
    begin_s, end_s = found.time_s
    return found.decibel[row, int((time_s - begin_s) / (end_s - begin_s) * columns)]


@pytest.mark.parametrize("spacing", RowSpacing)
def test_the_density_of_a_sine_is_its_power_divided_by_the_window_bandwidth(request_, spacing):
    found = recording_spectrogram(replace(request_, spacing=spacing))
    bandwidth_hz = 1.5 / found.segment_s
    assert level_db(found, 1.5, 250.0) == pytest.approx(10 * np.log10(0.5**2 / 2 / bandwidth_hz), abs=0.1)
    assert level_db(found, 4.5, 250.0) < level_db(found, 1.5, 250.0) - 30
    assert found.unit == "m s-1"


def test_the_spectral_density_of_white_noise_does_not_depend_on_the_window_length(request_):
    for stretch_s in (0.6, 2.9):
        asked = replace(request_, start=int(3 * RATE), stop=int((3 + stretch_s) * RATE))
        found = recording_spectrogram(asked)
        mean = 10 * np.log10(np.mean(10 ** (found.decibel[5:] / 10)))
        assert mean == pytest.approx(10 * np.log10(2 * SIGMA**2 / RATE), abs=0.3)
        assert found.time_s == pytest.approx((3.0, 3.0 + stretch_s), abs=0.05)


def test_a_range_shorter_than_a_window_is_refused_with_a_readable_message(request_):
    with pytest.raises(NotEnoughData, match="10 samples"):
        recording_spectrogram(replace(request_, stop=10))


@pytest.mark.parametrize("width_hz", [1.0, 5.0, 50.0])
def test_spectrogram_lines_have_the_requested_width(request_, width_hz):
    found = recording_spectrogram(replace(request_, resolution_hz=width_hz))
    assert found.resolution_hz == pytest.approx(width_hz, rel=0.3)
