"""Initial states lead to the same motion if period and responses agree, or within the scatter of chaos."""

import numpy as np
import pytest

from vibench.sim import MotionKind
from vibench.sim.scene.repetition import Growth
from vibench.sim.scene.scatter import WindowScatter
from vibench.sim.scene.several_starts import (
    ReachedMotion,
    _error,
    counts_of,
    is_same,
    kind_among,
    motions_among,
)

RESPONSES = np.array([4.0, 3.0, 9.0, 8.0])
PERIODIC, TORUS, CHAOS, OPEN = (
    MotionKind.PERIODIC,
    MotionKind.QUASI_PERIODIC,
    MotionKind.CHAOTIC,
    MotionKind.UNDECIDED,
)


GREW = {TORUS: (0.1, -0.1, 0.0, 0.1), CHAOS: (6.0, 5.0, 4.0, 7.0), OPEN: (0.5, 0.6, -0.2, 0.5)}
WATCHED_S, FORGETTING_S = 4.0, 0.5


def reached_motion(kind, period=None, factor=1.0, scatter=None, grew=None):
    drawn = None if scatter is None else WindowScatter(scatter, 10)
    grew = GREW.get(kind, ()) if grew is None else grew
    growth = Growth(np.array(grew), WATCHED_S if grew else 0.0)
    return ReachedMotion(None, kind, period, factor * RESPONSES, drawn, 0.0, growth)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (reached_motion(PERIODIC, 1), reached_motion(PERIODIC, 1, 1.0005), True),
        (reached_motion(PERIODIC, 1), reached_motion(PERIODIC, 1, 1.002), False),
        (reached_motion(PERIODIC, 1), reached_motion(PERIODIC, 2), False),
        (reached_motion(PERIODIC, 3), reached_motion(CHAOS, None, 1.0002, 0.01), True),
        (reached_motion(PERIODIC, 3), reached_motion(CHAOS, None, 1.05, 0.05), False),
        (reached_motion(TORUS, None, 1.0, 1e-6), reached_motion(OPEN, None, 1.0001, 1e-6), True),
        (reached_motion(CHAOS, None, 1.0, 0.02), reached_motion(CHAOS, None, 1.08, 0.02), True),
        (reached_motion(CHAOS, None, 1.0, 0.02), reached_motion(OPEN, None, 1.03, 0.02), True),
        (reached_motion(CHAOS, None, 1.0, 0.02), reached_motion(TORUS, None, 1.03, 0.02), True),
        (reached_motion(CHAOS, None, 1.0, 0.02), reached_motion(TORUS, None, 1.03, 1e-6), False),
        (reached_motion(CHAOS, None, 1.0, 0.02), reached_motion(OPEN, None, 1.03), False),
        (reached_motion(CHAOS, None, 1.0, 0.02), reached_motion(CHAOS, None, 1.5, 0.02), False),
    ],
)
def test_equal_motions_from_two_initial_states_are_recognised(one, other, same):
    assert is_same(one, other) is same
    assert len(motions_among([one, other])) == (1 if same else 2)


def test_a_motion_reached_by_several_runs_is_reported_from_the_run_with_the_smallest_error():
    (motion,) = motions_among([reached_motion(OPEN, None, 1.0, 1e-6), reached_motion(TORUS, None, 1.0, 1e-6)])
    assert kind_among(motion, FORGETTING_S) is TORUS


def test_weak_chaos_is_classified_by_the_majority_of_runs():
    starts = [reached_motion(TORUS, None, 1.0, 0.01), reached_motion(OPEN, None, 1.01, 0.01)]
    starts += [reached_motion(CHAOS, None, factor, 0.01) for factor in (0.99, 1.0, 1.01)]
    (motion,) = motions_among(starts)
    assert kind_among(motion, FORGETTING_S) is CHAOS
    assert len(motion) == 5


def test_intermittent_chaos_is_not_classified_as_a_torus():
    """Example: Hertz, 83.697 Hz, 11.59 um, gaps 42.18 and 14.47 um; 5 of 15 runs were calm for 4 s."""
    calm = [reached_motion(TORUS, None, factor, 0.01) for factor in (0.99, 1.0, 1.0, 1.01, 1.0)]
    burst = reached_motion(CHAOS, None, 1.0, 0.01, grew=(0.0, 13.8, 14.4, -1.0))
    late = reached_motion(OPEN, None, 1.0, 0.01, grew=(0.1, -1.1, 3.3, 22.1))
    for starts, kind in (
        ([*calm, burst], CHAOS),
        ([*calm, late], OPEN),
        ([*4 * calm, *4 * calm, burst], OPEN),
        (calm, TORUS),
    ):
        (motion,) = motions_among(starts)
        assert kind_among(motion, FORGETTING_S) is kind


@pytest.mark.parametrize(
    ("kinds", "final"),
    [
        ((MotionKind.CHAOTIC, MotionKind.CHAOTIC, MotionKind.PERIODIC), (False, False, True)),
        ((MotionKind.CHAOTIC, MotionKind.PERIODIC), (True, True)),
        ((MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR, MotionKind.UNDECIDED), (True, False, False)),
    ],
)
def test_a_chaotic_motion_that_may_turn_into_another_is_not_called_final(kinds, final):
    """After 300 s, 2 % of 400 runs had the motion that nine of sixteen runs had after 60 s."""
    counts = counts_of(kinds, range(1, len(kinds) + 1))
    assert tuple(each.is_final for each in counts) == final
    assert [each.trials for each in counts] == list(range(1, len(kinds) + 1))


@pytest.mark.parametrize("order", [1, -1])
def test_runs_merged_into_one_motion_have_the_larger_of_their_uncertainties(order):
    calm, burst = reached_motion(TORUS, None, 1.0, 0.001), reached_motion(CHAOS, None, 1.0, 0.02)
    errors = {id(calm): 1e-6, id(burst): 0.04}
    assert _error([calm, burst][::order], lambda each: errors[id(each)]) == 0.04
