import numpy as np
import pytest
from scipy.signal import welch

from vibench.analysis.live._spectra import LiveSpectra

RATE = 10_000.0
SETTINGS = {"segment_samples": 1000, "averages": 40}


def live_spectra(samples, block, settings=SETTINGS):
    spectra = LiveSpectra(samples.shape[0], RATE, **settings)
    for first in range(0, samples.shape[1], block):
        spectra.add(samples[:, first : first + block].astype(np.float32))
    return spectra


@pytest.mark.parametrize("block", [17, 500, 5000])
def test_the_spectrum_matches_welch_for_any_block_size(block):
    samples = np.random.default_rng(1).standard_normal((2, 20_500))
    found = live_spectra(samples, block).spectrum()
    frequency_hz, density = welch(samples, RATE, "hann", 1000, 500, detrend=False)
    assert np.allclose(found.frequency_hz, frequency_hz)
    assert np.allclose(found.amplitude_density**2, density, rtol=1e-4)


def test_a_live_spectrum_excludes_samples_older_than_its_window():
    samples = np.zeros((1, 60_000))
    samples[0, :30_000] = np.random.default_rng(2).standard_normal(30_000)
    assert live_spectra(samples, 1000).spectrum().amplitude_density.max() == 0.0


def test_a_lost_sample_excludes_two_segments_from_a_live_spectrum():
    samples = np.random.default_rng(3).standard_normal((2, 20_500))
    whole = live_spectra(samples, 700).frequency_response((0, 1), low_hz=100.0, high_hz=1000.0)
    samples[0, 10_250] = np.nan
    torn = live_spectra(samples, 700).frequency_response((0, 1), low_hz=100.0, high_hz=1000.0)
    assert (whole.segments_used, torn.segments_used, torn.segments_excluded) == (40, 38, 2)
    assert np.isfinite(torn.value).all()


def test_the_transmission_of_an_integrator_is_within_its_bounds():
    """The response velocity is 3 times the integral of the base acceleration: |X/U| = 3."""
    rng = np.random.default_rng(4)
    count = 40_500
    spectrum = np.fft.rfft(rng.standard_normal(count))
    omega = 2j * np.pi * np.fft.rfftfreq(count, 1 / RATE)
    omega[0] = 1.0
    base = np.fft.irfft(spectrum, count)
    velocity = np.fft.irfft(3 * spectrum / omega, count)
    noisy = velocity + 0.02 * velocity.std() * rng.standard_normal(count)
    found = live_spectra(np.stack((base, noisy, base)), 1000).frequency_response(
        (0, 1, 2), low_hz=100.0, high_hz=900.0
    )
    assert found.frequency_hz[0] >= 100.0
    assert found.frequency_hz[-1] <= 900.0
    assert np.median(found.magnitude) == pytest.approx(3.0, rel=0.01)
    assert np.abs(found.phase_rad).max() < 0.3
    inside = (found.magnitude_lower <= 3.0) & (found.magnitude_upper >= 3.0)
    assert inside.mean() > 0.8
    assert found.n_eff == pytest.approx(40 / (1 + 2 * 39 / 40 / 36), rel=1e-3)
    assert found.coherence[0] > 0.95 > found.coherence[-1]


def test_the_delay_of_the_response_channel_is_corrected():
    samples = np.random.default_rng(5).standard_normal(40_500)
    late = np.stack((samples, np.roll(samples, 3)))
    late = live_spectra(late, 1000)
    straight = late.frequency_response((0, 1), low_hz=300.0, high_hz=3000.0, delay_s=3 / RATE)
    # If velocity equals base acceleration, X/U = i w: the phase is a quarter turn.
    assert np.allclose(np.abs(straight.phase_rad), np.pi / 2, atol=0.05)


def test_one_segment_gives_a_spectrum_but_no_transmission():
    spectra = LiveSpectra(2, RATE, **SETTINGS)
    assert spectra.spectrum() is None
    spectra.add(np.ones((2, 1000), dtype=np.float32))
    assert spectra.spectrum() is not None
    assert spectra.frequency_response((0, 1), low_hz=100.0, high_hz=1000.0) is None


def test_rejected_segments_are_excluded_and_later_segments_are_counted():
    rng = np.random.default_rng(5)
    spectra = live_spectra(rng.standard_normal((2, 10_000)), 1000)
    spectra.add(np.full((2, 2000), 1e6, dtype=np.float32))
    assert spectra.spectrum().amplitude_density.max() > 1e3
    spectra.leave_out(3000 / RATE)
    assert spectra.spectrum().amplitude_density.max() < 10.0
    spectra.add(rng.standard_normal((2, 4000)).astype(np.float32))
    assert spectra.frequency_response((0, 1), low_hz=100.0, high_hz=900.0) is not None
