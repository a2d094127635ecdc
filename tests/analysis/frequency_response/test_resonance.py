"""Resonance fits: exact without noise, correct uncertainties with noise, none in pure noise."""

import dataclasses
import runpy
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import signal
from threadpoolctl import threadpool_info, threadpool_limits

from vibench.analysis import Estimator, FrequencyResponse, InvalidRequest, resonances, transmissibility
from vibench.analysis.frequency_response.periodic import PeriodicSums
from vibench.analysis.frequency_response.resonance import scattered_resonances
from vibench.analysis.frequency_response.results import (
    FrequencyResponseSettings,
    converted_frequency_response,
)
from vibench.analysis.frequency_response.transmissibility import steady_relative_sd
from vibench.analysis.signals import Quantity, student_half_width


def curve(frequency_hz, value, relative=1e-4, resolution_hz=0.0, coherence=0.99):
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        value=value,
        coherence=np.full(frequency_hz.size, coherence),
        n_eff=50.0,
        relative_sd_magnitude=np.broadcast_to(relative, frequency_hz.shape),
        sd_phase_rad=np.broadcast_to(relative, frequency_hz.shape),
        half_width=student_half_width(np.broadcast_to(relative, frequency_hz.shape), 50.0, 0.95),
        coherence_significance=0.06,
        resolution_hz=resolution_hz,
        segments_used=50,
        segments_excluded=0,
        settings=FrequencyResponseSettings(Estimator.H1, 5120.0, 5120, "hann", 0.5, 0.95),
    )


def single(frequency_hz, natural_hz, damping):
    ratio = frequency_hz / natural_hz
    return 1 / (1 - ratio**2 + 2j * damping * ratio)


def specimen(frequency_hz):
    """X / U of the paper's equation 1 without contact, c_i = 2e-5 s k_i."""
    masses = np.array([5.8e-3, 2.1e-3, 2e-3])
    stiffness = masses * (2 * np.pi * np.array([322.0, 100.0, 390.6])) ** 2
    result = []
    for f in frequency_hz:
        s = 2j * np.pi * f
        k0, k1, k2 = stiffness * (1 + 2e-5 * s)
        matrix = np.array([[k0 + k2, 0, -k2], [0, k1, -k1], [-k2, -k1, k1 + k2]]) + np.diag(masses) * s**2
        result.append(np.linalg.solve(matrix, [k0, 0, 0])[0])
    return np.array(result)


def modes():
    """Natural frequencies [Hz] and damping ratios of the specimen from its eigenvalue problem."""
    masses = np.array([5.8e-3, 2.1e-3, 2e-3])
    k0, k1, k2 = masses * (2 * np.pi * np.array([322.0, 100.0, 390.6])) ** 2
    matrix = np.array([[k0 + k2, 0, -k2], [0, k1, -k1], [-k2, -k1, k1 + k2]])
    omega = np.sqrt(np.linalg.eigvals(matrix / masses[:, None]).real)
    return np.sort(omega) / (2 * np.pi), 2e-5 * np.sort(omega) / 2


@pytest.mark.thorough
@settings(deadline=None, max_examples=8)
@given(natural_hz=st.floats(150, 350), damping=st.floats(0.003, 0.08))
def test_a_single_mode_is_recovered_exactly(natural_hz, damping):
    frequency_hz = np.arange(50, 500, 0.5)
    (found,) = resonances(
        curve(frequency_hz, single(frequency_hz, natural_hz, damping)), low_hz=60, high_hz=490
    )
    assert found.frequency_hz == pytest.approx(natural_hz, rel=1e-5)
    assert found.damping_ratio == pytest.approx(damping, rel=1e-3)
    exact = 1 / (2 * damping * np.sqrt(1 - damping**2))
    assert found.peak_magnitude == pytest.approx(exact, rel=2e-3)
    assert found.peak_frequency_hz == pytest.approx(natural_hz * np.sqrt(1 - 2 * damping**2), abs=0.01)
    assert found.half_power_bandwidth_hz == pytest.approx(2 * damping * natural_hz, rel=2e-3)


@pytest.mark.thorough
def test_the_stated_uncertainties_of_a_resonance_match_the_scatter():
    rng = np.random.default_rng(1)
    frequency_hz = np.arange(200, 330, 1.0)
    clean = single(frequency_hz, 266.0, 0.02)
    found = []
    for _ in range(40):
        noise = rng.standard_normal((2, clean.size))
        noisy = clean * (1 + 0.03 * (noise[0] + 1j * noise[1]))
        fits = resonances(curve(frequency_hz, noisy, 0.03), low_hz=210, high_hz=320)
        assert len(fits) == 1
        found.append(fits[0])
    for value, spread in (
        ("frequency_hz", "sd_frequency_hz"),
        ("damping_ratio", "sd_damping_ratio"),
        ("peak_magnitude", "sd_peak_magnitude"),
    ):
        scatter = np.std([getattr(each, value) for each in found])
        assert np.mean([getattr(each, spread) for each in found]) == pytest.approx(scatter, rel=0.35)
    assert np.mean([each.reduced_chi_square for each in found]) == pytest.approx(1, abs=0.1)


