import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.sim.study import frequency_range
from vibench.sim.study._study import expand_ranges


def test_a_frequency_range_includes_its_stop_value_if_a_step_reaches_this_value():
    assert frequency_range(10.0, 600.0, 1.0) == tuple(float(f) for f in range(10, 601))
    assert frequency_range(1.0, 2.0, 0.1)[-1] == pytest.approx(2.0)
    assert len(frequency_range(1.0, 2.0, 0.1)) == 11


def test_a_range_ends_below_its_stop_value_if_the_step_does_not_fit():
    assert frequency_range(1.0, 2.0, 0.4) == (1.0, 1.4, 1.8)


@given(st.floats(0.1, 100.0), st.integers(0, 500), st.floats(1e-3, 10.0))
def test_a_range_has_one_more_value_than_steps_despite_rounding(start, steps, step):
    values = frequency_range(start, start + steps * step, step)
    assert len(values) == steps + 1
    assert np.allclose(np.diff(values), step)


@pytest.mark.parametrize("numbers", [(2.0, 1.0, 0.1), (1.0, 2.0, 0.0), (1.0, 2.0, -1.0), (1.0, np.inf, 1.0)])
def test_an_empty_range_is_refused(numbers):
    with pytest.raises(ValueError, match="start must not be above stop, and the step must be positive"):
        frequency_range(*numbers)


def test_a_range_of_too_many_values_is_refused_before_it_is_made():
    with pytest.raises(ValueError, match="too long"):
        frequency_range(1.0, 2.0, 1e-12)


def test_ranges_and_numbers_can_be_mixed_and_duplicates_count_once():
    given = [3, {"start": 1, "stop": 3, "step": 1}, {"start": 2.0, "stop": 2.5, "step": 0.25}]
    assert expand_ranges(given) == [1.0, 2.0, 2.25, 2.5, 3]


def test_overlapping_ranges_contain_no_frequency_twice():
    given = [{"start": 190.3, "stop": 290, "step": 0.7}, {"start": 200.1, "stop": 250, "step": 0.1}]
    frequencies = expand_ranges(given)
    assert len(frequencies) == len({f"{frequency:.9g}" for frequency in frequencies})
    fine = {"start": 100.0, "stop": 100.0000000105, "step": 1e-9}
    assert len(expand_ranges([fine, 100.0])) == 11


def test_values_that_are_not_ranges_are_left_to_later_validation():
    assert expand_ranges("all") == "all"
    assert expand_ranges({"start": 1, "stop": 2}) == {"start": 1, "stop": 2}
    assert expand_ranges([1.0, "two"]) == [1.0, "two"]


@pytest.mark.parametrize("start", ["true", None, "20", True])
def test_a_range_without_three_numbers_is_refused(start):
    with pytest.raises(ValueError, match="give three numbers"):
        expand_ranges({"start": start, "stop": 2.0, "step": 1.0})
