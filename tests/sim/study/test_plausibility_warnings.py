"""What looks like a slip of the pen is said, and what is only large is not."""

import pytest

from vibench.sim.study import Study, plausibility_warnings


def study(amplitudes_m, gaps_m=(45e-6,)):
    return Study(frequencies_hz=[260.0], amplitudes_m=amplitudes_m, gaps_m=gaps_m)


def test_metres_in_the_place_of_micrometres_are_doubted_with_the_number_that_was_meant():
    (said,) = plausibility_warnings(study([5.0]))
    assert "5 m is 1.1e+05 times the gap of 4.5e-05 m" in said
    assert said.endswith("give 5e-06")


@pytest.mark.parametrize(("amplitude_m", "count"), [(5e-6, 0), (1e-3, 0), (0.0449, 0), (0.0451, 1)])
def test_only_a_base_that_moves_by_more_than_a_thousand_gaps_is_doubted(amplitude_m, count):
    assert len(list(plausibility_warnings(study([5e-7, amplitude_m])))) == count


def test_the_largest_amplitude_is_held_against_the_narrowest_gap():
    assert len(list(plausibility_warnings(study([1e-6, 2e-3], gaps_m=(1e-6, 45e-6))))) == 1
    assert len(list(plausibility_warnings(study([1e-6, 2e-3], gaps_m=(3e-6, 45e-6))))) == 0
