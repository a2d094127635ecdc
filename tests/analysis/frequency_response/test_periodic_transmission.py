"""Periodic noise: no leakage between two clocks, separate noise and distortion, correct bounds."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.analysis import InvalidRequest, NotEnoughData
from vibench.analysis.errors import UnusableData
from vibench.analysis.frequency_response.periodic import PeriodicSums, Scatter

RATE = 5120.0


def periodic_frequency_response(realisations, rate_hz, *, repetition_hz, delay_s=0.0, orders=None):
    """Estimate the transmission from realisations (drive, base, response) of a multisine."""
    sums = PeriodicSums(rate_hz, repetition_hz)
    for rows in realisations:
        sums.add(*rows)
    return sums.frequency_response(delay_s=delay_s, orders=orders)


def multisine(orders, phases, period_samples, samples):
    """Return the sum of unit sines; the period need not be a whole number of samples."""
    turns = np.arange(samples) / period_samples
    return np.sum(
        [np.cos(2 * np.pi * ((k * turns) % 1) + p) for k, p in zip(orders, phases, strict=True)], axis=0
    )


def resonator(frequency_hz):
    return 260**2 / (260**2 - frequency_hz**2 + 2j * 0.02 * 260 * frequency_hz)


def linear_realisation(rng, orders, period_samples, samples, delay_samples=0.0):
    phases = rng.uniform(0, 2 * np.pi, orders.size)
    frequency_hz = orders * RATE / period_samples
    exact = resonator(frequency_hz)
    turns = np.arange(samples) / period_samples
    drive = np.zeros(samples)
    response = np.zeros(samples)
    for k, p, h in zip(orders, phases, exact, strict=True):
        angle = 2 * np.pi * ((k * turns) % 1) + p
        drive += np.cos(angle)
        response += np.abs(h) * np.cos(angle + np.angle(h) - 2 * np.pi * k * delay_samples / period_samples)
    return drive, response


@settings(max_examples=12, deadline=None)
@given(offset_ppm=st.floats(-90, 90), period=st.floats(700, 1500), periods=st.integers(2, 6))
def test_periodic_lines_are_exact_for_any_clock_ratio_and_period(offset_ppm, period, periods):
    true_period = period * (1 + offset_ppm * 1e-6)
    orders = np.arange(3, int(0.3 * period), 7)
    rng = np.random.default_rng(1)
    samples = int(np.ceil(periods * period))
    drive, response = linear_realisation(rng, orders, true_period, samples)
    result = periodic_frequency_response([(drive, drive, response)], RATE, repetition_hz=RATE / period)
    exact = resonator(orders * RATE / true_period)
    np.testing.assert_allclose(
        result.frequency_response.frequency_hz, orders * RATE / true_period, rtol=1e-10
    )
    assert np.max(np.abs(result.frequency_response.value / exact - 1)) < 1e-6
    assert result.repetitions[0].period_samples == pytest.approx(true_period, rel=1e-10)


def test_the_scatter_of_the_measured_repetition_period_is_as_stated():
    from vibench.analysis.frequency_response.periodic import measured_repetition

    rng = np.random.default_rng(2)
    orders = np.arange(10, 60)
    clean = multisine(orders, rng.uniform(0, 6, orders.size), 512.01, 2560)
    found = [measured_repetition(clean + 0.5 * rng.standard_normal(2560), 512.0) for _ in range(150)]
    periods = [one.period_samples for one in found]
    stated = np.mean([one.sd_samples for one in found])
    assert np.std(periods) == pytest.approx(stated, rel=0.2)
    assert np.mean(periods) == pytest.approx(512.01, abs=4 * stated / np.sqrt(150))


def test_zero_order_hold_images_do_not_affect_the_measured_clock_or_the_band():
    """A zero-order hold of 8192 points per period adds an image at 8192 - k; 10 dB lower here."""
    rng = np.random.default_rng(9)
    period = 51200 * (1 + 60e-6)
    band, image = np.arange(20, 600, 19), 8192 - np.arange(20, 600, 19)
    drive = multisine(band, rng.uniform(0, 6, band.size), period, 102_400)
    drive += 0.3 * multisine(image, rng.uniform(0, 6, image.size), period, 102_400)
    result = periodic_frequency_response([(drive, drive, drive)], 51200.0, repetition_hz=1.0, orders=band)
    assert result.repetitions[0].period_samples == pytest.approx(period, rel=1e-10)
    assert result.repetitions[0].periods == 2
    np.testing.assert_allclose(result.frequency_response.frequency_hz, band * 51200 / period)
    with pytest.raises(InvalidRequest, match="requested line is 30000; known lines end at 20481"):
        periodic_frequency_response(
            [(drive, drive, drive)], 51200.0, repetition_hz=1.0, orders=np.array([30_000])
        )


def test_the_delay_of_the_response_channel_is_removed():
    rng = np.random.default_rng(3)
    orders = np.arange(5, 100)
    drive, response = linear_realisation(rng, orders, 512.0, 2048, delay_samples=2.7)
    result = periodic_frequency_response(
        [(drive, drive, response)], RATE, repetition_hz=RATE / 512, delay_s=2.7 / RATE
    )
    np.testing.assert_allclose(result.frequency_response.value, resonator(orders * 10.0), rtol=1e-6)


@pytest.mark.parametrize("count", [2, 3, 8])
def test_transmission_bounds_have_their_stated_coverage(count):
    """A static cubic nonlinearity makes the realisations differ by more than the noise."""
    rng = np.random.default_rng(count)
    period, orders, cube = 128, np.arange(1, 31), 0.02
    power = orders.size / 2
    inside_magnitude = inside_phase = trials = 0
    best = 1 + 3 * cube * power * (1 - 1 / (2 * orders.size))
    for _ in range(60):
        sums = PeriodicSums(RATE, RATE / period)
        for _ in range(count):
            drive = multisine(orders, rng.uniform(0, 2 * np.pi, orders.size), period, 3 * period)
            response = drive + cube * drive**3 + 0.3 * rng.standard_normal(drive.size)
            sums.add(drive, drive, response)
        result = sums.frequency_response().frequency_response
        inside_magnitude += np.count_nonzero(
            (result.magnitude_lower <= best) & (result.magnitude_upper >= best)
        )
        inside_phase += np.count_nonzero((result.phase_lower_rad <= 0) & (result.phase_upper_rad >= 0))
        trials += result.value.size
    own_error = 4 * np.sqrt(0.95 * 0.05 / trials)
    assert inside_phase / trials == pytest.approx(0.95, abs=own_error)
    assert inside_magnitude / trials == pytest.approx(0.95, abs=own_error + 0.01)


@pytest.mark.thorough
@pytest.mark.parametrize("sigma", [0.5, 2.0])
def test_the_linear_gain_of_a_cubic_nonlinearity_matches_the_closed_form(sigma):
    """The linear gain of u + 0.1 u^3 for noise of variance s^2 is 1 + 0.3 s^2."""
    rng = np.random.default_rng(4)
    orders = np.arange(1, 201)
    sums = PeriodicSums(RATE, RATE / 1024)
    for _ in range(60):
        drive = multisine(orders, rng.uniform(0, 2 * np.pi, orders.size), 1024, 2048)
        drive *= sigma / np.sqrt(orders.size / 2)
        sums.add(drive, drive, drive + 0.1 * drive**3)
    result = sums.frequency_response()
    assert np.mean(result.frequency_response.value.real) == pytest.approx(1 + 0.3 * sigma**2, rel=0.015)
    assert np.all(result.noise_variance < 1e-12)
    assert result.distortion_variance is not None
    assert np.mean(result.distortion_variance) > 1e-6


def test_noise_on_the_base_does_not_bias_the_estimate_that_uses_the_drive_as_reference():
    rng = np.random.default_rng(7)
    orders = np.arange(5, 105)
    sums = PeriodicSums(RATE, RATE / 512)
    for _ in range(20):
        drive = multisine(orders, rng.uniform(0, 2 * np.pi, orders.size), 512, 1024)
        sums.add(drive, drive + 4 * rng.standard_normal(1024), 2 * drive + 4 * rng.standard_normal(1024))
    result = sums.frequency_response().frequency_response
    error = (result.value - 2) / (2 * result.relative_sd_magnitude)
    assert abs(np.mean(error.real)) < 4 / np.sqrt(orders.size)


def test_bounds_from_one_realisation_include_only_noise():
    orders = np.arange(5, 105)
    drive = multisine(orders, orders**2.0, 512, 2048)
    result = periodic_frequency_response([(drive, drive, drive)], RATE, repetition_hz=10.0)
    assert result.scatter is Scatter.PERIODS
    assert result.distortion_variance is None


def test_a_drive_that_is_too_short_or_silent_or_aperiodic_is_refused():
    rng = np.random.default_rng(8)
    short = rng.standard_normal(700)
    with pytest.raises(NotEnoughData, match="at least 2"):
        periodic_frequency_response([(short, short, short)], RATE, repetition_hz=10.0)
    silent = np.zeros(2048)
    with pytest.raises(UnusableData, match="silent"):
        periodic_frequency_response([(silent, silent, silent)], RATE, repetition_hz=10.0)
    noise = rng.standard_normal(4096)
    with pytest.raises(UnusableData, match="does not repeat"):
        periodic_frequency_response([(noise, noise, noise)], RATE, repetition_hz=10.0)
    with pytest.raises(NotEnoughData, match="no realisation"):
        periodic_frequency_response([], RATE, repetition_hz=10.0)
    with pytest.raises(InvalidRequest, match="equally long"):
        periodic_frequency_response([(noise, noise[1:], noise)], RATE, repetition_hz=10.0)
    with pytest.raises(InvalidRequest, match="quarter"):
        periodic_frequency_response([], RATE, repetition_hz=2000.0)
