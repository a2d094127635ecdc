"""A spectrogram of bounded size has the right amplitudes and times for any block size."""

import numpy as np
import pytest

from vibench.analysis import InvalidRequest, NotEnoughData
from vibench.analysis.spectra import MOST_COLUMNS, SpectrogramSums

RATE = 4000.0


def picture(signal, cuts=(), **how):
    sums = SpectrogramSums(RATE, signal.size, **{"highest_hz": 1000.0, **how})
    for block in np.split(signal, cuts):
        sums.add(block)
    return sums.spectrogram()


def test_the_spectrogram_of_a_sine_has_the_right_amplitude_and_frequency_at_all_times():
    time_s = np.arange(40_000) / RATE
    found = picture(3.0 * np.sin(2 * np.pi * 200 * time_s))
    row = int(np.argmin(np.abs(found.frequency_hz - 200)))
    assert found.amplitude[row] == pytest.approx(3.0, rel=1e-3)
    assert np.all(np.argmax(found.amplitude, axis=0) == row)


def test_the_spectrogram_of_a_chirp_follows_the_frequency_of_the_chirp():
    time_s = np.arange(80_000) / RATE
    found = picture(np.sin(2 * np.pi * (100 * time_s + 0.5 * 40 * time_s**2)))
    loudest = found.frequency_hz[np.argmax(found.amplitude, axis=0)]
    assert loudest == pytest.approx(100 + 40 * found.time_s, abs=6)


def test_the_size_of_a_spectrogram_is_bounded_and_does_not_depend_on_the_block_size():
    signal = np.random.default_rng(0).standard_normal(800_000)
    whole = picture(signal)
    assert whole.amplitude.shape[1] == MOST_COLUMNS
    parts = picture(signal, cuts=(1, 500, 77_777, 500_000))
    np.testing.assert_allclose(parts.amplitude, whole.amplitude, rtol=1e-12)
    np.testing.assert_allclose(parts.time_s, whole.time_s)


def test_invalid_spectrogram_requests_are_refused():
    with pytest.raises(NotEnoughData, match="segment"):
        picture(np.zeros(100))
    with pytest.raises(InvalidRequest, match="half"):
        picture(np.zeros(10_000), highest_hz=3000.0)
