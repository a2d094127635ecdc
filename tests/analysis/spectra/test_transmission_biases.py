"""Systematic errors of the transmission from delay and finite resolution match theory."""

import numpy as np
import pytest
from scipy import fft, signal

from vibench.analysis import transmissibility

RATE = 1024.0
SEGMENT = 256


def lagged_share(lag):
    """Autocorrelation of the Hann window at ``lag`` samples."""
    taper = signal.get_window("hann", SEGMENT)
    return float(taper[:-lag] @ taper[lag:] / (taper @ taper))


@pytest.mark.parametrize("lag", [3, 40, 90])
def test_a_delay_lowers_h1_by_the_share_of_the_segment_that_it_removes(lag):
    """E[h1] = rho(lag) exp(-i omega lag), with the autocorrelation rho of the window."""
    record = np.random.default_rng(41).standard_normal(600_000)
    found = transmissibility(record[lag:], record[:-lag], RATE, segment_samples=SEGMENT)
    inner = slice(3, -3)
    straight = found.without_delay(lag / RATE).value[inner]
    own_error = np.sqrt(np.mean(found.relative_sd_magnitude[inner] ** 2) / straight.size) * lagged_share(lag)
    assert np.mean(straight.real) == pytest.approx(lagged_share(lag), abs=6 * own_error + 1e-4)
    assert np.mean(straight.imag) == pytest.approx(0, abs=6 * own_error + 1e-4)


def test_a_peak_narrower_than_the_resolution_has_the_shape_of_the_window_spectrum():
    """E[h1] = sum H |W|^2 / sum |W|^2 for a white drive; peak width 8 Hz, resolution 6 Hz."""
    omega, damping = 2 * np.pi * 260, 0.02
    section = signal.bilinear([2 * damping * omega, omega**2], [1, 2 * damping * omega, omega**2], fs=RATE)
    drive = np.random.default_rng(42).standard_normal(1_500_000)
    found = transmissibility(drive, signal.lfilter(*section, drive), RATE, segment_samples=SEGMENT)
    finer = 64
    fine_hz = fft.fftfreq(finer * SEGMENT, 1 / RATE)
    _, true = signal.freqz(*section, worN=2 * np.pi * fine_hz / RATE)
    seen = np.abs(fft.fft(signal.get_window("hann", SEGMENT), finer * SEGMENT)) ** 2
    smeared = fft.ifft(fft.fft(true) * fft.fft(seen)) / seen.sum()
    line = int(np.argmax(np.abs(true[: finer * SEGMENT // 2 : finer])))
    expected = smeared[finer * line]
    loss = abs(expected) / abs(true[finer * line]) - 1
    assert loss < -0.1
    assert abs(found.value[line] / expected - 1) < 4 * np.sqrt(2) * found.relative_sd_magnitude[line]
    assert abs(found.value[line] / expected - 1) < -loss / 5
