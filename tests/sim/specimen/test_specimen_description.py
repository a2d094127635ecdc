"""A specimen file contains all parameters and always gives the same specimen."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from vibench.sim import (
    Harmonic,
    SpecimenDescription,
    SpecimenTable,
    SpecimenWarning,
    UnknownSpecimenError,
    base_transmissibility,
    gong2025,
    load_specimen,
    shipped_specimens,
    steady_response,
)

BODIES = (
    "{ radius_m = 4e-3, sphere = { youngs_modulus_pa = 2e11, poissons_ratio = 0.7 }, "
    "plane = { youngs_modulus_pa = 7e10, poissons_ratio = 0.3 } }"
)
WHOLE = """
name = "mine"
masses_kg = [6e-3, 2e-3, 2e-3]
stiffnesses_n_per_m = [2e4, 800.0, 1.2e4]
dampings_ns_per_m = [0.5, 0.02, 0.2]
gap_m = [30e-6, inf]
contact = "linear_gap:1e5"
hertz_stiffness = 4.9e9
"""


def write_file(folder, text, name="mine.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_the_shipped_gong2025_file_equals_the_built_in_specimen():
    assert load_specimen("gong2025").specimen() == gong2025()
    assert {
        "gong2025",
        "heavy",
        "asymmetric",
        "hardening",
        "rigid_stops",
        "linear_gap",
        "two_masses",
    } <= shipped_specimens().keys()


@pytest.mark.parametrize("name", sorted(shipped_specimens()))
def test_every_shipped_specimen_can_be_simulated(name):
    response = steady_response(
        load_specimen(name).specimen(), Harmonic(130.0, 20e-6), duration_s=0.1, window_s=0.05
    )
    assert math.isfinite(response.response_i)


def test_the_two_mass_specimen_matches_its_equations_with_and_without_contact():
    specimen = load_specimen("two_masses").specimen()
    (_, m1, m2), (_, k1, k2), (_, c1, c2) = specimen.masses, specimen.stiffnesses, specimen.dampings
    frequency_hz = np.linspace(20.0, 600.0, 59)
    s = 2j * np.pi * frequency_hz
    spring, base = k1 + c1 * s, k2 + c2 * s
    # y and z per table displacement, by Cramer's rule.
    own = (m1 * s**2 + spring) * (m2 * s**2 + spring + base) - spring**2
    y, z = spring * base / own, (m1 * s**2 + spring) * base / own
    moved = base_transmissibility(specimen, frequency_hz)
    np.testing.assert_allclose(moved[:, 1:], np.stack([y, z, y - z], axis=1), rtol=1e-3)
    near = np.abs(moved[:, 0] - 1.0)
    assert near.max() < 1e-3
    drive = Harmonic(200.0, 20e-6)
    firmer = replace(specimen, stiffnesses=(100.0 * specimen.stiffnesses[0], k1, k2))
    one, other = (steady_response(each, drive, duration_s=2.0, window_s=0.5) for each in (specimen, firmer))
    assert one.impacts == other.impacts > 100
    assert one.relative_i == pytest.approx(other.relative_i, rel=1e-4)
    assert one.relative_ii == pytest.approx(other.relative_ii, rel=1e-3)


def test_a_specimen_file_may_state_every_number(tmp_path):
    specimen = load_specimen(write_file(tmp_path, WHOLE)).specimen()
    assert specimen.stiffnesses == (2e4, 800.0, 1.2e4)
    assert specimen.gaps_m == (30e-6, math.inf)
    assert specimen.contact.stiffness == 1e5


def test_a_specimen_file_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(WHOLE, encoding="utf-8-sig")
    assert load_specimen(path) == load_specimen(write_file(tmp_path, WHOLE, "other.toml"))


def test_a_specimen_file_may_be_based_on_another_file(tmp_path):
    write_file(tmp_path, WHOLE, "base.toml")
    own = write_file(tmp_path, 'model = "base.toml"\nname = "softer"\ndamping_time_s = 1e-5\n')
    specimen = load_specimen(own).specimen()
    assert specimen.dampings == pytest.approx([0.2, 0.008, 0.12])
    assert specimen.gaps_m == (30e-6, math.inf)


def test_a_specimen_with_changed_values_loses_its_description_text(tmp_path):
    changed = load_specimen(write_file(tmp_path, 'name = "mine"\nmodel = "gong2025"\ngap_m = 62e-6\n'))
    assert "45 um" in load_specimen("gong2025").about
    assert changed.about == ""


def test_a_description_round_trips_through_its_text(tmp_path):
    described = load_specimen(write_file(tmp_path, WHOLE))
    assert SpecimenDescription.model_validate_json(described.model_dump_json()) == described
    assert SpecimenTable.model_validate(described.model_dump(mode="json")).specimen() == described.specimen()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("name =", "nam ="), "nam is not a key of a specimen|name is missing"),
        (("6e-3, 2e-3, 2e-3", "6e-3, 2e-3"), "masses_kg"),
        (("6e-3,", "-6e-3,"), "masses_kg.0 = -0.006"),
        (("2e4,", '"stiff",'), "stiffnesses_n_per_m.0 = 'stiff'"),
        (("[30e-6, inf]", "[inf, inf]"), "finite at one stop"),
        (("linear_gap:1e5", "rubber"), "rubber"),
        (("hertz_stiffness = 4.9e9", ""), 'hertz_stiffness is missing; give it, or model = "gong2025" for'),
        (("name =", "damping_time_s = 1e-5\nname ="), "both are given"),
        (("dampings_ns_per_m", "# "), "neither is given"),
        (("[30e-6, inf]", "[1e-5, 2e-5, 3e-5]"), r"a number above 0 \[m\], or \[lower, upper\]"),
        (("[30e-6, inf]", "inf"), 'give the contact "linear"'),
        (("4.9e9", BODIES), r"sphere\.poissons_ratio: Input should be less than or equal to 0\.5"),
        (("6e-3,", "1e-320,"), "too small, or too large"),
        (("2e4,", "1e308,"), "too small, or too large"),
        (("4.9e9", "1" + 400 * "0"), "hertz_stiffness = 1000"),
        (
            ("hertz_stiffness", "about = " + 3000 * "[" + 3000 * "]" + "\nhertz_stiffness"),
            "nested too deeply",
        ),
        (("hertz_stiffness", "model = 'gong2025'\nsources = 5\nhertz_stiffness"), "sources = 5"),
        (("stiffnesses_n_per_m = [2e4,", "single_frequencies_hz = [1e200,"), "too small, or too large"),
        (("hertz_stiffness", "[sources]\nmass = 'mine'\n[hertz"), "is not valid TOML"),
        (
            ("hertz_stiffness = 4.9e9", "hertz_stiffness = 4.9e9\nsources = { mass = 'x' }"),
            "'mass', which is not a key",
        ),
    ],
)
def test_a_broken_specimen_file_is_named_in_its_error(tmp_path, change, said):
    path = write_file(tmp_path, WHOLE.replace(*change))
    with pytest.raises(UnknownSpecimenError, match=said) as refusal:
        load_specimen(path)
    assert str(refusal.value).count("mine.toml") == 1
    assert "\n" not in str(refusal.value)


def test_specimen_files_based_on_each_other_are_refused(tmp_path):
    write_file(tmp_path, 'name = "a"\nmodel = "b.toml"\n', "a.toml")
    with pytest.raises(UnknownSpecimenError, match="is based on itself"):
        load_specimen(write_file(tmp_path, 'name = "b"\nmodel = "a.toml"\n', "b.toml"))


def test_a_specimen_table_given_without_a_file_cannot_name_another_file(tmp_path):
    """Specimen tables in recordings and study results may name shipped specimens only."""
    with pytest.raises(ValidationError, match="no specimen that comes with vibench"):
        SpecimenTable.model_validate({"model": str(write_file(tmp_path, WHOLE))})


@pytest.mark.parametrize(
    ("given", "instead"),
    [
        ("masses_kg = [6e-3, 2e-3, 2e-3]", "masses_kg = [true, 2e-3, 2e-3]"),
        ("masses_kg = [6e-3, 2e-3, 2e-3]", 'masses_kg = [6e-3, "2e-3", 2e-3]'),
        ("stiffnesses_n_per_m = [2e4, 800.0, 1.2e4]", "single_frequencies_hz = [322.0, true, 390.6]"),
        ("dampings_ns_per_m = [0.5, 0.02, 0.2]", "damping_time_s = true"),
        ("dampings_ns_per_m = [0.5, 0.02, 0.2]", 'damping_time_s = "2e-5"'),
        ("gap_m = [30e-6, inf]", "gap_m = true"),
        ("gap_m = [30e-6, inf]", 'gap_m = "45e-6"'),
        ("gap_m = [30e-6, inf]", "gap_m = [30e-6, true]"),
        ("hertz_stiffness = 4.9e9", "hertz_stiffness = true"),
        ("hertz_stiffness = 4.9e9", 'hertz_stiffness = "4.9e9"'),
        (
            "hertz_stiffness = 4.9e9",
            f"hertz_stiffness = {BODIES.replace('4e-3', 'true').replace('0.7', '0.3')}",
        ),
    ],
)
def test_booleans_and_texts_are_not_accepted_as_numbers_of_a_specimen(tmp_path, given, instead):
    file = write_file(tmp_path, WHOLE.replace(given, instead))
    write_file(tmp_path, f'model = "{file.name}"\nname = "heir"\n', "heir.toml")
    for each in (file, tmp_path / "heir.toml"):
        with pytest.raises(UnknownSpecimenError, match=rf"{instead.split(' = ')[0]}.*number"):
            load_specimen(each)


SPRINGS = "stiffnesses_n_per_m = [23741, 829.047, 12046.3]"
FREQUENCIES = "single_frequencies_hz = [322.0, 100.0, 390.6]"
DAMPERS = "dampings_ns_per_m = [0.474821, 0.0165809, 0.240926]"


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_changed_mass_that_alters_a_spring_constant_gives_a_warning(tmp_path, index):
    masses = [5.8e-3, 2.1e-3, 2.0e-3]
    masses[index] *= 1.5
    own = f'name = "mine"\nmodel = "gong2025"\nmasses_kg = {masses}\n'
    with pytest.warns(SpecimenWarning) as warned:
        made = load_specimen(write_file(tmp_path, own)).specimen()
    (springs, dampers) = (str(each.message) for each in warned)
    assert "single_frequencies_hz was kept" in springs
    assert f"give {SPRINGS} to keep them" in springs
    assert "damping_time_s was kept" in dampers
    assert f"give {DAMPERS} to keep them" in dampers
    assert made.stiffnesses[index] == pytest.approx(1.5 * gong2025().stiffnesses[index])
    kept = load_specimen(write_file(tmp_path, own + SPRINGS)).specimen()
    assert kept.stiffnesses == pytest.approx(gong2025().stiffnesses, rel=1e-5)
    assert kept.dampings == pytest.approx(gong2025().dampings, rel=1e-5)


def test_changed_springs_that_alter_the_damping_give_a_warning(tmp_path):
    own = 'name = "mine"\nmodel = "gong2025"\nsingle_frequencies_hz = [322.0, 120.0, 390.6]\n'
    with pytest.warns(SpecimenWarning, match=r"dampings changed .* damping_time_s = 2e-05 to confirm"):
        load_specimen(write_file(tmp_path, own))
    with pytest.warns(SpecimenWarning, match="dampings changed"):
        SpecimenTable.model_validate({"stiffnesses_n_per_m": [2e4, 800.0, 1.2e4]})
    load_specimen(write_file(tmp_path, own + "damping_time_s = 2e-5"))


def test_changes_that_are_confirmed_or_alter_no_other_value_give_no_warning(tmp_path):
    head = 'name = "mine"\nmodel = "gong2025"\n'
    for own in (
        "gap_m = 30e-6",
        "masses_kg = [5.8e-3, 2.1e-3, 2.0e-3]",
        f"masses_kg = [5.8e-3, 3e-3, 2e-3]\n{SPRINGS}\n{DAMPERS}",
        f"masses_kg = [5.8e-3, 3e-3, 2e-3]\n{FREQUENCIES}\ndamping_time_s = 2e-5",
    ):
        load_specimen(write_file(tmp_path, head + own))
    assert SpecimenTable.model_validate(
        load_specimen("two_masses").model_dump()
    ) == SpecimenTable.model_validate("two_masses")
