"""Computed maps: adaptive and full refinement, several starts, and basins with their boundary."""

import shutil

import h5py
import numpy as np
import pytest

from vibench.sim.maps import Map, Range, kick_stability, open_map, solve_map, uncertainty_exponent
from vibench.sim.scene.shares import wilson_share
from vibench.sim.study import InvalidStudy, PointState, StudyError

# The map covers the boundary between motions with and without contact.
PLAN = Map(
    frequency_hz=Range(start=90.0, stop=140.0, points=17),
    amplitude_m=Range(start=2e-6, stop=2e-5, points=13, spacing="logarithmic"),
    coarse=4,
    periods=600,
)


@pytest.fixture(scope="module")
def adaptive():
    return solve_map(PLAN)


@pytest.mark.thorough
def test_computed_cells_of_an_adaptive_map_equal_the_full_map(adaptive):
    full = solve_map(PLAN.model_copy(update={"refinement": "full"}))
    is_computed = adaptive.state == PointState.DONE
    assert 0 < adaptive.points < full.points == PLAN.grid.size
    for name in ("motion", "period", "response_i", "impact_rate", "contact_energy"):
        np.testing.assert_array_equal(adaptive.values(name)[is_computed], full.values(name)[is_computed])
    whole = full.values("motion") * 64 + np.nan_to_num(full.values("period"))
    here = adaptive.values("motion") * 64 + np.nan_to_num(adaptive.values("period"))
    # The share of wrongly filled cells in the full map is within the interval of the audit.
    wrong = np.count_nonzero(whole != here)
    low, high = adaptive.audit.wrong_share.low, adaptive.audit.wrong_share.high
    assert low * adaptive.audit.filled <= wrong <= high * adaptive.audit.filled


def test_the_shares_of_a_map_are_the_shares_of_its_points_corrected_by_the_audit(adaptive):
    assert sum(each.share.share for each in adaptive.motions) == pytest.approx(1.0)
    audit, cells = adaptive.audit, adaptive.plan.grid.size
    for number, motion in enumerate(adaptive.motions):
        more = (audit.gained[number] - audit.lost[number]) / audit.audited * (audit.filled - audit.audited)
        assert motion.share.share == pytest.approx(np.mean(adaptive.motion_numbers == number) + more / cells)
        assert motion.share.low <= motion.share.share <= motion.share.high


@pytest.fixture(scope="module")
def several_starts():
    plan = Map(
        frequency_hz=Range(start=100.0, stop=125.0, points=2),
        amplitude_m=Range(start=5e-6, stop=9e-6, points=2),
        random_starts=7,
        periods=600,
        coarse=2,
    )
    return solve_map(plan)


def test_a_map_with_several_initial_states_counts_the_motions_at_each_point(several_starts):
    counts = several_starts.motion_counts
    for place in np.ndindex(counts.shape):
        found = several_starts.motions_at(*place)
        assert len(found) == counts[place]
        assert sum(each.share.share for each in found) == pytest.approx(1.0)
    assert counts.max() > 1


def test_shares_over_common_initial_states_have_the_uncertainty_of_these_states(several_starts):
    for found in (several_starts.motions, several_starts.motions_at(0, 0)):
        assert sum(each.share.share for each in found) == pytest.approx(1.0)
        for each in found:
            of_starts = wilson_share(8 * each.share.share, 8)
            assert each.share.low <= of_starts.low + 1e-12
            assert each.share.high >= of_starts.high - 1e-12


def test_a_basin_map_shows_that_periodic_motions_return_after_a_small_kick():
    plan = Map(
        frequency_hz=160.0,
        amplitude_m=4e-6,
        y_m=Range(start=-4e-5, stop=4e-5, points=5),
        vx_m_per_s=Range(start=-0.5, stop=0.5, points=9),
        periods=1200,
        coarse=4,
    )
    results = solve_map(plan)
    assert plan.is_basin
    assert len(results.motions) >= 2
    solid = [each for each in results.motions if each.period is not None]
    found = kick_stability(results, (1e-6,), 10)
    # An attractor returns after a kick of a millionth of the gap.
    assert all(each.returned.share == 1.0 for each in found if results.motions[each.motion] in solid)


