"""Textbook integrators have their known order, and their steps change the energy in impacts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.independent_solution import independent_state, state_error
from benchmarks.paper_tables import runge_kutta, textbook_states
from vibench.cli.paper.textbook_methods import ode45, textbook_exponents
from vibench.sim import Harmonic, gong2025, lyapunov_exponent

DRIVE = Harmonic(130.0, 20e-6, 0.3)
MOVING = np.array([0.0, 0.0, 0.0, 0.0, 0.2, -0.1])
FREE = replace(
    gong2025(damping_time_s=0.0), stiffnesses=(1e-9,) * 3, dampings=(0.0,) * 3, lower_gap_m=math.inf
)
"""m1 and m2 meet at one stop, and nothing else holds them."""


def end_of(specimen, method, duration_s):
    return textbook_states(specimen, DRIVE, method, duration_s, [MOVING])[0]


def energy_ratios(method, speed, late_s):
    """Return the energy ratios of impacts that begin ``late_s`` after the start of a step."""
    before = np.zeros((len(late_s), 6))
    before[:, 1], before[:, 4] = FREE.gap_m - speed * late_s, speed
    after = textbook_states(FREE, Harmonic(100.0, 0.0), method, 4e-4, before)
    return ((after[:, 4] - after[:, 5]) / speed) ** 2


def test_the_classical_runge_kutta_method_has_order_four():
    specimen = gong2025(contact="linear")
    truth = independent_state(specimen, DRIVE, 0.02, MOVING)
    coarse, fine = (state_error(end_of(specimen, runge_kutta(h), 0.02), truth) for h in (5e-5, 2.5e-5))
    assert coarse / fine == pytest.approx(16.0, rel=0.1)


@pytest.mark.thorough
def test_ode45_has_errors_of_the_size_of_its_tolerances():
    specimen = gong2025(contact="power:5")
    truth = independent_state(specimen, DRIVE, 0.01, MOVING)
    errors = [
        state_error(end_of(specimen, ode45(each, 1e-3 * each), 0.01), truth) for each in (1e-3, 1e-6, 1e-9)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-6


def test_motions_computed_together_equal_motions_computed_one_by_one():
    starts = np.array([MOVING, 2.0 * MOVING, -MOVING])
    for method in (ode45(), runge_kutta(2e-6)):
        together = textbook_states(gong2025(), DRIVE, method, 5e-4, starts)
        for start, end in zip(starts, together, strict=True):
            # Step size control amplifies rounding errors.
            assert state_error(end, textbook_states(gong2025(), DRIVE, method, 5e-4, [start])[0]) < 1e-8


def test_ode45_conserves_energy_at_impacts_and_long_runge_kutta_steps_do_not():
    kept = [energy_ratios(ode45(), each, np.zeros(1))[0] for each in (0.03, 0.1, 0.3)]
    np.testing.assert_allclose(kept, 1.0, atol=0.01)
    mean = energy_ratios(runge_kutta(2e-5), 0.03, np.linspace(0, 2e-5, 20)).mean()
    assert mean == pytest.approx(0.90, abs=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("method", [ode45(1e-6, 1e-9), runge_kutta(5e-5)])
def test_textbook_exponents_without_contact_equal_the_slowest_decay_rate(method):
    specimen = gong2025(damping_time_s=2e-4, contact="linear")
    rates = specimen.damping_ratios * 2.0 * np.pi * specimen.natural_frequencies_hz
    found = textbook_exponents(specimen, [Harmonic(130.0, 1e-6)], method, 0.5, 0.3)
    assert found == pytest.approx(-np.min(rates), abs=0.5)


@pytest.mark.thorough
def test_chaos_under_a_tight_tolerance_matches_the_exact_motion():
    # Many short motions, computed together, replace one long motion.
    drives = [Harmonic(260.0, 5e-6, phase) for phase in np.linspace(0.0, 2.0 * np.pi, 100, endpoint=False)]
    exact = lyapunov_exponent(gong2025(), Harmonic(260.0, 5e-6)).exponent_per_s
    tight, usual = (
        textbook_exponents(gong2025(), drives, method, 0.25, 0.15) for method in (ode45(1e-6, 1e-9), ode45())
    )
    assert tight.mean() == pytest.approx(exact, abs=4.0 * tight.std() / 10.0)
    assert tight.std() / 10.0 < 0.04 * exact
    assert usual.mean() > 1.3 * exact


def test_a_diverging_motion_gives_a_nan_exponent():
    drives = [Harmonic(260.0, 5e-6), Harmonic(260.0, 1e-7)]
    found = textbook_exponents(gong2025(), drives, runge_kutta(1e-3), 0.5, 0.1)
    assert math.isnan(found[0])


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_an_invalid_step_or_tolerance_is_refused(value):
    with pytest.raises(ValueError, match="positive and finite"):
        runge_kutta(value)
    with pytest.raises(ValueError, match="positive and finite"):
        ode45(absolute=value)


def test_an_empty_list_of_drives_gives_no_exponents():
    """The claims page follows only colliding motions, and there may be none."""
    assert textbook_exponents(gong2025(), [], ode45()).shape == (0,)
    assert textbook_exponents(gong2025(), [], runge_kutta(1e-3)).shape == (0,)
