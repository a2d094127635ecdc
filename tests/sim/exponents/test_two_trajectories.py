"""Two whole motions part as the tangent says: an independent check, contact by contact and on average."""

import math

import numpy as np
import pytest

from tests.sim.exponents.two_trajectories import two_trajectory_exponent
from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, lyapunov_exponent
from vibench.sim.exponents.tangent_run import interval_for, run_with_tangent

CHAOS = Harmonic(260.0, 5e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "hunt_crossley:0.5", "rigid:0.8", "power:5"])
def test_interval_by_interval_two_motions_part_as_the_tangent_grows(contact):
    specimen = gong2025(contact=contact)
    interval = interval_for(specimen, CHAOS, 1.0 / 260.0)
    run = run_with_tangent(specimen, CHAOS, 1, 0.2, interval, Accuracy.REFERENCE)
    two = two_trajectory_exponent(
        specimen, CHAOS, duration_s=0.2, settle_s=0.0, interval_s=1.0 / 260.0
    ).local_exponents_per_s
    # Both start in the same direction. Chaos parts the two calculations for good after about 0.1 s.
    assert two[:14] == pytest.approx(run.rates[:14, 0], abs=2.0)
    assert np.ptp(run.rates[:14, 0]) > 20.0


@pytest.mark.thorough
@pytest.mark.parametrize("contact", ["hertz", "power:5"])
def test_on_average_both_give_the_same_exponent_within_their_errors(contact):
    specimen = gong2025(contact=contact)
    tangent = lyapunov_exponent(specimen, CHAOS, duration_s=20.0)
    two = two_trajectory_exponent(specimen, CHAOS, Accuracy.STANDARD, duration_s=20.0)
    allowed = math.hypot(tangent.standard_error_per_s, two.standard_error_per_s)
    assert abs(tangent.exponent_per_s - two.exponent_per_s) < 4.0 * allowed
    assert allowed < 0.06 * tangent.exponent_per_s


def test_without_impacts_two_motions_come_together_with_the_slowest_mode():
    specimen = gong2025(contact="linear")
    found = two_trajectory_exponent(specimen, CHAOS, duration_s=4.0, settle_s=2.0)
    omega = 2.0 * math.pi * specimen.natural_frequencies_hz[0]
    assert found.exponent_per_s == pytest.approx(-2e-5 * omega**2 / 2.0, abs=0.02)


def test_a_lost_run_has_no_exponent():
    found = two_trajectory_exponent(gong2025(), CHAOS, duration_s=5.0, max_impact_rate_hz=10.0)
    assert found.outcome is Outcome.TOO_MANY_IMPACTS
    assert math.isnan(found.exponent_per_s)
