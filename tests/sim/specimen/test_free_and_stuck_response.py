"""Closed forms of the response with free and with joined masses match equations and integration."""

import numpy as np
import pytest

from vibench.sim import Harmonic, Specimen, base_response, base_transmissibility, gong2025, steady_response

FREQUENCY_HZ = np.array([20.0, 94.0, 201.0, 266.0, 350.0, 436.0, 500.0])


def test_the_response_of_the_free_masses_is_the_transmissibility():
    answer, truth = base_response(gong2025(), FREQUENCY_HZ), base_transmissibility(gong2025(), FREQUENCY_HZ)
    np.testing.assert_array_equal(answer.free_x, truth[:, 0])
    np.testing.assert_array_equal(answer.free_p, truth[:, 3])


def test_the_response_of_the_stuck_masses_equals_the_response_of_joined_masses():
    """A spring a million times stiffer between m1 and m2 prevents relative displacement."""
    specimen = gong2025()
    k0, k1, k2 = specimen.stiffnesses
    tied = Specimen(specimen.masses, (k0, 1e6 * k1, k2), specimen.dampings, 45e-6, specimen.contact)
    np.testing.assert_allclose(
        base_response(specimen, FREQUENCY_HZ).stuck_x,
        base_transmissibility(tied, FREQUENCY_HZ)[:, 0],
        rtol=1e-4,
    )


@pytest.mark.parametrize("stiffer", [0.5, 3.0])
def test_the_lever_ratio_gives_x_for_any_relative_displacement(stiffer):
    """Another spring between m1 and m2 changes p, and x changes by the lever ratio times p."""
    specimen = gong2025()
    k0, k1, k2 = specimen.stiffnesses
    other = Specimen(specimen.masses, (k0, stiffer * k1, k2), specimen.dampings, 45e-6, specimen.contact)
    moved = base_transmissibility(other, FREQUENCY_HZ)
    answer = base_response(specimen, FREQUENCY_HZ)
    np.testing.assert_allclose(answer.stuck_x + answer.lever * moved[:, 3], moved[:, 0], rtol=1e-9)


@pytest.mark.parametrize("frequency_hz", [180.0, 200.0, 440.0])
@pytest.mark.parametrize("amplitude_m", [80e-6, 300e-6])
def test_the_fundamental_predicts_large_motion_against_stops_within_30_percent(frequency_hz, amplitude_m):
    specimen = gong2025()
    settled = steady_response(specimen, Harmonic(frequency_hz, amplitude_m), duration_s=12.0, window_s=2.0)
    answer = base_response(specimen, frequency_hz)
    estimate_m = abs(answer.stuck_x[0]) * amplitude_m + abs(answer.lever[0]) * specimen.gap_m
    assert abs(answer.free_p[0]) * amplitude_m > specimen.gap_m
    assert 0.8 < settled.largest_x_m / estimate_m < 1.3
