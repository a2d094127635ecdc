import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, gong2025, periodic_orbit, spring_of, structure_of
from vibench.sim.periodic._balance_agreement import Agreement, check_balance
from vibench.sim.periodic._balance_solver import BalanceOptions, Guess, balance
from vibench.sim.periodic._frequency_time import phasors_of
from vibench.sim.periodic._shooting import SAMPLES

SPECIMEN = gong2025(damping_time_s=3e-5)


def balanced(frequency_hz, amplitude_m, options, start=None):
    return balance(structure_of(SPECIMEN), spring_of(SPECIMEN), frequency_hz, amplitude_m, options, start)


def orbit_spectrum(frequency_hz, amplitude_m):
    orbit = periodic_orbit(SPECIMEN, Harmonic(frequency_hz, amplitude_m))
    states = orbit.period_map.orbit(orbit.state, orbit.drive, SAMPLES).states[:SAMPLES]
    lines = phasors_of(states[:, 1] - states[:, 2])
    return Guess(np.arange(1000), lines[:1000])


def test_a_motion_below_the_gap_agrees():
    check = check_balance(SPECIMEN, balanced(60.0, 1e-6, BalanceOptions(fewest=1)), duration_s=4.0)
    assert check.agreement is Agreement.AGREES
    assert check.response_ii_ratio == pytest.approx(1.0, rel=1e-6)
    assert check.defect < 1e-9


def test_an_impacting_motion_with_enough_harmonics_agrees_and_with_too_few_says_so():
    start = orbit_spectrum(100.0, 5e-6)
    good = balanced(100.0, 5e-6, BalanceOptions(fewest=401), start)
    assert check_balance(SPECIMEN, good, accuracy=Accuracy.QUICK).agreement is Agreement.AGREES
    poor = balanced(100.0, 5e-6, BalanceOptions(fewest=51, most=51), start)
    assert check_balance(SPECIMEN, poor, accuracy=Accuracy.QUICK).agreement is Agreement.NOT_CONVERGED
    blind = balanced(100.0, 5e-6, BalanceOptions(fewest=51, most=51, tolerance=1.0), start)
    check = check_balance(SPECIMEN, blind, tolerance=1e-4, accuracy=Accuracy.QUICK)
    assert check.agreement is Agreement.NOT_A_MOTION


def test_a_real_motion_that_a_run_from_rest_does_not_reach_is_told_apart():
    # At 100 Hz and 4.2 um the linear motion stays between the stops, but the transient from rest does not.
    linear = balanced(100.0, 4.2e-6, BalanceOptions(fewest=1))
    assert linear.response_i[3] * linear.amplitude_m < SPECIMEN.gap_m
    check = check_balance(SPECIMEN, linear, accuracy=Accuracy.QUICK)
    assert check.defect < 1e-9
    assert check.agreement is Agreement.ELSEWHERE
