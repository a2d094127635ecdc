"""Lyapunov exponents of the specimen match closed forms and known motions, with correct errors."""

import math

import numpy as np
import pytest

from tests.sim.as_written import free_state_matrix
from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, lyapunov_exponent
from vibench.sim.exponents.lyapunov import FEWEST_INTERVALS, ExponentVerdict, Precision, Source
from vibench.sim.exponents.tangent_run import FinalMotion
from vibench.sim.periodic.shooting import flow_derivative, periodic_orbit

CHAOS = Harmonic(260.0, 5e-6)


def slowest_decay(specimen):
    """Return the real part of the slowest eigenvalue [1/s], computed independently."""
    return np.linalg.eigvals(free_state_matrix(specimen)).real.max()


@pytest.mark.parametrize("contact", ["linear", "hertz", "linear_gap", "hunt_crossley:0.5", "rigid:0.8"])
def test_the_exponent_without_impacts_is_the_slowest_decay_rate(contact):
    specimen = gong2025(damping_time_s=3e-5, contact=contact)
    found = lyapunov_exponent(specimen, Harmonic(180.0, 1e-6), duration_s=5.0, settle_s=1.0)
    assert found.source is Source.MODES
    assert found.motion is FinalMotion.QUIET
    assert found.verdict is ExponentVerdict.REGULAR
    assert found.exponent_per_s == pytest.approx(slowest_decay(specimen), rel=1e-9)
    # Closed form -damping_time * omega1^2 / 2, and the mean over the run.
    omega = 2.0 * math.pi * specimen.natural_frequencies_hz[0]
    assert found.exponent_per_s == pytest.approx(-3e-5 * omega**2 / 2.0, rel=1e-6)
    assert found.local_exponents_per_s[50:].mean() == pytest.approx(found.exponent_per_s, abs=0.05)


def test_exponents_agree_with_what_the_paper_states_about_chaos():
    # Paper, section 3.1 and Fig. 10: above 100 per second with collisions at 5 um; about zero at 1 um.
    colliding = lyapunov_exponent(gong2025(), CHAOS)
    assert colliding.verdict is ExponentVerdict.CHAOTIC
    assert colliding.exponent_per_s > 100.0
    assert colliding.exponent_per_s - 3.0 * colliding.standard_error_per_s > 90.0
    for frequency_hz in (94.4, 180.0, 260.0, 266.0, 500.0):
        still = lyapunov_exponent(gong2025(), Harmonic(frequency_hz, 1e-6))
        assert still.exponent_per_s < 4.0


def test_the_exponent_computed_from_the_multipliers_of_a_periodic_motion_matches_the_averaged_exponent():
    found = lyapunov_exponent(gong2025(), Harmonic(130.0, 20e-6), duration_s=10.0)
    assert found.source is Source.MULTIPLIERS
    assert found.standard_error_per_s < 1e-3
    assert found.exponent_per_s == pytest.approx(found.local_exponents_per_s[-300:].mean(), abs=0.3)


@pytest.mark.parametrize(("frequency_hz", "amplitude_m"), [(59.62, 1.26e-4), (31.27, 6.2e-4)])
def test_the_exponent_of_a_run_that_still_approaches_its_periodic_motion_is_the_one_of_this_motion(
    frequency_hz, amplitude_m
):
    specimen, drive = gong2025(), Harmonic(frequency_hz, amplitude_m)
    found = lyapunov_exponent(specimen, drive, duration_s=10.0)
    assert found.source is Source.MULTIPLIERS
    state, period_s = periodic_orbit(specimen, drive, start=found.final_state).state, 1.0 / frequency_hz
    _, derivative = flow_derivative(specimen, drive, state, period_s)
    exact = math.log(np.abs(np.linalg.eigvals(derivative)).max()) / period_s
    assert found.exponent_per_s == pytest.approx(exact, rel=1e-10)
    assert abs(found.exponent_per_s - exact) <= 2.0 * found.standard_error_per_s


@pytest.mark.parametrize("frequency_hz", [3.0, 15.0, 21.018, 23.0])
@pytest.mark.parametrize("contact", ["power:3", "power:47"])
def test_the_exponent_of_a_tiny_motion_with_a_smooth_law_is_the_slowest_decay_within_its_error(
    contact, frequency_hz
):
    specimen = gong2025(contact=contact)
    found = lyapunov_exponent(specimen, Harmonic(frequency_hz, 1e-9))
    off = abs(found.exponent_per_s - slowest_decay(specimen))
    assert off <= 2.0 * found.standard_error_per_s + 1e-12
    assert off < 1e-3


def test_an_exponent_run_ends_as_soon_as_its_error_is_small_enough():
    whole = lyapunov_exponent(gong2025(), Harmonic(430.0, 50e-6), Accuracy.QUICK, duration_s=10.0)
    short = lyapunov_exponent(
        gong2025(), Harmonic(430.0, 50e-6), Accuracy.QUICK, 10.0, precision=Precision(0.0, 0.02)
    )
    assert short.end_time_s < 0.8 * whole.end_time_s
    assert short.standard_error_per_s < 0.02 * short.exponent_per_s
    assert abs(short.exponent_per_s - whole.exponent_per_s) < 4.0 * short.standard_error_per_s


def test_the_exponent_of_a_failed_run_is_missing_with_a_reason():
    found = lyapunov_exponent(gong2025(), CHAOS, duration_s=5.0, max_impact_rate_hz=10.0)
    assert found.outcome is Outcome.TOO_MANY_IMPACTS
    assert found.verdict is ExponentVerdict.UNKNOWN
    assert math.isnan(found.exponent_per_s)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"duration_s": 0.1}, f"request {FEWEST_INTERVALS} intervals or more"),
        ({"duration_s": -1.0}, "the duration > 0"),
        ({"settle_s": math.inf}, "both must be finite"),
        ({"interval_s": 0.0}, "Interval 0.0 s is not allowed"),
        ({"initial_state": np.zeros(5)}, "six finite numbers"),
    ],
)
def test_exponents_of_invalid_runs_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        lyapunov_exponent(gong2025(), CHAOS, **options)
