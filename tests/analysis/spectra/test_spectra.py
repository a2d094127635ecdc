"""Spectral densities and amplitude spectra: scaling, bounds and peaks between spectral lines."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import signal

from vibench.analysis import InvalidRequest
from vibench.analysis.signals import Quantity
from vibench.analysis.spectra import amplitude_spectrum, spectral_density
from vibench.analysis.tones import largest_peak

RATE = 2048.0


def test_the_spectral_density_agrees_with_scipy():
    x = np.random.default_rng(1).standard_normal(30_000)
    ours = spectral_density(x, RATE, segment_samples=513, overlap=0.4)
    frequency, theirs = signal.welch(x, RATE, nperseg=513, noverlap=int(0.4 * 513), detrend=False)
    np.testing.assert_allclose(ours.density, theirs, rtol=1e-10)
    np.testing.assert_allclose(ours.frequency_hz, frequency)


def test_a_sine_on_a_line_has_half_its_squared_amplitude_as_power():
    x = np.sin(2 * np.pi * 64 * np.arange(8192) / RATE)
    result = spectral_density(x, RATE, segment_samples=1024)
    line = np.argmax(result.density)
    assert result.density[line] * result.noise_bandwidth_hz == pytest.approx(0.5, rel=1e-12)
    assert result.rms(50, 80) == pytest.approx(np.sqrt(0.5), rel=1e-9)


@pytest.mark.parametrize("overlap", [0.0, 0.5, 0.75])
def test_density_bounds_contain_the_true_density_in_95_percent_of_cases(overlap):
    rng = np.random.default_rng(2)
    inside = trials = 0
    for _ in range(300):
        result = spectral_density(rng.standard_normal(16 * 64), RATE, segment_samples=64, overlap=overlap)
        truth = 2 / RATE
        inner = slice(2, -2)
        inside += np.count_nonzero((result.lower[inner] <= truth) & (result.upper[inner] >= truth))
        trials += result.density[inner].size
    assert inside / trials == pytest.approx(0.95, abs=0.012)


@pytest.mark.parametrize("window", ["hann", "boxcar", "flattop", "blackmanharris"])
def test_a_sine_of_amplitude_1_has_a_spectral_peak_of_1(window):
    x = 3.0 + np.sin(2 * np.pi * 100 * np.arange(int(4 * RATE)) / RATE)
    spectrum = amplitude_spectrum(x[-int(2 * RATE) :], RATE, window=window)
    assert spectrum.amplitude.max() == pytest.approx(1, rel=1e-9)
    assert spectrum.frequency_hz[np.argmax(spectrum.amplitude)] == 100
    assert np.angle(spectrum.value[200]) == pytest.approx(-np.pi / 2, abs=1e-6)


def test_a_flat_top_window_measures_a_sine_between_lines_within_0_01_db():
    x = np.sin(2 * np.pi * 100.5 * np.arange(2048) / RATE)
    level = amplitude_spectrum(x, RATE, window="flattop").amplitude.max()
    assert 20 * np.log10(level) == pytest.approx(0, abs=0.02)


def test_a_velocity_spectrum_converts_to_displacement():
    x = 2 * np.pi * 100 * np.cos(2 * np.pi * 100 * np.arange(4096) / RATE)
    spectrum = amplitude_spectrum(x, RATE).convert(Quantity.VELOCITY, Quantity.DISPLACEMENT)
    assert spectrum.amplitude[200] == pytest.approx(1, rel=1e-9)
    assert np.isnan(spectrum.value[0])


@settings(deadline=None)
@given(frequency_hz=st.floats(60, 900), phase=st.floats(0, 6.28))
def test_a_peak_between_lines_has_the_right_frequency_and_amplitude(frequency_hz, phase):
    x = 0.7 * np.cos(2 * np.pi * frequency_hz * np.arange(4096) / RATE + phase)
    peak = largest_peak(amplitude_spectrum(x, RATE), 50, 950)
    assert peak.frequency_hz == pytest.approx(frequency_hz, abs=2e-4)
    assert peak.amplitude == pytest.approx(0.7, rel=1e-3)


def test_noise_alone_gives_no_peak_and_invalid_peak_requests_are_refused():
    spectrum = amplitude_spectrum(np.random.default_rng(4).standard_normal(4096), RATE)
    assert largest_peak(spectrum, 100, 900) is None
    with pytest.raises(InvalidRequest, match="no line"):
        largest_peak(spectrum, 100.01, 100.02)
    with pytest.raises(InvalidRequest, match="at least 2"):
        amplitude_spectrum(np.zeros(1), RATE)
