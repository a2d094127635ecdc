"""Parameters identified from a colliding motion are part of the fit, or are refused."""

from dataclasses import replace

import pytest

from tests.analysis.hidden_motion import shaken_world as world
from vibench.analysis import Simulation, analyse_files, update_model
from vibench.analysis.fit.collision_numbers import track_recordings
from vibench.analysis.fit.specimen_fit import Assumption
from vibench.analysis.hidden_motion import Hidden
from vibench.sim import gong2025

TRUE = gong2025(gap_m=(35e-6, 55e-6))


@pytest.fixture(scope="module")
def collision_analysis(tmp_path_factory):
    """Analyse a dwell of a specimen with unequal gaps; the bench file states 45 um on both sides."""
    recorded = world.shake(
        tmp_path_factory.mktemp("unequal"), 258.0, 1.9, duration_s=2.6, seed=41, specimen=TRUE
    )
    return analyse_files([recorded.path], "unequal", Simulation.LEFT_OUT)


@pytest.mark.thorough
def test_unequal_gaps_are_found_even_if_the_specimen_file_states_equal_gaps(collision_analysis):
    updated = update_model(collision_analysis)
    lower, upper = updated.collisions.gaps
    assert lower.low <= 35e-6 <= lower.high
    assert upper.low <= 55e-6 <= upper.high
    assert updated.specimen.gaps_m == (lower.value, upper.value)
    assert updated.description.gap_m == (lower.value, upper.value)
    told = {each.what: each for each in updated.collisions.determined}
    assert told[Hidden.M1].low <= TRUE.masses[1] <= told[Hidden.M1].high
    assert not updated.fits
    (suspect,) = updated.suspects
    assert suspect.assumption is Assumption.GAPS
    assert "lower gap of (3" in suspect.sentence
    assert "upper gap of (5" in suspect.sentence
    assert [each for each in updated.sentences if each.startswith("Collisions contradict")]
    assert updated.to_dict()["suspects"][0]["assumption"] == "gaps"


@pytest.mark.thorough
def test_a_motion_that_contradicts_the_described_masses_gives_no_gap(collision_analysis):
    """The motion determines m1 and the springs only relative to m0 and m2, which must be correct."""
    m0, m1, m2 = TRUE.masses
    found, why = track_recordings(collision_analysis, replace(TRUE, masses=(1.04 * m0, m1, m2)))
    assert found is None
    assert "run:" not in why
    assert why.startswith("shaken: ")
