"""A whole collision in one, against the steps that resolve it: how it ends, what is seen, small changes."""

import math

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, gong2025
from vibench.sim.collision import collide, collision_tables, new_collision
from vibench.sim.contact import begin_contact
from vibench.sim.engine import DEPTHS, DURATION, HALF_FORCE, SOFTEST, SPACING
from vibench.sim.scene._followed_run import FollowedRun, ObservedQuantities, Samples
from vibench.sim.stepping import harmonic_tables, new_state

DRIVE = Harmonic(130.0, 20e-6)
GAP = 45e-6
SCALES = np.repeat([1e-4, 0.1], 3)


def touching(speed, side=1.0, x=0.0):
    """A state in which m1 has just come to a stop with a speed."""
    return np.array([side * x, side * GAP, 0.0, 0.0, side * speed, 0.0])


def collided(start, tolerance=Accuracy.STANDARD.tolerance, longest=1.0, drive=DRIVE, **options):
    """Time that a collision took, 0 if it was left alone, and the state after it."""
    specimen = gong2025(**options)
    tables, state = harmonic_tables(specimen, drive), new_state(specimen, np.zeros(6), Accuracy.STANDARD)
    state[:6] = start
    begin_contact(state, math.copysign(1.0, start[1]), tables.flight.par, tolerance)
    workspace = new_collision()
    return (
        collide(state, tables.flight.phase, longest, tolerance, tables.flight, tables.collisions, workspace),
        state,
        workspace,
    )


def followed(start, until, tolerance, **options):
    """The same by steps, which stricter tolerances than the standard's take."""
    run = FollowedRun(gong2025(**options), DRIVE, tolerance, start)
    run.follow_tangent()
    seen = run.follow(until, ObservedQuantities.PEAKS_AND_LINES, Samples(0.0, 2e5, 5))
    return run.state, seen


def test_a_collision_that_nothing_presses_lasts_and_deepens_as_hertz_has_it():
    tables = harmonic_tables(gong2025(), DRIVE).collisions
    place = round(-SOFTEST / SPACING)
    lasts = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
    assert tables.durations[place, DURATION] == pytest.approx(lasts, rel=2e-8)
    depths = tables.shapes[place, DEPTHS]
    np.testing.assert_allclose(depths, depths[::-1], rtol=1e-12)
    assert HALF_FORCE == 5.0 / 4.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", [0.02, 0.05, 0.3, 1.0])
def test_it_ends_as_the_steps_of_a_contact_do(speed, side):
    start = touching(speed, side, 2e-6)
    lasted, state, _ = collided(start)
    assert lasted > 0.0
    by_steps, _ = followed(start, lasted, 1e-11)
    # The steps may still be in contact, by the last of its digits, or a hair beyond it.
    assert np.abs((state[:6] - by_steps) / SCALES).max() < 1e-7 * max(speed, 0.1)
    assert abs(state[1] - state[2]) == pytest.approx(GAP, rel=1e-15)


def test_mirrored_collisions_are_mirrored_to_the_last_bit():
    there, here = (collided(touching(0.1, side, 20e-6), drive=Harmonic(130.0, 0.0)) for side in (1.0, -1.0))
    np.testing.assert_array_equal(there[1][:6], -here[1][:6])


@pytest.mark.parametrize(
    ("speed", "options"),
    [
        (1e-6, {}),
        (0.1, {"tolerance": 1e-10}),
        (0.1, {"longest": 2e-5}),
        (0.1, {"drive": Harmonic(50_000.0, 1e-9)}),
    ],
)
def test_what_is_not_known_beforehand_is_left_to_the_steps(speed, options):
    start = touching(speed)
    lasted, state, _ = collided(start, **options)
    assert lasted == 0.0
    np.testing.assert_array_equal(state[:6], start)


@pytest.mark.parametrize("speed", [0.05, 0.3])
def test_peaks_lines_samples_and_small_changes_are_those_of_the_steps(speed):
    start, until = touching(speed, 1.0, 20e-6), 1e-4
    state, seen = followed(start, until, Accuracy.STANDARD.tolerance)
    by_steps, told = followed(start, until, 1e-11)
    assert np.abs((state - by_steps) / SCALES).max() < 1e-7 * max(speed, 0.1)
    assert seen.peak_p_m == pytest.approx(told.peak_p_m, rel=3e-8)
    assert seen.peak_x_m == pytest.approx(told.peak_x_m, rel=1e-9)
    assert seen.area_x == pytest.approx(told.area_x, rel=1e-6)
    assert seen.area_p == pytest.approx(told.area_p, rel=1e-6)
    assert seen.growth == pytest.approx(told.growth, abs=1e-6)
    np.testing.assert_allclose(seen.states / SCALES, told.states / SCALES, atol=3e-6)


def test_x_that_turns_within_a_collision_is_seen_at_its_peak():
    start = touching(0.1, 1.0, 20e-6)
    start[3] = 1e-3
    _, seen = followed(start, 1e-4, Accuracy.STANDARD.tolerance)
    _, told = followed(start, 1e-4, 1e-11)
    assert told.peak_x_m > 20.004e-6
    assert seen.peak_x_m == pytest.approx(told.peak_x_m, rel=1e-9)


def test_only_hertzs_stops_have_such_tables():
    for contact in ("linear", "linear_gap", "hunt_crossley:0.5", "rigid:0.8", "power:3"):
        assert collision_tables(gong2025(contact=contact), 1.0, 1.0 + 0.0j, np.ones(3)) is None
