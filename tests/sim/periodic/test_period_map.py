"""The derivative of the period map matches differences, and closed forms near grazing."""

import math

import numpy as np
import pytest

from vibench.sim import Harmonic, base_transmissibility, gong2025, integrate
from vibench.sim.periodic.branch import OrbitShape
from vibench.sim.periodic.shooting import PeriodMap
from vibench.sim.specimen.specimen import state_scales

DRIVE = Harmonic(130.0, 20e-6)
OFFSETS, WEIGHTS = (-2.0, -1.0, 1.0, 2.0), (1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0)


def derivative(mapping, state, drive):
    """Return the scaled derivative of the map as Newton's iteration uses it."""
    return next(mapping.iterates(state, drive))[2]


def by_differences(mapping, state, drive, step=1e-5):
    """Return the scaled derivative of the map by fourth-order central differences."""
    scales = state_scales(mapping.specimen, drive)
    columns = []
    for push in np.diag(step * scales):
        images = [mapping.image(state + offset * push, drive) for offset in OFFSETS]
        columns.append(np.dot(WEIGHTS, images) / (step * scales))
    return np.array(columns).T


@pytest.mark.parametrize("shape", list(OrbitShape))
@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "hunt_crossley:0.5", "rigid:0.8", "power:7"])
def test_the_derivative_of_the_period_map_matches_differences(contact, shape):
    specimen = gong2025(contact=contact)
    state = integrate(specimen, DRIVE, 20 / DRIVE.frequency_hz).final_state
    mapping = PeriodMap(specimen, shape)
    exact = derivative(mapping, state, DRIVE)
    assert np.abs(by_differences(mapping, state, DRIVE) - exact).max() < 1e-6 * np.abs(exact).max()


def test_the_derivative_of_the_map_over_two_periods_is_the_product_of_the_single_derivatives():
    mapping = PeriodMap(gong2025())
    state = integrate(gong2025(), DRIVE, 20 / DRIVE.frequency_hz).final_state
    between = mapping.image(state, DRIVE)
    product = derivative(mapping, between, DRIVE) @ derivative(mapping, state, DRIVE)
    twice = derivative(PeriodMap(gong2025(), OrbitShape.REPEATED, 2), state, DRIVE)
    np.testing.assert_allclose(twice, product, atol=1e-7 * np.abs(product).max())


@pytest.mark.parametrize(("contact", "power"), [("hertz", 1.0), ("linear_gap", 0.5)])
def test_beyond_grazing_the_map_derivative_changes_with_the_exponent_of_the_contact_law(contact, power):
    # The duration of a contact of depth d is as d^0.5, its stiffness as d^0.5 (Hertz) or constant.
    specimen = gong2025(contact=contact)
    motion = base_transmissibility(specimen, DRIVE.frequency_hz)[0]
    grazing = specimen.gap_m / abs(motion[3])
    half = OrbitShape.MIRRORED
    free = derivative(PeriodMap(gong2025(contact="linear"), half), np.zeros(6), DRIVE)
    omega = 2.0 * math.pi * DRIVE.frequency_hz
    departures = []
    for excess in (-1e-9, 1e-10, 1e-9, 1e-8):
        drive = Harmonic(DRIVE.frequency_hz, grazing * (1.0 + excess))
        state = drive.amplitude_m * np.concatenate([motion[:3].imag, omega * motion[:3].real])
        departures.append(np.abs(derivative(PeriodMap(specimen, half), state, drive) - free).max())
    assert departures[0] < 1e-9
    slopes = np.diff(np.log10(departures[1:]))
    assert slopes == pytest.approx(power, abs=0.1)
