import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim.study._grid import Grid
from vibench.sim.study._queue import NOBODY, Costs, PointScheduler


def scheduler_of(planned_s, after=None, is_done=None):
    points = len(planned_s)
    costs = Costs(Grid((points,), (True,)), np.array(planned_s, dtype=float))
    after = np.full(points, NOBODY) if after is None else np.array(after)
    is_done = np.zeros(points, dtype=bool) if is_done is None else np.array(is_done)
    scheduler = PointScheduler(after, is_done, costs)
    scheduler.release(np.arange(points))
    return scheduler


def test_the_study_point_with_the_longest_planned_time_begins_first():
    scheduler = scheduler_of([1.0, 5.0, 3.0])
    assert [scheduler.take(0.1, 1) for _ in range(4)] == [(1,), (2,), (0,), ()]


def test_short_study_points_are_grouped_into_larger_jobs():
    assert scheduler_of([1.0, 1.0, 1.0, 1.0]).take(2.5, 10) == (0, 1, 2)
    assert scheduler_of([1.0, 1.0, 1.0, 1.0]).take(2.5, 2) == (0, 1)


def test_the_priority_of_a_study_point_includes_all_points_waiting_for_it():
    # The chain 0 <- 1 <- 2 takes 6 s, point 3 alone 5 s.
    scheduler = scheduler_of([1.0, 2.0, 3.0, 5.0], after=[NOBODY, 0, 1, NOBODY])
    assert scheduler.take(0.1, 1) == (0,)


def test_the_successor_of_a_finished_study_point_may_start_at_once():
    scheduler = scheduler_of([1.0, 2.0, 1.0], after=[NOBODY, 0, 1], is_done=[True, False, False])
    assert scheduler.take(10.0, 10) == (1,)


def test_measured_computing_times_of_neighbours_change_the_order_of_study_points():
    scheduler = scheduler_of([1.0, 1.0, 1.0, 2.0])
    assert scheduler.take(0.1, 1) == (3,)
    scheduler.finish(3)
    scheduler.learn(3, 0.5)
    assert scheduler.take(0.1, 1) == (0,)
    assert scheduler.take(0.1, 1) == (1,)
    assert scheduler.take(0.1, 1) == (2,)


def test_a_study_point_that_failed_in_a_group_is_repeated_alone():
    scheduler = scheduler_of([1.0, 1.0, 1.0])
    assert scheduler.take(10.0, 10) == (0, 1, 2)
    scheduler.put_back_alone(1)
    scheduler.put_back(2)
    handed_out = [scheduler.take(10.0, 10) for _ in range(3)]
    assert sorted(handed_out) == [(), (1,), (2,)]


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.001, 10.0), st.booleans()), min_size=1, max_size=20), st.integers(0, 2**32)
)
def test_every_study_point_is_scheduled_until_it_is_finished_and_never_again(points, seed):
    """Chains of any length, replies in any order, some points put back, some costs learnt."""
    luck = random.Random(seed)
    planned_s, is_chained = zip(*points, strict=True)
    after = [number - 1 if number and chained else NOBODY for number, chained in enumerate(is_chained)]
    scheduler = scheduler_of(planned_s, after)
    out, done = [], set()
    while scheduler.left:
        taken = scheduler.take(luck.uniform(0.0, 5.0) + 1e-9, luck.randint(1, 4))
        for number in taken:
            assert number not in done
            assert number not in out
            assert after[number] == NOBODY or after[number] in done
        out.extend(taken)
        assert out, "points are left, and none is under way or ready"
        number = out.pop(luck.randrange(len(out)))
        match luck.randrange(4):
            case 0:
                scheduler.put_back(number)
            case 1:
                scheduler.put_back_alone(number)
            case _:
                scheduler.finish(number)
                done.add(number)
                if luck.randrange(2):
                    scheduler.learn(number, luck.uniform(1e-4, 10.0))
    assert done == set(range(len(points)))


def line_of(planned_s):
    return Costs(Grid((len(planned_s),), (True,)), np.array(planned_s))


def test_the_cost_of_a_point_is_estimated_from_its_neighbours():
    costs = line_of([1.0] * 5)
    assert list(costs.learn(0, 3.0)) == [1]
    assert costs.estimate_s(1) == 3.0
    assert set(costs.learn(2, 5.0)) == {1, 3}
    assert costs.estimate_s(1) == 4.0
    assert costs.estimate_s(3) == 5.0
    assert costs.estimate_s(4) == 1.0


def test_the_cost_of_a_measured_point_is_not_estimated_again():
    costs = line_of([1.0] * 3)
    list(costs.learn(0, 3.0))
    list(costs.learn(1, 7.0))
    assert 0 not in list(costs.learn(1, 7.0))


def test_cost_estimates_of_new_points_are_scaled_by_the_error_at_measured_points():
    costs = line_of([1.0, 1.0, 1.0, 2.0])
    is_missing = np.array([False, True, True, True])
    assert costs.remaining_s(is_missing) == pytest.approx(4.0)
    list(costs.learn(0, 10.0))
    # Point 1 as its measured neighbour (10 s); points 2 and 3 as planned, times ten.
    assert costs.remaining_s(is_missing) == pytest.approx(10.0 + 10.0 + 20.0)
