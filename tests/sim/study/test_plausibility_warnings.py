"""Implausible values give a warning, and values that are only large do not."""

import pytest

from vibench.sim.study import plausibility_warnings


def warnings_for(amplitudes_m, gaps_m=(45e-6,)):
    return list(plausibility_warnings(amplitudes_m, gaps_m))


@pytest.mark.parametrize(("amplitude_m", "count"), [(5e-6, 0), (1e-3, 0), (0.0449, 0), (0.0451, 1)])
def test_only_base_motion_over_1000_gaps_gives_a_warning(amplitude_m, count):
    assert len(warnings_for([5e-7, amplitude_m])) == count


def test_the_largest_amplitude_is_checked_against_the_narrowest_gap():
    assert len(warnings_for([2e-3, 1e-6], gaps_m=(45e-6, 1e-6))) == 1
    assert len(warnings_for([2e-3, 1e-6], gaps_m=(45e-6, 3e-6))) == 0


@pytest.mark.parametrize(("gaps_m", "count"), [((45.0,), 1), ((30e-6, float("inf")), 0), ((1e-3,), 0)])
def test_a_finite_gap_wider_than_a_specimen_gives_a_warning(gaps_m, count):
    found = warnings_for([5e-6], gaps_m)
    assert len(found) == count
    assert all(doubt.endswith("if 45 micrometres were meant, give 4.5e-05") for doubt in found)
