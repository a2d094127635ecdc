from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter

from tests.sim.as_written import free_state_matrix
from vibench.sim import Hertz, Specimen, gong2025
from vibench.sim.specimen.contact_laws import Elasticity, hertz_stiffness


def test_the_materials_of_the_paper_give_its_contact_stiffness():
    stiffness = hertz_stiffness(Elasticity(206e9, 0.27), Elasticity(67e9, 0.3), 4.4e-3)
    assert stiffness == pytest.approx(4.891e9, rel=1e-4)
    assert gong2025().contact == Hertz(stiffness)


def test_the_free_specimen_has_the_three_modes_of_the_paper():
    np.testing.assert_allclose(gong2025().natural_frequencies_hz, [94.6, 266.2, 499.6], atol=0.05)


def test_the_specimen_has_two_resonances_when_m1_is_joined_to_m2():
    np.testing.assert_allclose(gong2025().bound_frequencies_hz, [201.5, 436.0], atol=0.05)


def test_stiffness_proportional_damping_ratios_grow_with_frequency():
    specimen = gong2025(damping_time_s=3e-5)
    np.testing.assert_allclose(
        specimen.damping_ratios, np.pi * specimen.natural_frequencies_hz * 3e-5, rtol=1e-12
    )


def test_the_damping_of_the_paper_overdamps_every_mode_if_read_in_si_units():
    np.testing.assert_allclose(gong2025(damping_time_s=1e-2).damping_ratios, [2.97, 8.36, 15.7], rtol=3e-3)


def test_a_specimen_round_trips_through_json():
    kept = TypeAdapter(Specimen)
    for specimen in (gong2025(), gong2025(contact="linear")):
        assert kept.validate_json(kept.dump_json(specimen)) == specimen


def test_an_unknown_field_of_a_stored_specimen_is_refused():
    stored = TypeAdapter(Specimen).dump_python(gong2025(), mode="json") | {"colour": "grey"}
    with pytest.raises(ValueError, match="colour"):
        TypeAdapter(Specimen).validate_python(stored)


def test_damping_ratios_of_coupled_modes_match_the_poles():
    specimen = replace(
        gong2025(),
        masses=(5e-3, 2e-3, 3e-3),
        stiffnesses=(20_000.0, 900.0, 12_000.0),
        dampings=(0.1, 2.0, 0.0),
    )
    poles = np.linalg.eigvals(free_state_matrix(specimen))
    poles = sorted(poles[poles.imag > 0], key=abs)
    np.testing.assert_allclose(specimen.damping_ratios, [-each.real / abs(each) for each in poles], rtol=1e-9)
    np.testing.assert_allclose(specimen.damping_ratios, [0.71605, 0.16889, 0.03498], atol=1e-5)


def test_damping_ratios_are_continuous_at_vanishing_mode_coupling():
    """An overdamped mode has two real poles, whose product is the square of its frequency."""
    for damping_time_s in (2e-5, 1e-2):
        alone = gong2025(damping_time_s=damping_time_s)
        coupled = replace(alone, dampings=tuple(np.array(alone.dampings) * (1.0, 1.0 + 1e-7, 1.0)))
        np.testing.assert_allclose(coupled.damping_ratios, alone.damping_ratios, rtol=1e-6)
