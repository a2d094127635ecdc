import dataclasses

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.sim import base_transmissibility, gong2025
from vibench.sim.specimen.modes import modal_form, state_matrix

DAMPINGS = st.floats(0.0, 1e-2)


def test_all_masses_follow_the_base_at_zero_frequency():
    np.testing.assert_allclose(base_transmissibility(gong2025(), 0.0), [[1.0, 1.0, 1.0, 0.0]], atol=1e-14)


def test_the_transmissibility_satisfies_the_equations_of_motion():
    specimen = gong2025(damping_time_s=3e-5)
    m0, m1, m2 = specimen.masses
    k0, k1, k2 = specimen.stiffnesses
    c0, c1, c2 = specimen.dampings
    frequency = np.array([20.0, 94.6, 266.2, 499.6, 800.0])
    x, y, z, p = base_transmissibility(specimen, frequency).T
    s = 2j * np.pi * frequency
    upper = (k2 + c2 * s) * (z - x)
    np.testing.assert_allclose(m0 * s**2 * x, upper + (k0 + c0 * s) * (1.0 - x), rtol=1e-10)
    np.testing.assert_allclose(m1 * s**2 * y, -(k1 + c1 * s) * p, rtol=1e-10)
    np.testing.assert_allclose(m2 * s**2 * z, (k1 + c1 * s) * p - upper, rtol=1e-10)


def test_transmissibility_peaks_are_at_the_natural_frequencies():
    frequency = np.arange(50.0, 600.0, 0.1)
    size = np.abs(base_transmissibility(gong2025(), frequency)[:, 0])
    peaks = frequency[1:-1][(size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])]
    np.testing.assert_allclose(peaks, [94.4, 266.0, 500.5], atol=0.15)


@given(DAMPINGS, DAMPINGS, DAMPINGS)
def test_the_modes_rebuild_any_state_and_its_time_derivative(first, second, third):
    k0, k1, k2 = gong2025().stiffnesses
    specimen = dataclasses.replace(gong2025(), dampings=(first * k0, second * k1, third * k2))
    form = modal_form(specimen)
    state = np.array([1e-5, -3e-5, 2e-5, 0.01, 0.02, -0.04])
    phasors = form.rows @ state
    system, _ = state_matrix(specimen)
    np.testing.assert_allclose((phasors @ form.shapes).real, state, rtol=1e-7, atol=1e-12)
    rate = system @ state
    np.testing.assert_allclose(
        ((phasors * form.rates) @ form.shapes).real, rate, rtol=1e-6, atol=1e-6 * abs(rate).max()
    )
    assert (form.rates.real <= 0.0).all()


def test_a_specimen_with_coinciding_eigenvalues_is_refused_with_advice():
    # m0 is critically damped and coupled to m2 only through a vanishing spring.
    k0, m0 = 1000.0, 1e-3
    critical = dataclasses.replace(
        gong2025(),
        masses=(m0, 1e-3, 1e-3),
        stiffnesses=(k0, 1.0, 1e-12),
        dampings=(2.0 * np.sqrt(k0 * m0), 0.0, 0.0),
    )
    with pytest.raises(ValueError, match="coincide"):
        modal_form(critical)


def test_a_negative_frequency_is_refused():
    with pytest.raises(ValueError, match="zero or positive"):
        base_transmissibility(gong2025(), [-1.0])


@pytest.mark.parametrize("heavier", [1e2, 1e6, 1e10])
def test_a_light_mass_on_a_heavy_frame_moves_as_its_closed_form_states(heavier):
    omega, damping = 0.8, 0.02
    specimen = dataclasses.replace(
        gong2025(),
        masses=(heavier, 1.0, heavier),
        stiffnesses=(9.0 * heavier, 1.0, 4.0 * heavier),
        dampings=(3.0 * heavier, damping, 2.0 * heavier),
    )
    moved = base_transmissibility(specimen, omega / (2.0 * np.pi))[0]
    assert moved[3] / moved[2] == pytest.approx(omega**2 / (1.0 - omega**2 + 1j * damping * omega), rel=1e-12)


@pytest.mark.parametrize("damping_time_s", [0.3, 30.0])
def test_strongly_overdamped_modes_are_separated(damping_time_s):
    """With proportional damping the rates s of a mode solve s^2 + omega^2 (1 + damping_time s) = 0."""
    specimen = gong2025(damping_time_s=damping_time_s)
    root = np.sqrt(np.asarray(specimen.masses))
    squares = np.linalg.eigvalsh(specimen.stiffness_matrix / np.outer(root, root))
    fast = 0.5 * damping_time_s * squares * (1.0 + np.sqrt(1.0 - 4.0 / (damping_time_s**2 * squares)))
    np.testing.assert_allclose(
        np.sort(modal_form(specimen).rates.real), np.sort(-np.concatenate([squares / fast, fast])), rtol=1e-9
    )


def test_a_slow_mode_is_separated_from_quickly_decaying_modes():
    specimen = dataclasses.replace(gong2025(), dampings=(1e4, 0.3, 3e6))
    rates = modal_form(specimen).rates
    system, _ = state_matrix(specimen)
    for rate in rates:
        residual = np.linalg.svd(system - rate * np.eye(6), compute_uv=False)
        assert residual[-1] < 1e-12 * residual[0]


def test_natural_frequencies_too_far_apart_for_double_precision_are_refused():
    specimen = dataclasses.replace(gong2025(), masses=(5.8e-3, 1e-300, 2e-3))
    with pytest.raises(ValueError, match="are too far apart for double precision"):
        modal_form(specimen)
