"""Textbook methods are what they are called, and an impact costs the energy that their steps make it cost."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vibench.cli.paper.textbook_methods import (
    ode45,
    runge_kutta,
    textbook_exponent,
    textbook_state,
)
from vibench.sim import Harmonic, gong2025, lyapunov_exponent
from vibench.sim.accuracy_benchmark.independent_solution import independent_state, state_error

DRIVE = Harmonic(130.0, 20e-6, 0.3)
MOVING = np.array([0.0, 0.0, 0.0, 0.0, 0.2, -0.1])
FREE = replace(
    gong2025(damping_time_s=0.0), stiffnesses=(1e-9,) * 3, dampings=(0.0,) * 3, lower_gap_m=math.inf
)
"""m1 and m2 meet at one stop, and nothing else holds them."""


def energy_kept(method, speed, late_s=0.0):
    before = np.array([0.0, FREE.gap_m - speed * late_s, 0.0, 0.0, speed, 0.0])
    after = textbook_state(FREE, Harmonic(100.0, 0.0), method, 4e-4, before)
    return ((after[4] - after[5]) / speed) ** 2


def test_the_classical_method_is_of_fourth_order():
    specimen = gong2025(contact="linear")
    truth = independent_state(specimen, DRIVE, 0.02, MOVING)
    coarse, fine = (
        state_error(textbook_state(specimen, DRIVE, runge_kutta(h), 0.02, MOVING), truth)
        for h in (5e-5, 2.5e-5)
    )
    assert coarse / fine == pytest.approx(16.0, rel=0.1)


def test_ode45_errs_as_its_tolerances_let_it():
    specimen = gong2025(contact="power:5")
    truth = independent_state(specimen, DRIVE, 0.01, MOVING)
    errors = [
        state_error(textbook_state(specimen, DRIVE, ode45(each, 1e-3 * each), 0.01, MOVING), truth)
        for each in (1e-3, 1e-6, 1e-9)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-6


def test_a_free_impact_keeps_its_energy_under_ode45_and_not_under_long_steps():
    kept = [energy_kept(ode45(), each) for each in (0.03, 0.1, 0.3)]
    np.testing.assert_allclose(kept, 1.0, atol=0.01)
    mean = np.mean([energy_kept(runge_kutta(2e-5), 0.03, late_s) for late_s in np.linspace(0, 2e-5, 20)])
    assert mean == pytest.approx(0.90, abs=0.02)


@pytest.mark.parametrize("method", [ode45(1e-6, 1e-9), runge_kutta(5e-5)])
def test_without_contact_the_exponent_is_the_decay_of_the_slowest_mode(method):
    specimen = gong2025(contact="linear")
    rates = specimen.damping_ratios * 2.0 * np.pi * specimen.natural_frequencies_hz
    found = textbook_exponent(specimen, Harmonic(130.0, 1e-6), method, 4.0, 4.0)
    assert found == pytest.approx(-np.min(rates), abs=0.2)


def test_chaos_under_a_tight_tolerance_is_that_of_the_exact_motion():
    specimen, drive = gong2025(), Harmonic(260.0, 5e-6)
    exact = lyapunov_exponent(specimen, drive)
    found = textbook_exponent(specimen, drive, ode45(1e-8, 1e-11))
    assert found == pytest.approx(exact.exponent_per_s, abs=6 * exact.standard_error_per_s)
    assert textbook_exponent(specimen, drive, ode45()) > 1.3 * exact.exponent_per_s


def test_a_motion_that_runs_away_is_lost_and_no_number():
    assert math.isnan(textbook_exponent(gong2025(), Harmonic(260.0, 5e-6), runge_kutta(1e-3), 0.5, 0.1))


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_step_or_a_tolerance_that_is_none_is_refused(value):
    with pytest.raises(ValueError, match="positive and finite"):
        runge_kutta(value)
    with pytest.raises(ValueError, match="positive and finite"):
        ode45(absolute=value)
