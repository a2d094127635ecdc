"""Multisine waveforms, checked by Fourier transform and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.acquisition.excitation.noise import (
    USUAL_POINTS as MEMORY_POINTS,
    WhiteNoise,
    flat_periods,
    held_lines,
    hold_droop,
)

BAND = np.arange(20, 801)
OVERSAMPLING = 16


def amplitudes_of(values):
    """Return line amplitudes of a zero-order-hold output, from a finely sampled staircase."""
    held = np.repeat(values, OVERSAMPLING)
    spectrum = 2 * np.abs(np.fft.rfft(held)) / len(held)
    # The staircase holds each of its fine samples; remove the droop of this second hold.
    fine = np.arange(len(spectrum))
    return spectrum * np.abs(hold_droop(fine, MEMORY_POINTS)) / _staircase_droop(fine)


def _staircase_droop(harmonics):
    """Return the gain of a sum of OVERSAMPLING equal samples at each harmonic: a Dirichlet kernel."""
    x = np.pi * harmonics / MEMORY_POINTS
    with np.errstate(invalid="ignore", divide="ignore"):
        kernel = np.abs(np.sin(x) / (OVERSAMPLING * np.sin(x / OVERSAMPLING)))
    return np.where(harmonics == 0, 1.0, kernel)


def test_the_played_spectrum_is_flat_in_the_band_and_empty_elsewhere():
    (values,) = flat_periods(BAND, realisations=1, seed=3)
    spectrum = amplitudes_of(values)[: MEMORY_POINTS // 2]
    inside = spectrum[BAND]
    outside = np.delete(spectrum, BAND)
    assert np.ptp(inside) / np.mean(inside) < 1e-10
    assert np.max(outside) / np.mean(inside) < 1e-10


def test_the_mean_of_a_multisine_period_is_zero():
    (values,) = flat_periods(BAND, realisations=1, seed=3)
    assert abs(np.mean(values)) < 1e-15


def test_all_realisations_have_equal_rms_and_the_largest_peak_is_at_full_scale():
    periods = flat_periods(BAND, realisations=6, seed=5)
    rms = [np.sqrt(np.mean(np.square(period))) for period in periods]
    peaks = [np.max(np.abs(period)) for period in periods]
    # The droop pre-compensation is phase-independent, so equal line amplitudes mean equal rms.
    np.testing.assert_allclose(rms, rms[0], rtol=1e-12)
    assert max(peaks) == pytest.approx(1.0, rel=1e-15)


def test_waveforms_of_a_plan_are_cached():
    first, again = (flat_periods(BAND, realisations=2, seed=5) for _ in range(2))
    assert all(one is other for one, other in zip(first, again, strict=True))
    with pytest.raises(ValueError, match="read-only"):
        first[0][0] = 0.0


def test_the_realisations_of_a_multisine_are_uncorrelated():
    first, second = flat_periods(BAND, realisations=2, seed=5)
    correlation = np.corrcoef(first, second)[0, 1]
    # The correlation of two random-phase multisines of L lines is a mean of L cosines: sd 1/sqrt(2 L).
    assert abs(correlation) < 5 / np.sqrt(2 * len(BAND))


def test_noise_periods_are_equal_for_equal_seeds_and_different_for_different_seeds():
    again = flat_periods(BAND, 1, seed=7)[0]
    np.testing.assert_array_equal(flat_periods(BAND, 1, seed=7)[0], again)
    assert not np.array_equal(flat_periods(BAND, 1, seed=8)[0], again)


def test_adding_realisations_does_not_change_the_phases_of_the_first_realisations():
    alone = flat_periods(BAND, 1, seed=7)[0]
    among = flat_periods(BAND, 4, seed=7)[0]
    np.testing.assert_allclose(among / np.max(np.abs(among)), alone, rtol=0, atol=1e-14)


def test_phases_are_chosen_for_a_low_crest_factor():
    (values,) = flat_periods(np.arange(10, 1001), 1, seed=1)
    crest = np.max(np.abs(values)) / np.sqrt(np.mean(values**2))
    # Crest factors of single realisations of 991 lines range from 3.18 to 4.53.
    assert 2.9 < crest < 3.6


def test_the_values_of_a_multisine_have_a_nearly_gaussian_distribution():
    (values,) = flat_periods(np.arange(10, 1001), 1, seed=1)
    kurtosis = np.mean(values**4) / np.mean(values**2) ** 2
    assert kurtosis == pytest.approx(3.0, abs=0.3)


@given(
    start=st.integers(1, 400),
    width=st.integers(1, 400),
    repetition_hz=st.sampled_from([0.1, 0.3, 0.5, 1.0, 2.0]),
)
def test_a_frequency_band_includes_harmonics_at_its_edges(start, width, repetition_hz):
    noise = WhiteNoise(
        amplitude_vpp=1.0,
        band_start_hz=start * repetition_hz,
        band_stop_hz=(start + width) * repetition_hz,
        repetition_hz=repetition_hz,
    )
    assert noise.lines[0] == start
    assert noise.lines[-1] == start + width


def test_the_spectrum_of_held_samples_matches_the_spectrum_of_a_finely_sampled_staircase():
    (values,) = flat_periods(BAND, 1, seed=2)
    picture = np.repeat(values, OVERSAMPLING)
    fine = 2 * np.fft.rfft(picture)[: 2 * MEMORY_POINTS] / len(picture)
    lines = held_lines(values, spans=4)
    # Staircase samples lie at the start of their hold; centring them shifts by half a fine sample.
    harmonics = np.arange(2 * MEMORY_POINTS)
    centred = fine * np.exp(-1j * np.pi * harmonics / len(picture)) * np.sinc(harmonics / len(picture))
    np.testing.assert_allclose(lines[1:], centred[1:], atol=1e-12)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32), first=st.integers(1, 100), count=st.integers(2, 300))
def test_no_value_of_a_multisine_exceeds_full_scale(seed, first, count):
    for values in flat_periods(np.arange(first, first + count), 2, seed):
        assert np.max(np.abs(values)) <= 1.0


def test_the_first_spectral_image_has_the_level_that_a_zero_order_hold_gives():
    (values,) = flat_periods(np.array([1000]), 1, seed=1)
    lines = np.abs(held_lines(values, spans=4))
    # -17.1 dB at 7192 Hz for 1000 Hz and 8192 points per second (ratio of the hold's gains).
    image_db = 20 * np.log10(lines[MEMORY_POINTS - 1000] / lines[1000])
    assert image_db == pytest.approx(-17.14, abs=0.01)
