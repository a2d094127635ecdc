"""All six Lyapunov exponents: their sum, pairs without damping, and the largest exponent."""

import math

import numpy as np
import pytest

from vibench.sim import (
    Accuracy,
    Harmonic,
    Outcome,
    gong2025,
    lyapunov_exponent,
    lyapunov_spectrum,
    periodic_orbit,
)
from vibench.sim.exponents.lyapunov import ExponentVerdict, Source
from vibench.sim.exponents.lyapunov_spectrum import kaplan_yorke
from vibench.sim.specimen.modes import state_matrix

pytestmark = pytest.mark.timeout(300)
"""The first test compiles the kernels: a minute of processor time, possibly beside other compilations."""

CHAOS = Harmonic(260.0, 5e-6)
LARGE = Harmonic(430.0, 50e-6)


def damping_trace(specimen):
    """Return -tr(M^-1 C) [1/s]."""
    return -float(np.trace(np.linalg.solve(specimen.mass_matrix, specimen.damping_matrix)))


@pytest.mark.thorough
@pytest.mark.parametrize("drive", [CHAOS, Harmonic(260.0, 1e-6)])
@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "power:5", "power:47", "linear", "rigid:1"])
def test_the_sum_of_exponents_equals_the_trace_of_the_damping(contact, drive):
    specimen = gong2025(damping_time_s=3e-5, contact=contact)
    found = lyapunov_spectrum(specimen, drive, Accuracy.REFERENCE, duration_s=1.0, settle_s=0.2)
    assert damping_trace(specimen) == pytest.approx(-390.081, abs=1e-3)
    assert found.sum_per_s == pytest.approx(damping_trace(specimen), rel=1e-6)
    assert np.all(np.diff(found.exponents_per_s) <= 0.0)


@pytest.mark.parametrize(("accuracy", "allowed"), [(Accuracy.QUICK, 1e-2), (Accuracy.STANDARD, 1e-4)])
def test_the_sum_of_exponents_is_within_the_stated_error_of_each_accuracy_level(accuracy, allowed):
    found = lyapunov_spectrum(gong2025(), LARGE, accuracy, duration_s=2.0, settle_s=0.2)
    assert found.sum_per_s == pytest.approx(damping_trace(gong2025()), rel=allowed)


def test_a_lossy_contact_lowers_the_sum_of_exponents():
    lossy = lyapunov_spectrum(gong2025(contact="hunt_crossley:0.5"), CHAOS, duration_s=4.0)
    assert lossy.sum_per_s < damping_trace(gong2025()) - 5.0


@pytest.mark.parametrize("contact", ["hertz", "power:5", "rigid:1"])
def test_exponents_without_damping_form_pairs_of_opposite_sign(contact):
    specimen = gong2025(damping_time_s=0.0, contact=contact)
    found = lyapunov_spectrum(specimen, CHAOS, duration_s=8.0, settle_s=2.0)
    exponents = found.exponents_per_s
    assert abs(found.sum_per_s) < 0.05
    assert exponents[0] > 5.0
    paired = np.abs(exponents + exponents[::-1])
    assert np.all(
        paired < 4.0 * np.hypot(found.standard_errors_per_s, found.standard_errors_per_s[::-1]) + 1.0
    )


@pytest.mark.parametrize(
    ("contact", "drive"),
    [("linear", CHAOS), ("hertz", Harmonic(140.0, 5e-7)), ("power:3", Harmonic(90.0, 1e-9))],
)
def test_an_undamped_motion_without_growth_is_neither_chaotic_nor_regular(contact, drive):
    specimen = gong2025(damping_time_s=0.0, contact=contact)
    assert lyapunov_spectrum(specimen, drive, duration_s=3.0).verdict is ExponentVerdict.NEUTRAL
    assert lyapunov_exponent(specimen, drive, duration_s=3.0).verdict is ExponentVerdict.NEUTRAL


def test_the_first_of_six_exponents_is_the_largest():
    six = lyapunov_spectrum(gong2025(), CHAOS)
    one = lyapunov_exponent(gong2025(), CHAOS)
    allowed = math.hypot(six.standard_errors_per_s[0], one.standard_error_per_s)
    assert abs(six.exponents_per_s[0] - one.exponent_per_s) < 4.0 * allowed
    assert six.verdict is one.verdict is ExponentVerdict.CHAOTIC
    assert 4.0 < six.dimension < 5.0


def test_exponents_without_impacts_are_the_decay_rates_of_the_modes():
    found = lyapunov_spectrum(gong2025(), Harmonic(180.0, 1e-6), duration_s=4.0, settle_s=1.0)
    system, _ = state_matrix(gong2025())
    assert found.source is Source.MODES
    assert found.exponents_per_s == pytest.approx(np.sort(np.linalg.eigvals(system).real)[::-1])
    assert found.dimension == 0.0


@pytest.mark.parametrize(
    ("contact", "drive", "duration_s"),
    [
        ("power:5", Harmonic(91.57, 5e-6), 10.0),  # two pairs of complex multipliers
        ("hertz", Harmonic(130.0, 20e-6), 4.0),
        ("hertz", Harmonic(121.0, 20e-6), 25.0),  # slow transient: the multipliers have modulus 0.997
        ("hunt_crossley:0.5", Harmonic(130.0, 20e-6), 4.0),
    ],
)
def test_exponents_of_a_periodic_motion_are_those_of_its_floquet_multipliers(contact, drive, duration_s):
    specimen = gong2025(contact=contact)
    found = lyapunov_spectrum(specimen, drive, duration_s=duration_s)
    orbit = periodic_orbit(specimen, drive, start=found.final_state)
    exact = drive.frequency_hz * np.log(np.abs(orbit.floquet_multipliers))
    low, high = found.intervals_per_s().T
    assert found.source is Source.MULTIPLIERS
    assert np.all((low <= exact) & (exact <= high))
    assert found.exponents_per_s == pytest.approx(exact, abs=1e-4)


@pytest.mark.parametrize(("drive", "left"), [(Harmonic(130.0, 20e-6), 4), (CHAOS, 5)])
def test_a_stop_without_rebound_gives_one_or_two_exponents_of_minus_infinity(drive, left):
    found = lyapunov_spectrum(gong2025(contact="rigid:0"), drive, duration_s=4.0, settle_s=1.0)
    assert found.outcome is Outcome.REACHED_END
    assert np.count_nonzero(np.isfinite(found.exponents_per_s)) == left
    assert np.all(found.exponents_per_s[left:] == -np.inf)


@pytest.mark.parametrize(
    ("exponents", "dimension"),
    [
        ([0.9056, 0.0, -14.572], 2.06215),
        ([-1.0, -2.0], 0.0),
        ([1.0, 0.5], 2.0),
        ([0.41922, -1.62319], 1.25827),
        ([2.0, -math.inf], 1.0),
    ],
)
def test_the_dimension_of_an_attractor_matches_the_kaplan_yorke_formula(exponents, dimension):
    assert kaplan_yorke(np.array(exponents)) == pytest.approx(dimension, abs=1e-4)
