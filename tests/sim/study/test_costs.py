import numpy as np
import pytest

from vibench.sim.study._grid import Grid
from vibench.sim.study._queue import Costs


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
