import math

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, base_transmissibility, gong2025, integrate, periodic_orbit
from vibench.sim.periodic.branch import OrbitShape
from vibench.sim.periodic.shooting import PeriodMap, ShootingEnd, smallest_period
from vibench.sim.specimen.specimen import state_scales

SPECIMEN = gong2025(damping_time_s=3e-5)
TRACE = 390.081
"""tr(M^-1 C) of the specimen [1/s]."""


@pytest.mark.parametrize("shape", list(OrbitShape))
def test_shooting_finds_a_known_periodic_state(shape):
    orbit = periodic_orbit(SPECIMEN, Harmonic(130.0, 20e-6), shape)
    assert orbit.outcome is ShootingEnd.CONVERGED
    assert orbit.is_stable
    assert orbit.impacts == 2
    assert orbit.response_i[0] * 20e-6 == pytest.approx(29.397e-6, abs=1e-9)
    assert orbit.response_ii[0] * 20e-6 == pytest.approx(31.4079e-6, abs=2e-10)


@pytest.mark.parametrize(("frequency_hz", "amplitude_m"), [(100.0, 5e-6), (130.0, 20e-6)])
def test_the_product_of_the_floquet_multipliers_follows_from_the_damping(frequency_hz, amplitude_m):
    # Liouville's theorem: an elastic contact does not change the phase-space volume.
    orbit = periodic_orbit(SPECIMEN, Harmonic(frequency_hz, amplitude_m), OrbitShape.MIRRORED)
    product = np.prod(orbit.floquet_multipliers)
    assert np.log(product).real == pytest.approx(-TRACE / frequency_hz, rel=1e-6)
    whole = periodic_orbit(SPECIMEN, Harmonic(frequency_hz, amplitude_m))
    for value in whole.floquet_multipliers:
        assert np.abs(orbit.floquet_multipliers - value).min() < 1e-7


def test_the_periodic_orbit_without_contact_is_the_linear_response():
    specimen, drive = gong2025(contact="linear"), Harmonic(266.0, 5e-6)
    orbit = periodic_orbit(specimen, drive, start=np.zeros(6))
    linear = np.abs(base_transmissibility(specimen, 266.0)[0])
    assert orbit.impacts == 0
    assert orbit.response_ii == pytest.approx(linear, rel=1e-9)
    assert orbit.response_i == pytest.approx(linear, rel=1e-5)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_the_largest_p_between_rigid_stops_equals_the_gap_within_the_stated_error(restitution):
    orbit = periodic_orbit(gong2025(3e-5, contact=f"rigid:{restitution}"), Harmonic(130.0, 20e-6))
    assert orbit.impacts > 0
    difference = abs(orbit.response_i[3] - 45e-6 / 20e-6)
    assert difference < orbit.error * orbit.response_ii[3]


def test_shooting_finds_an_orbit_from_a_distant_state():
    drive = Harmonic(130.0, 20e-6)
    known = periodic_orbit(SPECIMEN, drive)
    pushed = known.state + 1e-3 * state_scales(SPECIMEN, drive)
    again = periodic_orbit(SPECIMEN, drive, start=pushed)
    np.testing.assert_allclose(again.state / known.state, 1.0, atol=1e-6)


def test_the_derivative_of_the_period_map_matches_the_derivative_of_a_linear_flow():
    specimen, drive = gong2025(contact="linear"), Harmonic(130.0, 20e-6)
    mapping = PeriodMap(specimen)
    scales = state_scales(specimen, drive)
    origin = mapping.image(np.zeros(6), drive)
    columns = [
        (mapping.image(s * e, drive) - origin) / scales for s, e in zip(scales, np.eye(6), strict=True)
    ]
    _, _, derivative = next(mapping.iterates(np.zeros(6), drive))
    np.testing.assert_allclose(derivative, np.array(columns).T, atol=1e-9)
    # From rest the image is proportional to A0, so d image / d ln A0 equals the image.
    slope = mapping.amplitude_slope(np.zeros(6), drive)
    np.testing.assert_allclose(slope, origin / scales, atol=1e-9 * np.abs(origin / scales).max())


def test_a_poincare_section_of_a_known_sequence_has_its_period():
    points = np.tile(np.arange(3.0), 8)[:, None] * np.ones(6)
    assert smallest_period(points, np.ones(6)) == 3
    assert smallest_period(points + np.arange(24.0)[:, None], np.ones(6)) is None


def test_shooting_from_a_chaotic_state_is_refused_or_finds_an_unstable_orbit():
    orbit = periodic_orbit(SPECIMEN, Harmonic(260.0, 5e-6))
    if orbit.outcome is ShootingEnd.CONVERGED:
        assert not orbit.is_stable
        run = integrate(SPECIMEN, orbit.drive, 1.0 / 260.0, Accuracy.REFERENCE, orbit.state)
        assert np.abs((run.final_state - orbit.state) / state_scales(SPECIMEN, orbit.drive)).max() < 1e-8
    else:
        assert orbit.defect > 1e-9 or math.isinf(orbit.defect)


def test_a_drive_of_zero_and_mirrored_orbits_of_two_periods_are_refused():
    with pytest.raises(ValueError, match="positive amplitude"):
        periodic_orbit(SPECIMEN, Harmonic(100.0, 0.0))
    with pytest.raises(ValueError, match="mirrored motion cannot have 2 periods"):
        periodic_orbit(SPECIMEN, Harmonic(100.0, 1e-6), OrbitShape.MIRRORED, 2)
