import math

import numpy as np
import pytest

from vibench.sim.periodic.continuation import ArcEnd, ArcSteps, trace


class Circle:
    """The circle u^2 + lambda^2 = 1."""

    def linearise(self, point):
        u, parameter = point
        return np.array([u**2 + parameter**2 - 1.0]), np.array([[2.0 * u, 2.0 * parameter]])


class Snap:
    """The curve lambda = u^3 - u, with folds at u = -+1/sqrt(3), lambda = +-2/(3 sqrt(3))."""

    def linearise(self, point):
        u, parameter = point
        return np.array([parameter - u**3 + u]), np.array([[1.0 - 3.0 * u**2, 1.0]])


class Kink:
    """The curve lambda = -|u|, which turns back in a kink at u = 0."""

    def linearise(self, point):
        u, parameter = point
        return np.array([parameter + abs(u)]), np.array([[1.0 if u >= 0.0 else -1.0, 1.0]])


class LoopBesideALine:
    """A flat ellipse with sharp folds at its ends, and a straight branch next to it."""

    def linearise(self, point):
        u, parameter = point
        loop, line = (u / 0.02) ** 2 + parameter**2 - 1.0, (u - 0.03) / 0.02
        slopes = [2.0 * u / 0.02**2 * line + loop / 0.02, 2.0 * parameter * line]
        return np.array([loop * line]), np.array([slopes])


class Edge:
    """The line lambda = u, defined up to u = 1/2 only."""

    def linearise(self, point):
        u, parameter = point
        return np.array([parameter - u if u < 0.5 else math.nan]), np.array([[-1.0, 1.0]])


class Sawtooth:
    """The line u = 0 up to lambda = 0, then teeth narrower than a step of the continuation."""

    def linearise(self, point):
        u, parameter = point
        turn = max(parameter, 0.0) / 3e-6
        rises = turn % 2.0 < 1.0
        height = 0.0 if parameter <= 0.0 else 3e-6 * (turn % 1.0 if rises else 1.0 - turn % 1.0)
        slope = 0.0 if parameter <= 0.0 else (-1.0 if rises else 1.0)
        return np.array([u - height]), np.array([[1.0, slope]])


@pytest.mark.parametrize("longest", [0.01, 0.1, 0.3])
def test_the_continuation_follows_a_circle_once_with_both_folds(longest):
    steps = ArcSteps(first=0.005, longest=longest, most_points=2000)
    points = list(trace(Circle(), np.array([-1.0, 0.0]), 1.0, (-2.0, 2.0), steps))
    assert points[-1].end is ArcEnd.CLOSED
    assert points[-1].point == pytest.approx([-1.0, 0.0], abs=1e-12)
    assert points[-1].arc == pytest.approx(2.0 * math.pi, rel=0.01)
    assert all(p.point @ p.point == pytest.approx(1.0, abs=1e-9) for p in points)
    folds = [p.point[-1] for p in points if p.is_fold]
    assert folds == pytest.approx([1.0, -1.0], abs=1e-9)


def test_both_folds_of_a_snap_through_are_located():
    points = list(trace(Snap(), np.array([-1.5, -1.875]), 1.0, (-1.875, 1.0), ArcSteps()))
    folds = [p.point for p in points if p.is_fold]
    peak = 2.0 / (3.0 * math.sqrt(3.0))
    assert [f[-1] for f in folds] == pytest.approx([peak, -peak], abs=1e-9)
    assert [f[0] for f in folds] == pytest.approx([-1 / math.sqrt(3), 1 / math.sqrt(3)], abs=1e-6)
    assert points[-1].end is ArcEnd.REACHED_BOUND
    assert points[-1].point[-1] == 1.0


def test_a_branch_that_turns_back_in_a_kink_is_followed_across_the_kink():
    points = list(trace(Kink(), np.array([-1.0, -1.0]), 1.0, (-1.0, 1.0), ArcSteps()))
    assert points[-1].end is ArcEnd.REACHED_BOUND
    assert points[-1].point == pytest.approx([1.0, -1.0], abs=1e-12)
    (fold,) = (p for p in points if p.is_fold)
    assert fold.point[-1] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("longest", [0.02, 0.05, 0.1, 0.3])
def test_a_continuation_step_past_a_sharp_fold_stays_on_its_branch(longest):
    steps = ArcSteps(longest=longest)
    points = list(trace(LoopBesideALine(), np.array([0.02, 0.0]), 1.0, (-3.0, 3.0), steps))
    assert points[-1].end is ArcEnd.CLOSED
    assert max(p.point[0] for p in points) < 0.0201
    assert [p.point[-1] for p in points if p.is_fold] == pytest.approx([1.0, -1.0], abs=1e-8)


def test_an_undefined_residual_ends_the_branch_with_a_reason():
    last = list(trace(Edge(), np.array([0.0, 0.0]), 1.0, (-1.0, 1.0), ArcSteps()))[-1]
    assert last.end is ArcEnd.STEP_TOO_SHORT
    assert last.point[-1] == pytest.approx(0.5, abs=1e-5)


def test_a_branch_with_repeated_kinks_ends_soon():
    points = list(trace(Sawtooth(), np.array([0.0, -0.1]), 1.0, (-1.0, 1.0), ArcSteps()))
    assert points[-1].end is ArcEnd.STEP_TOO_SHORT
    assert points[-1].point[-1] == pytest.approx(0.0, abs=1e-3)
    assert len(points) < 300


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_the_first_continuation_step_has_the_requested_direction(direction):
    points = list(trace(Snap(), np.array([0.0, 0.0]), direction, (-0.1, 0.1), ArcSteps()))
    assert points[-1].point[-1] == pytest.approx(0.1 * direction)
