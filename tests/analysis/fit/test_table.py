"""The table mass is identified from the notches that the specimen's resonances cause in the base motion."""

from dataclasses import replace

import pytest

from tests.analysis.virtual_measurements import RIG, record, weak_noise as noise_of
from vibench.acquisition import open_recording
from vibench.analysis import Simulation, analyse, analyse_files, update_model
from vibench.analysis.errors import UnusableData
from vibench.analysis.fit.specimen_fit import Assumption
from vibench.analysis.overlay.driven_rig import fit_shaker
from vibench.sim import gong2025

pytestmark = pytest.mark.thorough

TRUE_KG = RIG.shaker.moving_mass_kg + RIG.shaker.fixture_mass_kg


@pytest.fixture(scope="module")
def weak_noise(tmp_path_factory):
    """Record weak noise on the virtual rig."""
    return record(tmp_path_factory.mktemp("table") / "weak.h5", noise_of(realisations=6, settle_s=1.5))


@pytest.fixture(scope="module")
def update(weak_noise):
    """Fit the recording of the virtual rig, whose configuration is correct."""
    return update_model(analyse_files([weak_noise], "weak", Simulation.LEFT_OUT))


def test_a_correctly_described_rig_fits_its_recordings(update):
    assert update.fits
    assert update.linear.reduced_chi_square < update.linear.limit
    assert update.table.mass_kg == pytest.approx(TRUE_KG, abs=3.3 * update.table.sd_kg)
    assert update.table.sd_kg < 0.01 * TRUE_KG
    assert update.table.suspects == ()
    assert update.not_determined[0].endswith("the contact law are not determined: no recording collides.")


def test_a_table_10_percent_heavier_than_described_is_named_as_suspect(update):
    heavier = replace(update, table=replace(update.table, described_kg=TRUE_KG / 1.1))
    assert not heavier.fits
    (suspect,) = heavier.suspects
    assert suspect.assumption is Assumption.TABLE_MASS
    assert "all three masses of the specimen" in suspect.sentence
    assert [each for each in heavier.sentences if each.startswith("The table's described mass does not fit")]
    assert heavier.values == update.values


def test_a_failed_fit_of_the_shaker_is_not_blamed_on_collisions_alone(weak_noise):
    specimen = gong2025()
    heavier = replace(specimen, masses=tuple(3.0 * each for each in specimen.masses))
    with (
        open_recording(weak_noise) as recording,
        pytest.raises(UnusableData, match="the specimen differs from its description, or masses collide"),
    ):
        fit_shaker(recording, analyse(recording), heavier)
