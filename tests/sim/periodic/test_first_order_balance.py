import math

import numpy as np
import pytest
from scipy.integrate import quad

from vibench.sim import PowerSpring, first_order_states, gong2025, structure_of
from vibench.sim.periodic.first_order_balance import fundamental_share
from vibench.sim.periodic.harmonic_balance import condense

FIT_LENGTH, FIT_FORCE = 46e-6, 4.891e9 * 1e-6**1.5


@pytest.mark.parametrize("exponent", [1, 3, 5, 7, 29, 47, 201])
def test_the_fundamental_of_a_power_of_a_cosine_is_its_fourier_integral(exponent):
    integral, _ = quad(lambda a: math.cos(a) ** (exponent + 1), 0.0, 2.0 * math.pi, epsabs=1e-13)
    assert fundamental_share(exponent) == pytest.approx(integral / math.pi, rel=1e-11)


def test_first_order_balance_refuses_an_even_power():
    with pytest.raises(ValueError, match="Exponent 4 is not allowed"):
        fundamental_share(4)


@pytest.mark.parametrize("frequency_hz", [80.0, 180.0, 199.0, 260.0, 420.0, 550.0])
@pytest.mark.parametrize("amplitude_m", [1e-6, 5e-6, 50e-6])
def test_every_first_order_solution_satisfies_equation_5_of_the_paper(frequency_hz, amplitude_m):
    specimen, omega = gong2025(), 2.0 * math.pi * frequency_hz
    # Equation 5 of the paper in coordinates (x, p, z), with displacements A cos + B sin.
    m0, m1, m2 = specimen.masses
    k0, k1, k2 = specimen.stiffnesses
    c0, c1, c2 = specimen.dampings
    mass = np.array([[m0, 0, 0], [0, m1, m1], [0, 0, m2]])
    stiff = np.array([[k0 + k2, 0, -k2], [0, k1, 0], [-k2, -k1, k2]])
    damp = np.array([[c0 + c2, 0, -c2], [0, c1, 0], [-c2, -c1, c2]])
    spring = PowerSpring(FIT_LENGTH, ((5, FIT_FORCE),))
    states = first_order_states(structure_of(specimen), spring, frequency_hz, amplitude_m)
    assert len(states) in (1, 3)
    for state in states:
        x, y, z = state.displacements
        assert y - z == pytest.approx(state.relative, rel=1e-9)
        phasor = np.array([x, y - z, z])
        a, b = phasor.real, -phasor.imag
        cubed = 5.0 / 8.0 * FIT_FORCE / FIT_LENGTH**5 * (a[1] ** 2 + b[1] ** 2) ** 2
        pull_cos, pull_sin = cubed * a[1] * np.array([0, 1, -1]), cubed * b[1] * np.array([0, 1, -1])
        drive_cos, drive_sin = [c0 * omega * amplitude_m, 0, 0], [k0 * amplitude_m, 0, 0]
        dynamic = stiff - omega**2 * mass
        size = np.abs(dynamic @ a).max() + np.abs(dynamic @ b).max()
        np.testing.assert_allclose(dynamic @ a + omega * damp @ b + pull_cos, drive_cos, atol=1e-10 * size)
        np.testing.assert_allclose(dynamic @ b - omega * damp @ a + pull_sin, drive_sin, atol=1e-10 * size)


@pytest.mark.parametrize("exponent", [3, 5, 29, 201])
def test_a_very_strong_drive_gives_the_response_of_the_joined_masses(exponent):
    # p grows as the n-th root of the force, so x approaches the response of the joined masses.
    specimen, spring = gong2025(), PowerSpring(FIT_LENGTH, ((exponent, FIT_FORCE),))
    states = first_order_states(structure_of(specimen), spring, 300.0, 10.0)
    join = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
    omega = 2.0 * math.pi * 300.0
    dynamic = (
        specimen.stiffness_matrix + 1j * omega * specimen.damping_matrix - omega**2 * specimen.mass_matrix
    )
    entry = specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0]
    bound = np.linalg.solve(join.T @ dynamic @ join, np.array([entry, 0.0]))
    assert abs(states[0].displacements[0]) / 10.0 == pytest.approx(abs(bound[0]), rel=1e-3)


def test_derivatives_of_the_condensed_model_match_finite_differences_over_frequency():
    structure, harmonics, omega, step = structure_of(gong2025()), np.array([0, 1, 2, 7]), 1500.0, 0.01
    before, here, after = (condense(structure, omega + d, harmonics) for d in (-step, 0.0, step))
    slope = (after.compliance - before.compliance) / (2.0 * step)
    np.testing.assert_allclose(here.compliance_slope, slope, rtol=1e-6, atol=1e-9 * np.abs(slope).max())
    assert here.linear_slope == pytest.approx((after.linear - before.linear) / (2.0 * step), rel=1e-6)
