"""The whole way for the paper's figure 13: simulated specimen, two clocks, a late vibrometer, closed form."""

import numpy as np
import pytest

from vibench.analysis import resonances
from vibench.analysis.frequency_response.periodic import PeriodicSums
from vibench.analysis.frequency_response.results import converted_frequency_response
from vibench.analysis.signals.quantity import Quantity
from vibench.sim import Sampled, gong2025, integrate

RATE = 12_800.0
REPETITION_HZ = 4.0
LINES = np.arange(8, 151)  # 32 to 600 Hz
CLOCK = 1 + 40e-6  # the converter samples this much faster than it says
DELAY_S = 50e-6
PERIODS, SETTLE_S = 3, 4.0


def exact(frequency_hz):
    """X / U of equation 1 without contact, c_i = 2e-5 s k_i."""
    masses = np.array([5.8e-3, 2.1e-3, 2e-3])
    result = []
    for s in 2j * np.pi * frequency_hz:
        k0, k1, k2 = masses * (2 * np.pi * np.array([322.0, 100.0, 390.6])) ** 2 * (1 + 2e-5 * s)
        matrix = np.array([[k0 + k2, 0, -k2], [0, k1, -k1], [-k2, -k1, k1 + k2]]) + np.diag(masses) * s**2
        result.append(np.linalg.solve(matrix, [k0, 0, 0])[0])
    return np.array(result)


def base_motion(time_s, phases, rms_m):
    """Displacement and acceleration of a flat multisine."""
    scale = rms_m / np.sqrt(LINES.size / 2)
    displacement, acceleration = np.zeros_like(time_s), np.zeros_like(time_s)
    for line, phase in zip(LINES, phases, strict=True):
        omega = 2 * np.pi * REPETITION_HZ * line
        wave = scale * np.cos(omega * time_s + phase)
        displacement += wave
        acceleration -= omega**2 * wave
    return displacement, acceleration


def recorded(rms_m, realisations, noise_density=0.0):
    sums = PeriodicSums(RATE, REPETITION_HZ)
    rng = np.random.default_rng(1)
    duration_s = SETTLE_S + PERIODS / REPETITION_HZ
    impacts = 0
    for _ in range(realisations):
        phases = rng.uniform(0, 2 * np.pi, LINES.size)
        own = np.arange(int((duration_s + 0.1) * 4 * RATE)) / (4 * RATE)
        drive = Sampled(base_motion(own, phases, rms_m)[0], 4 * RATE)
        path = integrate(gong2025(), drive, duration_s, sample_rate_hz=RATE * CLOCK)
        impacts += path.impacts.count
        last = slice(-int(PERIODS / REPETITION_HZ * RATE), None)
        voltage, acceleration = base_motion(path.time_s[last], phases, rms_m)
        late = np.fft.rfft(path.states[:, 3])
        late *= np.exp(-2j * np.pi * np.fft.rfftfreq(path.time_s.size, 1 / (RATE * CLOCK)) * DELAY_S)
        velocity = np.fft.irfft(late, path.time_s.size)
        # The delay by Fourier transform wraps the last sample round to the first; keep clear of both.
        noise = noise_density * np.sqrt(RATE / 2) * rng.standard_normal(velocity.size)
        sums.add(voltage[:-300], acceleration[:-300], (velocity + noise)[last][:-300])
    return sums.frequency_response(delay_s=DELAY_S), impacts


def as_displacements(result):
    return converted_frequency_response(
        result.frequency_response,
        drive=(Quantity.ACCELERATION, Quantity.DISPLACEMENT),
        response=(Quantity.VELOCITY, Quantity.DISPLACEMENT),
    )


def test_the_measured_transmission_is_the_closed_form_in_magnitude_and_phase():
    result, impacts = recorded(2e-8, 1)
    assert impacts == 0
    ratio = as_displacements(result)
    truth = exact(LINES * REPETITION_HZ)
    np.testing.assert_allclose(ratio.frequency_hz, LINES * REPETITION_HZ / CLOCK, rtol=1e-8)
    np.testing.assert_allclose(ratio.value, truth, rtol=3e-3)
    found = resonances(ratio, low_hz=40, high_hz=590)
    assert [round(each.frequency_hz) for each in found] == pytest.approx([95, 266, 500], abs=1)


def test_the_bounds_hold_the_closed_form_at_95_of_100_lines_with_a_vibrometers_noise():
    result, _ = recorded(2e-8, 3, noise_density=1e-6)
    ratio = as_displacements(result)
    truth = np.abs(exact(LINES * REPETITION_HZ))
    inside = (ratio.magnitude_lower <= truth) & (ratio.magnitude_upper >= truth)
    assert np.mean(inside) == pytest.approx(0.95, abs=4 * np.sqrt(0.05 * 0.95 / LINES.size))


def test_chaotic_collisions_appear_as_scatter_between_periods():
    quiet, _ = recorded(2e-8, 3)
    loud, impacts = recorded(5e-6, 3)
    assert impacts > 100
    # A chaotic answer to a repeating drive does not repeat: it counts as noise, not as distortion.
    assert np.median(loud.noise_variance) > 1e6 * np.median(quiet.noise_variance)