def test_stability_under_kicks_is_given_only_by_a_basin_map(adaptive):
    with pytest.raises(InvalidStudy, match="only the initial state varies"):
        kick_stability(adaptive)
    with pytest.raises(InvalidStudy, match="-3 kicks were requested; give 1 or more"):
        kick_stability(adaptive, kicks=-3)


def test_a_straight_basin_boundary_has_uncertainty_exponent_1():
    rows, columns = np.indices((256, 256))
    rough = uncertainty_exponent((rows + 2 * columns > 300).astype(np.int64))
    assert rough.low < 1.0 < rough.high
    assert rough.exponent == pytest.approx(1.0, abs=0.05)


def test_a_basin_boundary_of_known_dimension_has_the_right_exponent():
    # The stripes end at the points of Cantor's middle-third set: dimension 1 + ln 2 / ln 3.
    place = (np.arange(729) + 0.5) / 729
    label = np.zeros(729, dtype=np.int64)
    for generation in range(1, 7):
        place = place * 3.0
        is_gap = (np.floor(place) == 1.0) & (label == 0)
        label[is_gap] = generation
        place -= np.floor(place)
    rough = uncertainty_exponent(np.tile(label, (729, 1)))
    assert rough.exponent == pytest.approx(1.0 - np.log(2.0) / np.log(3.0), abs=0.12)


def test_no_uncertainty_exponent_is_determined_for_a_random_basin_map():
    labels = np.random.default_rng(3).integers(0, 2, (200, 200))
    assert uncertainty_exponent(labels) is None
    assert uncertainty_exponent(np.zeros((64, 64), dtype=np.int64)) is None


@pytest.mark.thorough
def test_the_onset_of_impacts_is_refined_and_audited():
    """Contact with soft stops causes no jump of the response, so impacts must be compared too."""
    soft = {
        "hertz_stiffness": 1e6,
        "frequency_hz": Range(start=60, stop=80, points=33),
        "amplitude_m": Range(start=1e-5, stop=6e-5, points=33),
        "periods": 400,
    }
    adaptive, full = solve_map(Map(**soft)), solve_map(Map(**soft, refinement="full"))
    is_filled = adaptive.state == PointState.FILLED
    differs = (adaptive.values("impact_rate") == 0.0) != (full.values("impact_rate") == 0.0)
    assert differs[is_filled].mean() <= adaptive.audit.wrong_share.high
    assert {each.has_impacts for each in adaptive.motions if each.period == 1} == {True, False}


def changed(path, change):
    """Return the path of a copy of a map's file after a change by another program."""
    copy = path.with_name("changed.h5")
    shutil.copy(path, copy)
    with h5py.File(copy, "r+") as file:
        change(file)
    return copy


def test_a_map_file_with_changed_values_or_plan_is_refused(tmp_path):
    plan = Map(frequency_hz=Range(start=200, stop=220, points=3), amplitude_m=5e-6)
    solve_map(plan, tmp_path / "map.h5")

    def change_value(file):
        file["response_i"][0, 1] *= 1.01

    def change_plan(file):
        file["study_json"][()] = file["study_json"][()].replace(b'"amplitude_m":5e-6', b'"amplitude_m":6e-6')

    for change, number in ((change_value, 1), (change_plan, 0)):
        with pytest.raises(StudyError, match=f"point {number} has other values than those computed"):
            open_map(changed(tmp_path / "map.h5", change))


def test_a_map_file_of_an_earlier_version_without_digests_is_read_and_resumed(tmp_path):
    plan = Map(frequency_hz=Range(start=200, stop=220, points=3), amplitude_m=5e-6)
    found = solve_map(plan, tmp_path / "map.h5")

    def remove_digest_and_a_point(file):
        del file["digest"]
        file["state"][0, 1] = 0

    old = changed(tmp_path / "map.h5", remove_digest_and_a_point)
    assert not open_map(old).is_complete
    resumed = solve_map(plan, old, "resume")
    assert np.array_equal(resumed.arrays["response_i"], found.arrays["response_i"])
