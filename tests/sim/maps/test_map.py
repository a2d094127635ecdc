"""Map requests: quantities that may vary, estimates, and refusals in one sentence."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import Hertz, gong2025, integrate
from vibench.sim.engine.batch import batches_pay
from vibench.sim.maps import Map, Range, Spacing, estimate_map, map_solver, solve_map
from vibench.sim.maps._map import contact_energy_j
from vibench.sim.scene.prediction import Method
from vibench.sim.scene.solve import InBatches, Question, settle_scene, solve_scene
from vibench.sim.study import InvalidStudy

FREQUENCIES = Range(start=100.0, stop=300.0, points=5)
GAPS = Range(start=3e-5, stop=5e-5, points=3)
STIFFNESSES = Range(start=1e9, stop=5e9, points=3)
LEVELS = Range(start=1e-6, stop=2e-5, points=4, spacing="logarithmic")


@pytest.mark.parametrize(
    ("said", "complaint"),
    [
        ({}, "a map needs one or two ranges, but none was given; give start, stop and points"),
        (
            {"frequency_hz": FREQUENCIES, "amplitude_m": LEVELS, "gap_m": LEVELS},
            "but 3 were given: frequency_hz, amplitude_m, gap_m; give",
        ),
        ({"y_m": LEVELS, "chain": ("up",)}, "y_m sets the start"),
        ({"frequency_hz": FREQUENCIES, "coarse": 12}, "coarse = 12 is not a power of 2"),
        ({"frequency_hz": FREQUENCIES, "gap_m": GAPS, "model": "linear"}, "gap_m varies, but has no effect"),
        (
            {"frequency_hz": FREQUENCIES, "hertz_stiffness": STIFFNESSES, "model": "rigid:0.8"},
            "hertz_stiffness varies, but has no effect",
        ),
        ({"frequency_hz": FREQUENCIES, "window_periods": 5000}, "is not below periods = 3000"),
        ({"frequency_hz": FREQUENCIES, "periods": 10**12}, "less than or equal to 10000000"),
        ({"frequency_hz": {"start": -5.0, "stop": 20.0, "points": 3}}, "Drive frequency -5.0 Hz"),
        ({"frequency_hz": {"start": 50.0, "stop": 20.0, "points": 3}}, "does not ascend"),
        (
            {"frequency_hz": {"start": 1e-300, "stop": 1e300, "points": 3}},
            "frequency 1e-300 Hz is not allowed: it must lie between 1e-12 and 1e.12 Hz",
        ),
        (
            {"x_m": {"start": -1e308, "stop": 1e308, "points": 3}},
            r"3 points from -1e\+308 to 1e\+308 are not all different numbers; give fewer points",
        ),
        ({"x_m": {"start": 1.0, "stop": 1.0 + 1e-15, "points": 9}}, "9 points from 1.0 to 1.0000000000000"),
        ({"frequency_hz": FREQUENCIES, "chain": ("up", "up")}, "has a direction twice"),
        (
            {
                "frequency_hz": {"start": 1.0, "stop": 2.0, "points": 9999},
                "amplitude_m": {"start": 1.0, "stop": 2.0, "points": 9999},
            },
            "a map has at most",
        ),
    ],
)
def test_invalid_maps_are_refused_with_a_readable_message(said, complaint):
    with pytest.raises(ValueError, match=complaint):
        Map.model_validate(said)


def test_values_of_a_range_are_at_the_requested_positions():
    for each in (FREQUENCIES, LEVELS):
        values, edges = np.array(each.values), np.array(each.edges)
        assert (values[0], values[-1]) == pytest.approx((each.start, each.stop), rel=1e-12)
        assert np.all((edges[:-1] < values) & (values < edges[1:]))
        spacing = np.diff(values) if each.spacing is Spacing.LINEAR else np.diff(np.log(values))
        assert np.allclose(spacing, spacing[0], rtol=1e-9)


@pytest.mark.parametrize(("points", "step"), [(15, 1), (17, 2), (40, 4), (129, 16), (600, 16)])
def test_a_small_map_is_computed_completely(points, step):
    levels = LEVELS.model_copy(update={"points": 700})
    plan = Map(frequency_hz=FREQUENCIES.model_copy(update={"points": points}), amplitude_m=levels)
    assert plan.first_step == step
    assert plan.is_adaptive == (step > 1)
    assert plan.model_copy(update={"coarse": 32}).first_step == 32


def test_every_quantity_of_a_map_is_set_in_its_scenes():
    plan = Map(
        k1_n_per_m=Range(start=500.0, stop=900.0, points=3),
        hertz_stiffness=Range(start=1e9, stop=5e9, points=2),
        gap_m=40e-6,
        damping_time_s=1e-5,
        vy_m_per_s=0.01,
    )
    # The first varied quantity is the last axis.
    assert [axis.name for axis in plan.axes] == ["hertz_stiffness", "start", "k1"]
    scene = plan.scene((1, 0, 2))
    assert scene.specimen.stiffnesses[1] == 900.0
    assert scene.specimen.dampings[1] == pytest.approx(900.0 * 1e-5)
    assert scene.specimen.contact == Hertz(5e9)
    assert scene.specimen.gap_m == 40e-6
    assert scene.start.state == (0.0, 0.0, 0.0, 0.0, 0.01, 0.0)


def test_random_initial_states_of_a_map_differ_and_are_reproducible():
    plan = Map(frequency_hz=FREQUENCIES, random_starts=3, seed=4)
    assert plan.start_labels == ("rest", "random 1", "random 2", "random 3")
    states = [plan.scene((k, 2)).start.state for k in range(4)]
    assert len(set(states)) == 4
    assert plan.scene((2, 2)).start.state == states[2]


@pytest.mark.parametrize(("frequency_hz", "amplitude_m"), [(130.0, 2e-5), (95.0, 5e-6), (60.0, 1e-6)])
def test_a_settled_map_point_matches_the_full_prediction(frequency_hz, amplitude_m):
    scene = Map(frequency_hz=Range(start=50.0, stop=frequency_hz, points=2), amplitude_m=amplitude_m).scene(
        (0, 1)
    )
    light, whole = settle_scene(scene), solve_scene(scene)
    assert (light.motion, light.period) == (whole.motion, whole.period)
    # In a map a closed-form motion ends after whole drive periods, so that points can continue from it.
    assert light.final_state == whole.final_state or light.method is Method.CLOSED_FORM
    assert (light.response_i, light.response_ii) == (whole.response_i, whole.response_ii)
    assert whole.error_estimate is not None
    assert light.error_estimate is None or light.error_estimate == whole.error_estimate


def test_the_contact_energy_matches_the_deepest_penetration():
    plan = Map(frequency_hz=Range(start=129.0, stop=130.0, points=2), amplitude_m=2e-5)
    scene = plan.scene((0, 1))
    found = settle_scene(scene)
    run = integrate(
        scene.specimen,
        scene.drive,
        found.period / 130.0,
        "standard",
        found.final_state,
        sample_rate_hz=2e6,
        start_time_s=found.duration_s,
    )
    depth = np.abs(run.states[:, 1] - run.states[:, 2]).max() - scene.specimen.gap_m
    energy_j = 0.4 * scene.specimen.contact.stiffness * depth**2.5
    assert energy_j > 0.0
    # The peak lies between two samples, slightly above the largest sample.
    assert contact_energy_j(scene.specimen, found) == pytest.approx(energy_j, rel=5e-3)
    rigid = gong2025(contact="rigid:0.8")
    assert contact_energy_j(rigid, found) is None
    # The largest abs(p) does not determine which of two unequal stops was reached.
    for gap_m in ((3e-5, 6e-5), (3e-5, float("inf"))):
        unlike = gong2025(gap_m=gap_m)
        assert contact_energy_j(unlike, found) is None
        assert contact_energy_j(unlike, replace(found, relative_i=1.0)) == 0.0


def test_the_estimated_time_of_a_map_grows_with_work_and_shrinks_with_workers():
    plan = Map(frequency_hz=FREQUENCIES, amplitude_m=LEVELS, coarse=2)
    one, two = estimate_map(plan, 1), estimate_map(plan, 2)
    assert (one.points, one.coarse_points) == (20, 9)
    assert two.most_s < one.most_s
    assert 0.0 < one.first_s < one.most_s
    several = estimate_map(plan.model_copy(update={"random_starts": 3}), 1)
    assert several.points == 80
    assert several.work_s > one.work_s
    assert math.isfinite(several.most_useful_workers)
    assert replace(one, work_s=1e3).most_useful_workers == one.points


def test_the_largest_possible_cost_of_a_map_grows_with_its_drive_periods():
    plan = Map(frequency_hz=FREQUENCIES, amplitude_m=2e-5)
    usual, long = (estimate_map(plan.model_copy(update={"periods": each}), 1) for each in (3000, 300_000))
    assert usual.work_s <= usual.longest_work_s < 0.02 * long.longest_work_s
    assert long.work_s == usual.work_s
    assert f"{long.all_s:.2g} s, or {long.most_s:.2g} s if no motion repeats" in long.sentence


@pytest.mark.skipif(not batches_pay(), reason="this processor has no registers for lanes")
@pytest.mark.parametrize(
    ("said", "lanes"),
    [
        ({"amplitude_m": LEVELS}, True),
        ({"random_starts": 2}, True),
        ({"chain": ("up",)}, False),
        ({"gap_m": Range(start=30e-6, stop=60e-6, points=3)}, False),
    ],
)
def test_independent_points_of_one_specimen_are_computed_in_batches(said, lanes):
    plan = Map(frequency_hz=FREQUENCIES, **said)
    assert (map_solver(plan) == InBatches(Question.MOTION)) is lanes
    assert ("SIMD" in estimate_map(plan, 1).sentence) is lanes


def test_a_map_along_one_quantity_stores_one_state_per_drive_period():
    plan = Map(frequency_hz=Range(start=120.0, stop=130.0, points=3), amplitude_m=2e-5, chain=("up", "down"))
    results = solve_map(plan, workers=1)
    section, period = results.values("section_p"), results.values("period")
    for place in np.ndindex(period.shape):
        assert np.count_nonzero(np.isfinite(section[place])) == (
            64 if np.isnan(period[place]) else period[place]
        )
    # An upward chain continues from the lower neighbour.
    assert results.values("continues", start="up").tolist()[1:] == [0.0, 1.0]
    assert results.values("continues", start="down").tolist()[:-1] == [4.0, 5.0]


def test_chained_map_points_are_sampled_at_drive_phase_zero():
    # The lower points have no contact (closed form); the points that continue from them have impacts.
    plan = Map(frequency_hz=Range(start=84.0, stop=90.0, points=4), amplitude_m=5e-6, chain=("up",))
    phase = solve_map(plan, workers=1).values("drive_phase")
    assert np.allclose(np.exp(1j * phase), 1.0, atol=1e-6)


@pytest.mark.parametrize("other", ["x_m", "frequency_hz"])
def test_random_initial_states_are_refused_if_the_map_varies_the_initial_state(other):
    """Every cell would repeat the same few initial states; files with such maps can still be opened."""
    plan = Map(**{other: LEVELS if other == "x_m" else FREQUENCIES, "y_m": LEVELS, "random_starts": 8})
    for asked in (estimate_map, solve_map):
        with pytest.raises(InvalidStudy, match="a range of y_m, which sets"):
            asked(plan)


def test_a_map_with_an_error_target_stores_the_errors_of_its_points():
    plan = Map(
        frequency_hz=Range(start=120, stop=140, points=3),
        amplitude_m=Range(start=1e-6, stop=2e-5, points=2),
        refinement="full",
        error="1 %",
    )
    results = solve_map(plan)
    assert results.is_complete
    assert np.all(results.arrays["error_estimate"] <= 0.01)
    assert "error_estimate" not in {column.name for column in plan.model_copy(update={"error": None}).columns}


@pytest.mark.thorough
@pytest.mark.parametrize("target", [{"error": 0.01}, {"time_s": 3.0}])
def test_the_cost_estimate_of_a_map_with_an_error_target_comes_from_a_pilot_run(target):
    plan = Map(frequency_hz=Range(start=250, stop=270, points=9), amplitude_m=50e-6, **target)
    told = estimate_map(plan, 1)
    # For 1 %, a chaotic point takes tenths of a second; the time depends on the processor.
    assert told.work_s > 9 * (0.05 if "error" in target else 2.9)
    assert told.work_s <= told.longest_work_s
    assert "based on a pilot run of a few points" in told.sentence
