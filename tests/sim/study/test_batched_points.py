"""Points of a curve are computed in SIMD batches: chosen by the plan, reproducible, within their errors."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import Harmonic, MotionKind, Rest, Scene, gong2025, solve_scene
from vibench.sim.engine.batch import batches_pay
from vibench.sim.scene import solve as _solve
from vibench.sim.scene.prediction import Method, StartMemory
from vibench.sim.scene.scene import FixedDuration, Given
from vibench.sim.scene.solve import InBatches, solve_scenes
from vibench.sim.study import Study, planned_work_s, solve_study, study_solver


def solve_in_batch(scene):
    return solve_scenes([scene])[0].prediction


CURVE = {"frequencies_hz": {"start": 90.0, "stop": 270.0, "step": 9.0}, "amplitudes_m": [20e-6]}


@pytest.fixture(scope="module")
def curve():
    """Study over three resonances: contact-free, periodic and chaotic points."""
    return Study(**CURVE, duration_s=20.0, window_s=1.0, budget_s=0.05)


@pytest.fixture(scope="module")
def answers(curve):
    return solve_study(curve, workers=1)


@pytest.mark.skipif(not batches_pay(), reason="the processor has no registers that lanes pay in")
@pytest.mark.parametrize(
    ("changed", "in_lanes"),
    [
        ({}, True),
        ({"budget_s": 0.0}, False),
        ({"budget_s": 0.0, "amplitudes_m": [float(k) * 1e-6 for k in range(1, 9)]}, True),
        ({"starts": ("rest", "up")}, False),
        ({"frequencies_hz": [260.0]}, False),
        ({"duration_s": "auto"}, False),
        ({"duration_s": "auto", "amplitudes_m": [10e-6, 20e-6]}, True),
        ({"gaps_m": [30e-6, 45e-6], "frequencies_hz": [100.0, 130.0, 160.0, 190.0]}, False),
    ],
)
def test_long_independent_study_points_are_solved_in_batches(changed, in_lanes):
    plan = Study(**{**CURVE, "duration_s": 20.0, "window_s": 1.0} | changed)
    assert (study_solver(plan) == InBatches()) is in_lanes


@pytest.mark.thorough
def test_any_number_of_threads_gives_the_same_curve_bit_for_bit(curve, answers, require_equal):
    require_equal(solve_study(curve, workers=3), answers)


def test_a_batched_point_of_a_study_equals_a_single_prediction(curve, answers):
    for place in (4, 11, 19):
        alone = solve_in_batch(curve.scene((0, 0, 0, 0, 0, place), Rest()))
        frequency_hz = curve.frequencies_hz[place]
        assert answers.values("response_i", frequency=frequency_hz).item() == alone.response_i
        assert answers.values("error_estimate", frequency=frequency_hz).item() == alone.error_estimate
        np.testing.assert_array_equal(
            answers.values("final_state", frequency=frequency_hz).ravel(), alone.final_state
        )


@pytest.mark.thorough
def test_batched_and_single_motions_agree_within_their_errors():
    scenes = [
        Scene(
            gong2025(), Harmonic(frequency_hz, amplitude_m), duration=FixedDuration(20.0, 1.0), budget_s=0.05
        )
        for frequency_hz in (100.0, 110.0, 120.0, 130.0, 140.0, 150.0, 420.0, 500.0)
        for amplitude_m in (5e-6, 20e-6)
    ]
    kept = []
    for scene, beside in zip(scenes, solve_scenes(scenes), strict=True):
        found, alone = beside.prediction, solve_scene(scene)
        assert (found.memory is StartMemory.LOST) == (alone.memory is StartMemory.LOST)
        if alone.memory is StartMemory.KEPT:
            assert (found.motion, found.period) == (alone.motion, alone.period)
            stated = found.error_estimate + alone.error_estimate
            assert found.response_i == pytest.approx(alone.response_i, rel=stated)
            assert found.relative_ii == pytest.approx(alone.relative_ii, rel=stated)
            kept.append(alone.motion)
    assert kept.count(MotionKind.PERIODIC) >= 3


def test_scenes_that_batches_do_not_support_are_solved_singly():
    drive, length = Harmonic(130.0, 20e-6), FixedDuration(2.0, 0.5)
    scenes = [
        Scene(gong2025(contact="rigid:0.5"), drive, duration=length, budget_s=0.0),
        Scene(gong2025(), Harmonic(130.0, 1e-9), duration=FixedDuration(30.0, 0.5)),
        Scene(gong2025(), drive, accuracy="reference", duration=length, budget_s=0.0),
    ]
    found = [each.prediction for each in solve_scenes(scenes)]
    assert [repr(each) for each in found] == [repr(solve_scene(scene)) for scene in scenes]
    assert found[1].method is Method.CLOSED_FORM


def test_a_long_lead_in_stored_with_thinned_states_is_not_reported_as_start_dependent():
    # Of 13,000 drive periods only 4,096 states are stored for the comparison of initial states.
    scene = Scene(gong2025(), Harmonic(130.0, 20e-6), duration=FixedDuration(105.0, 0.5))
    assert solve_scene(scene).memory is StartMemory.KEPT
    assert solve_in_batch(scene).memory is StartMemory.KEPT


@pytest.mark.parametrize(("phase_rad", "length"), [(0.5 * np.pi, (20.0, 1.0)), (1.57, (20.0, 1.0))])
def test_a_motion_with_one_contact_per_period_is_not_reported_as_start_dependent(phase_rad, length):
    drive = Harmonic(130.0, 20e-6, phase_rad)
    scene = Scene(gong2025(), drive, duration=FixedDuration(*length), budget_s=0.02)
    assert solve_scene(scene).memory is StartMemory.KEPT
    assert solve_in_batch(scene).memory is StartMemory.KEPT


def test_points_observed_during_a_transient_are_computed_singly():
    # m1 has more than a hundred impacts per period, whose errors add up during the transient.
    state = (-4.911e-05, -5.537e-05, 9.979e-06, -0.02334, 0.01178, 0.03798)
    drive, length = Harmonic(105.98, 3.15e-07), FixedDuration(2.5, 1.0)
    scene = Scene(gong2025(), drive, duration=length, start=Given(state), budget_s=0.02)
    assert repr(solve_in_batch(scene)) == repr(solve_scene(scene))
    longer = replace(scene, duration=FixedDuration(4.0, 1.0))
    assert solve_in_batch(longer).memory is solve_scene(longer).memory is StartMemory.KEPT


def test_scenes_with_many_states_use_smaller_batches_with_equal_results(monkeypatch):
    scenes = [
        Scene(gong2025(), Harmonic(hz, 20e-6), duration=FixedDuration(6.0, 0.5), budget_s=0.02)
        for hz in (130.0, 150.0, 260.0)
    ]
    together = [repr(each.prediction) for each in solve_scenes(scenes)]
    monkeypatch.setattr(_solve, "MOST_HELD", 1.0)
    assert [repr(each.prediction) for each in solve_scenes(scenes)] == together


def test_planned_work_stays_finite_for_points_without_a_solution():
    study = Study(**CURVE, damping_times_s=[0.0, 1e300])
    assert np.isfinite(planned_work_s(study))


def test_settled_motions_are_computed_in_batches():
    # The motion is chaotic, so a different final state shows that a batch was used.
    scene = Scene(gong2025(), Harmonic(260.3, 20e-6), duration=FixedDuration(6.0, 0.5), budget_s=0.0)
    assert solve_in_batch(scene).final_state != solve_scene(scene).final_state
