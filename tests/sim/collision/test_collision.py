"""Collisions solved as a whole match stepwise solutions in final state, observables and tangent."""

import math

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, gong2025
from vibench.sim.engine.run import Watch
from vibench.sim.engine.shapes import DEPTHS, DURATION, HALF_FORCE, SOFTEST, SPACING, collision_shapes
from vibench.sim.scene.followed_run import FollowedRun, Samples

DRIVE, STILL = Harmonic(130.0, 20e-6), Harmonic(130.0, 0.0)
STANDARD = Accuracy.STANDARD.tolerance
GAP = 45e-6
SCALES = np.repeat([1e-4, 0.1], 3)


def at_stop(speed, side=1.0, x=0.0):
    """Return a state in which m1 has just reached a mechanical stop with a speed [m/s]."""
    return np.array([side * x, side * GAP, 0.0, 0.0, side * speed, 0.0])


def follow_run(start, until, tolerance, drive=DRIVE):
    """Follow a run: collisions as a whole at the standard tolerance, stepwise at stricter tolerances."""
    run = FollowedRun(gong2025(), drive, tolerance, start)
    run.follow_tangent()
    seen = run.follow(until, Watch.PEAKS_AND_LINES, Samples(0.0, 2e5, 5))
    return run.motion, seen


def test_a_free_collision_has_the_duration_and_depth_of_hertz_theory():
    shapes, durations = collision_shapes()
    place = round(-SOFTEST / SPACING)
    lasts = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
    assert durations[place, DURATION] == pytest.approx(lasts, rel=2e-8)
    depths = shapes[place, DEPTHS]
    np.testing.assert_allclose(depths, depths[::-1], rtol=1e-12)
    assert HALF_FORCE == 5.0 / 4.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", [0.02, 0.05, 0.3, 1.0])
def test_a_collision_solved_as_a_whole_matches_a_stepwise_solution(speed, side):
    start = at_stop(speed, side, 2e-6)
    state, _ = follow_run(start, 1e-4, STANDARD)
    by_steps, _ = follow_run(start, 1e-4, 1e-11)
    assert np.abs((state - by_steps) / SCALES).max() < 1e-7 * max(speed, 0.1)


def test_mirrored_collisions_are_mirrored_to_the_last_bit():
    there, here = (follow_run(at_stop(0.1, side, 20e-6), 1e-4, STANDARD, STILL)[0] for side in (1.0, -1.0))
    np.testing.assert_array_equal(there, -here)


@pytest.mark.parametrize(("speed", "drive"), [(1e-6, DRIVE), (0.1, Harmonic(50_000.0, 1e-9))])
def test_collisions_that_cannot_be_predicted_are_resolved_in_steps(speed, drive):
    start = at_stop(speed)
    state, _ = follow_run(start, 1e-4, STANDARD, drive)
    by_steps, _ = follow_run(start, 1e-4, 1e-11, drive)
    assert np.abs((state - by_steps) / SCALES).max() < STANDARD


def test_an_interrupted_collision_is_resolved_in_steps():
    start = at_stop(0.1)
    run = FollowedRun(gong2025(), DRIVE, STANDARD, start)
    for until_s in (1e-5, 2e-5, 1e-4):
        run.follow(until_s)
    by_steps, _ = follow_run(start, 1e-4, 1e-11)
    assert np.abs((run.motion - by_steps) / SCALES).max() < STANDARD


@pytest.mark.parametrize("speed", [0.05, 0.3])
def test_observables_of_a_collision_match_a_stepwise_solution(speed):
    start, until = at_stop(speed, 1.0, 20e-6), 1e-4
    state, seen = follow_run(start, until, STANDARD)
    by_steps, told = follow_run(start, until, 1e-11)
    assert np.abs((state - by_steps) / SCALES).max() < 1e-7 * max(speed, 0.1)
    assert seen.peak_p_m == pytest.approx(told.peak_p_m, rel=3e-8)
    assert seen.peak_x_m == pytest.approx(told.peak_x_m, rel=1e-9)
    assert seen.area_x == pytest.approx(told.area_x, rel=1e-6)
    assert seen.area_p == pytest.approx(told.area_p, rel=1e-6)
    assert seen.growth == pytest.approx(told.growth, abs=1e-6)
    np.testing.assert_allclose(seen.states / SCALES, told.states / SCALES, atol=3e-6)


def test_a_peak_of_x_within_a_collision_is_found():
    start = at_stop(0.1, 1.0, 20e-6)
    start[3] = 1e-3
    _, seen = follow_run(start, 1e-4, STANDARD)
    _, told = follow_run(start, 1e-4, 1e-11)
    assert told.peak_x_m > 20.004e-6
    assert seen.peak_x_m == pytest.approx(told.peak_x_m, rel=1e-9)
