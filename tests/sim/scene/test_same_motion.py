"""When two starts came to the same motion: by period and responses, or within the scatter of chaos."""

import numpy as np
import pytest

from vibench.sim import MotionKind
from vibench.sim.scene._ensemble import counts_of
from vibench.sim.scene._scatter import WindowScatter
from vibench.sim.scene._several_starts import ReachedMotion, is_same, motions_among

RESPONSES = np.array([4.0, 3.0, 9.0, 8.0])
PERIODIC, TORUS, CHAOS, OPEN = (
    MotionKind.PERIODIC,
    MotionKind.QUASI_PERIODIC,
    MotionKind.CHAOTIC,
    MotionKind.UNDECIDED,
)


def reached(kind, period=None, factor=1.0, scatter=None):
    drawn = None if scatter is None else WindowScatter(scatter, 10)
    return ReachedMotion(None, kind, period, factor * RESPONSES, drawn, 0.0)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (reached(PERIODIC, 1), reached(PERIODIC, 1, 1.0005), True),
        (reached(PERIODIC, 1), reached(PERIODIC, 1, 1.002), False),
        (reached(PERIODIC, 1), reached(PERIODIC, 2), False),
        (reached(PERIODIC, 3), reached(CHAOS, None, 1.0002, 0.01), True),
        (reached(PERIODIC, 3), reached(CHAOS, None, 1.05, 0.05), False),
        (reached(TORUS, None, 1.0, 1e-6), reached(OPEN, None, 1.0001, 1e-6), True),
        (reached(CHAOS, None, 1.0, 0.02), reached(CHAOS, None, 1.08, 0.02), True),
        (reached(CHAOS, None, 1.0, 0.02), reached(OPEN, None, 1.03, 0.02), True),
        (reached(CHAOS, None, 1.0, 0.02), reached(TORUS, None, 1.03, 0.02), True),
        (reached(CHAOS, None, 1.0, 0.02), reached(TORUS, None, 1.03, 1e-6), False),
        (reached(CHAOS, None, 1.0, 0.02), reached(OPEN, None, 1.03), False),
        (reached(CHAOS, None, 1.0, 0.02), reached(CHAOS, None, 1.5, 0.02), False),
    ],
)
def test_two_starts_came_to_the_same_motion(one, other, same):
    assert is_same(one, other) is same
    assert len(motions_among([one, other])) == (1 if same else 2)


def test_a_motion_is_named_by_the_start_that_shows_it_best():
    (motion,) = motions_among([reached(OPEN, None, 1.0, 1e-6), reached(TORUS, None, 1.0, 1e-6)])
    assert motion[0].motion is TORUS


def test_weak_chaos_that_some_starts_take_for_a_torus_is_named_by_most_of_them():
    starts = [reached(TORUS, None, 1.0, 0.01), reached(OPEN, None, 1.01, 0.01)]
    starts += [reached(CHAOS, None, factor, 0.01) for factor in (0.99, 1.0, 1.01)]
    (motion,) = motions_among(starts)
    assert motion[0].motion is CHAOS
    assert len(motion) == 5


@pytest.mark.parametrize(
    ("kinds", "final"),
    [
        ((MotionKind.CHAOTIC, MotionKind.CHAOTIC, MotionKind.PERIODIC), (False, False, True)),
        ((MotionKind.CHAOTIC, MotionKind.PERIODIC), (True, True)),
        ((MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR, MotionKind.UNDECIDED), (True, False, False)),
    ],
)
def test_one_of_several_chaotic_motions_may_become_another(kinds, final):
    """Of 400 starts followed for 300 s, 2 % were left where nine of sixteen were after a minute."""
    counts = counts_of(kinds, range(1, len(kinds) + 1))
    assert tuple(each.is_final for each in counts) == final
    assert [each.trials for each in counts] == list(range(1, len(kinds) + 1))