def blas_threads():
    return max(each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas")


def test_a_fit_uses_one_thread_of_linear_algebra_and_keeps_the_setting_of_the_program():
    frequency_hz, found, is_over = np.arange(50, 500, 0.25), set(), Event()

    def watch():
        while not is_over.is_set():
            found.add(blas_threads())

    watcher = Thread(target=watch)
    with threadpool_limits(2, "blas"):
        watcher.start()
        resonances(curve(frequency_hz, single(frequency_hz, 260.0, 0.01)), low_hz=60, high_hz=490)
        is_over.set()
        watcher.join()
        assert 1 in found
        assert blas_threads() == 2


def test_a_resonance_in_noise_is_found_and_too_coarse_a_resolution_is_detected():
    rate, natural = 5120.0, 2 * np.pi * 260
    section = signal.bilinear([natural**2], [1, 2 * 0.02 * natural, natural**2], fs=rate)
    x, extra = np.random.default_rng(2).standard_normal((2, 600_000))
    y = signal.lfilter(*section, x) + 0.05 * extra
    warped_hz = rate / np.pi * np.arctan(260 * np.pi / rate)
    fine = transmissibility(x, y, rate, segment_samples=5120)
    (found,) = resonances(fine, low_hz=100, high_hz=800)
    assert found.frequency_hz == pytest.approx(warped_hz, abs=max(4 * found.sd_frequency_hz, 0.2))
    assert found.damping_ratio == pytest.approx(0.02, rel=0.08)
    assert found.is_resolved
    coarse = transmissibility(x, y, rate, segment_samples=1024)
    (smeared,) = resonances(coarse, low_hz=100, high_hz=800)
    assert not smeared.is_resolved
    assert smeared.damping_ratio > found.damping_ratio


def _streamed(rng, modes, noise, window="hann", seconds=60):
    """Transmission at 0.25 Hz spacing for noise through modes (natural frequency, damping, share)."""
    rate, samples = 1024.0, int(1024 * seconds)
    drive = rng.standard_normal(samples)
    frequency_hz = np.fft.rfftfreq(samples, 1 / rate)
    through = 1 + sum(np.prod(mode[2:]) * single(frequency_hz, *mode[:2]) for mode in modes)
    response = np.fft.irfft(np.fft.rfft(drive) * through, samples)
    response += noise * np.std(response) * rng.standard_normal(samples)
    settings = {"segment_samples": 4096, "window": window, "estimator": "drive", "reference": drive}
    return transmissibility(drive, response, rate, **settings)


def _z(found, natural_hz, damping):
    return (
        (found.frequency_hz - natural_hz) / found.sd_frequency_hz,
        (found.damping_ratio - damping) / found.sd_damping_ratio,
    )


@pytest.mark.thorough
def test_the_damping_of_a_mode_narrower_than_a_spectral_line_is_within_its_bounds():
    modes = [(95.0, 0.0012), (266.0, 0.0033)]
    errors = []
    for seed in range(2):
        found = resonances(_streamed(np.random.default_rng(seed), modes, 0.05), low_hz=50, high_hz=400)
        errors += [_z(each, *modes[0]) for each in found if each.frequency_hz < 200]
    assert errors
    assert np.max(np.abs(errors)) < 3.5


@pytest.mark.thorough
@pytest.mark.parametrize("window", ["hann", "blackmanharris", "flattop"])
def test_bounds_of_streamed_noise_hold_under_every_window(window):
    errors = []
    for seed in range(2):
        lines = _streamed(np.random.default_rng(seed), [(200.0, 0.005)], 0.02, window)
        (found,) = resonances(lines, low_hz=150, high_hz=250)
        errors.append(_z(found, 200.0, 0.005))
    assert np.max(np.abs(errors)) < 3.5


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("apart_hz", "shares"),
    [(2.0, (1.0, 1.0)), (4.0, (1.0, 0.4)), (2.0, (1.0, -0.7)), (4.0, (1.0, 0.6, 1.0))],
)
def test_modes_with_close_frequencies_are_separated(apart_hz, shares):
    modes = [(200 + apart_hz * place, 0.01, share) for place, share in enumerate(shares)]
    found = resonances(_streamed(np.random.default_rng(16), modes, 0.01), low_hz=150, high_hz=250)
    assert len(found) > 1
    for each in found:
        assert min(np.max(np.abs(_z(each, *mode[:2]))) for mode in modes) < 3.5


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("shares", "seed", "draw"), [((1.0, -0.7), 77, 0), ((1.0, -0.7), 77, 3), ((1.0, 0.6, 1.0), 777, 2)]
)
def test_the_bounds_of_modes_with_close_frequencies_hold(shares, seed, draw):
    coverage = runpy.run_path(str(Path(__file__).parents[3] / "benchmarks" / "resonance_coverage.py"))
    (number, scene) = next(
        (number, scene)
        for number, (name, scene) in enumerate(coverage["scenes"]())
        if name.startswith("boxcar") and f"close 2 Hz {shares}" in name
    )
    found = coverage["scores"](*scene, np.random.default_rng((seed, number, draw)))
    assert len(found["errors"]) == 2
    assert np.max(np.abs(found["errors"])) < 3.5


