import math

import numpy as np
from hypothesis import given, settings, strategies as st

from vibench.sim.study._grid import Grid

axes = st.lists(st.tuples(st.integers(1, 4), st.booleans()), min_size=1, max_size=4)


@settings(deadline=None, max_examples=30)
@given(axes)
def test_grid_positions_match_numpy_unravel_index(axes):
    shape, ordered = zip(*axes, strict=True)
    grid = Grid(shape, ordered)
    assert grid.size == math.prod(shape)
    for number in range(grid.size):
        assert grid.place(number) == tuple(int(i) for i in np.unravel_index(number, shape))


@settings(deadline=None, max_examples=30)
@given(axes)
def test_neighbouring_grid_points_differ_by_one_step_along_one_ordered_axis(axes):
    shape, ordered = zip(*axes, strict=True)
    grid = Grid(shape, ordered)
    for number in range(grid.size):
        found = set(grid.neighbours(number))
        here = np.array(grid.place(number))
        expected = set()
        for other in range(grid.size):
            step = np.abs(np.array(grid.place(other)) - here)
            if step.sum() == 1 and ordered[int(step.argmax())]:
                expected.add(other)
        assert found == expected