@pytest.mark.thorough
def test_a_poor_fit_of_a_resonance_reports_its_chi_square():
    lines = _streamed(np.random.default_rng(5), [(200.0, 0.01)], 0.01)
    # An alternating error of 15 % on pairs of lines cannot be fitted by three modes.
    pairs = 1 + 0.15 * (-1.0) ** (np.arange(lines.value.size) // 2)
    (each,) = resonances(dataclasses.replace(lines, value=lines.value * pairs), low_hz=190, high_hz=210)
    assert each.reduced_chi_square > 10 * each.chi_square_limit
    assert f"reduced chi² = {each.reduced_chi_square:.3g}" in each.remark


def test_noise_alone_gives_no_resonance():
    x, y = np.random.default_rng(3).standard_normal((2, 100_000))
    assert resonances(transmissibility(x, y, 5120.0, segment_samples=2048), low_hz=50, high_hz=2000) == ()
    flat = transmissibility(x, x + 0.5 * y, 5120.0, segment_samples=2048)
    assert len(resonances(flat, low_hz=50, high_hz=2000)) <= 2


def test_a_band_with_too_few_lines_is_refused():
    frequency_hz = np.arange(50, 500, 10.0)
    with pytest.raises(InvalidRequest, match="at least 8"):
        resonances(curve(frequency_hz, single(frequency_hz, 266, 0.02)), low_hz=250, high_hz=280)


@pytest.mark.thorough
def test_the_frequency_and_the_damping_of_every_mode_are_within_their_bounds():
    frequency_hz = np.arange(50.0, 601.0)
    exact = specimen(frequency_hz)
    # The absolute noise is equal on all lines; the mode at 500 Hz lies on the flanks of the others.
    noise = 0.01 * np.median(np.abs(exact))
    natural_hz, damping = modes()
    rng, draws, held = np.random.default_rng(9), 60, np.zeros((3, 2))
    for _ in range(draws):
        value = exact + noise * (rng.standard_normal(551) + 1j * rng.standard_normal(551))
        found = resonances(curve(frequency_hz, value, noise / np.abs(exact)), low_hz=50, high_hz=600)
        assert len(found) == 3
        for number, each in enumerate(found):
            held[number, 0] += abs(each.frequency_hz - natural_hz[number]) < 1.96 * each.sd_frequency_hz
            held[number, 1] += abs(each.damping_ratio - damping[number]) < 1.96 * each.sd_damping_ratio
    # 0.95 minus three standard deviations; single-mode fits had a coverage of 0.3 at 500 Hz.
    assert np.all(held / draws > 0.865)


@pytest.mark.thorough
@pytest.mark.parametrize("accelerometer", [0.3, 0.003])
def test_bounds_of_every_mode_hold_with_two_realisations_of_noise(accelerometer):
    """The base motion has a notch to 30 % at the first mode, about one spectral line wide."""
    rate, points, realisations = 4096.0, 2048, 2
    driven = np.arange(25, 301)
    frequency_hz = 2.0 * driven
    base = (1 - 0.7 / (1 + ((frequency_hz - 95) / 3) ** 2)) * np.exp(-1j * frequency_hz / 200)
    velocity = base * specimen(frequency_hz) / (2j * np.pi * frequency_hz)
    natural_hz, damping = modes()
    fine = specimen(np.arange(50.0, 600.0, 0.02))
    peaks = [np.abs(fine[np.arange(-150, 150) + round(50 * (each - 50))]).max() for each in natural_hz]
    rng, draws, held = np.random.default_rng(12), 36, np.zeros((3, 3))
    for _ in range(draws):
        sums = PeriodicSums(rate, 2.0)
        for _ in range(realisations):
            spectra = np.zeros((3, points // 2 + 1), dtype=complex)
            spectra[:, driven] = np.exp(2j * np.pi * rng.random(driven.size)) * [base**0, base, velocity]
            played = np.tile(np.fft.irfft(spectra) * points, 2)
            noise = np.array([[0.0], [accelerometer], [1e-4]]) * rng.standard_normal(played.shape)
            sums.add(*(played + noise))
        response = converted_frequency_response(
            sums.frequency_response(orders=driven).frequency_response,
            drive=(Quantity.ACCELERATION, Quantity.DISPLACEMENT),
            response=(Quantity.VELOCITY, Quantity.DISPLACEMENT),
        )
        found = resonances(response, low_hz=50, high_hz=600)
        assert len(found) == 3
        for number, each in enumerate(found):
            held[number] += (
                abs(each.frequency_hz - natural_hz[number]) < 2 * each.sd_frequency_hz,
                abs(each.damping_ratio - damping[number]) < 2 * each.sd_damping_ratio,
                abs(each.peak_magnitude - peaks[number]) < 2 * each.sd_peak_magnitude,
            )
    # 0.95 minus three standard deviations; coverage with the scatter averaged over neighbours was
    # 0.68 to 0.78 at 95 Hz, and with the variance of each line alone 0.78 to 0.88 at 500 Hz.
    assert np.all(held / draws > 0.84)


@pytest.mark.thorough
def test_correlated_spectral_lines_widen_the_bounds_of_a_resonance():
    """Collisions correlate lines; fits that assume independent lines cover less than 60 %."""
    frequency_hz, realisations, draws = np.arange(100.0, 300.0), 4, 30
    rng, independent, together = np.random.default_rng(13), 0, 0

    def curve_of(values):
        value = values.mean(axis=0)
        variance = np.sum(np.abs(values - value) ** 2, axis=0) / (len(values) - 1) / len(values)
        spread = np.sqrt(variance / 2) / np.abs(value)
        power = np.ones_like(spread)
        steady = steady_relative_sd(spread, value, power, 2.0 * (len(values) - 1))
        return replace(
            curve(frequency_hz, value, spread), n_eff=float(len(values)), steady_relative_sd=steady
        )

    for _ in range(draws):
        values = np.array(
            [
                single(frequency_hz, 200 + 0.3 * rng.standard_normal(), 0.03)
                * (1 + 1e-2 * rng.standard_normal(frequency_hz.size))
                for _ in range(realisations)
            ]
        )
        (found,) = resonances(curve_of(values), low_hz=100, high_hz=300)
        without = [
            resonances(curve_of(np.delete(values, place, axis=0)), low_hz=100, high_hz=300)
            for place in range(realisations)
        ]
        (widened,) = scattered_resonances([found], without)
        independent += abs(found.frequency_hz - 200) < 2 * found.sd_frequency_hz
        together += abs(widened.frequency_hz - 200) < 2 * widened.sd_frequency_hz
    assert independent < 0.6 * draws
    assert together > 0.83 * draws


def test_a_resonance_found_in_only_one_realisation_is_rejected():
    frequency_hz = np.arange(100.0, 300.0)
    (found,) = resonances(curve(frequency_hz, single(frequency_hz, 200.0, 0.03)), low_hz=100, high_hz=300)
    assert scattered_resonances([found], [[found], [], []]) == ()
    assert len(scattered_resonances([found], [[found], [found], []])) == 1


def test_leave_one_out_fits_with_another_number_of_modes_do_not_count_as_scatter():
    """Seven of twelve leave-one-out fits use all modes, as the full fit does; five use this mode alone."""
    frequency_hz = np.arange(100.0, 300.0)
    (found,) = resonances(curve(frequency_hz, single(frequency_hz, 183.2, 0.06)), low_hz=100, high_hz=300)
    found = replace(found, lines_used=360)
    together = [replace(found, frequency_hz=183.2 + 0.01 * step) for step in range(-3, 4)]
    alone = [replace(found, frequency_hz=186.0, lines_used=105)] * 5
    (widened,) = scattered_resonances([found], [[each] for each in together + alone])
    # The two fits differ by 2.8 Hz; a jackknife would count this eleven times as scatter.
    assert 1.0 < widened.sd_frequency_hz < 2.0


def test_the_frequency_and_the_damping_of_modes_are_exact_without_noise():
    frequency_hz = np.arange(50.0, 601.0)
    found = resonances(curve(frequency_hz, specimen(frequency_hz)), low_hz=50, high_hz=600)
    natural_hz, damping = modes()
    np.testing.assert_allclose([each.frequency_hz for each in found], natural_hz, rtol=1e-7)
    np.testing.assert_allclose([each.damping_ratio for each in found], damping, rtol=1e-6)
    assert all(each.is_resolved for each in found)
