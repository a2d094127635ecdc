"""Motions with every contact law match direct integration, closed forms and mechanics."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from benchmarks.independent_solution import independent_state
from tests.sim.as_written import as_written, distance, paper
from vibench.sim import (
    Accuracy,
    Harmonic,
    HuntCrossley,
    LinearGap,
    Outcome,
    PowerLaw,
    Sampled,
    Specimen,
    gong2025,
    integrate,
)
from vibench.sim.specimen.stops import Stops

DRIVE = Harmonic(130.0, 20e-6)
STILL = Harmonic(100.0, 0.0)
POWERS = ["power:3", "power:7", "power:3+5+7", "power:29"]
STOPS = ["linear_gap", "hunt_crossley:0.5", "hertz"]


def colliding_pair(contact, gap_m=45e-6, faint=(1e-2, 2e-2, 3e-2)):
    """Return a specimen whose m1 and m2 collide; all springs are negligibly soft."""
    return Specimen((1.0, 2.1e-3, 2.0e-3), faint, (0.0, 0.0, 0.0), gap_m, contact)


@pytest.mark.parametrize(
    ("contact", "drive"), [*((law, DRIVE) for law in POWERS + STOPS), ("hertz", Harmonic(260.0, 5e-6))]
)
def test_every_contact_law_agrees_with_direct_integration(contact, drive):
    specimen = paper(contact)
    ours = integrate(specimen, drive, 0.02, Accuracy.REFERENCE)
    assert ours.outcome is Outcome.REACHED_END
    assert distance(ours.final_state, as_written(specimen, drive, 0.02)) < 2e-6


@dataclass(frozen=True)
class EveryTerm:
    """A contact law outside the registry, defined by its parameters only."""

    stops = Stops(linear_stiffness=2e6, contact_stiffness=4.9e9, loss=0.3)


def test_every_solver_integrates_a_softening_law():
    specimen = replace(paper("hertz"), contact=EveryTerm())
    ours = integrate(specimen, DRIVE, 0.02, Accuracy.REFERENCE)
    assert ours.impacts.count > 2
    assert distance(ours.final_state, as_written(specimen, DRIVE, 0.02)) < 2e-6
    assert distance(ours.final_state, independent_state(specimen, DRIVE, 0.02, np.zeros(6))) < 2e-6


@pytest.mark.parametrize("gap_m", [(30e-6, 45e-6), (20e-6, math.inf), (math.inf, 20e-6)])
@pytest.mark.parametrize("contact", ["hertz", "linear_gap"])
def test_unequal_stops_agree_with_direct_integration(contact, gap_m):
    specimen = paper(contact, gap_m=gap_m)
    ours = integrate(specimen, DRIVE, 0.02, Accuracy.REFERENCE, sample_rate_hz=1e5)
    p = ours.states[:, 1] - ours.states[:, 2]
    assert ours.impacts.count > 2
    assert -gap_m[0] - 5e-6 < p.min()
    assert p.max() < gap_m[1] + 5e-6
    assert distance(ours.final_state, as_written(specimen, DRIVE, 0.02)) < 2e-6


@settings(max_examples=10, deadline=None)
@given(st.floats(60.0, 500.0), st.floats(2e-6, 30e-6), st.sampled_from(["hertz", "linear_gap"]))
def test_exchanging_unequal_stops_mirrors_the_motion(frequency_hz, amplitude_m, contact):
    here = paper(contact, gap_m=(20e-6, 50e-6))
    there = paper(contact, gap_m=(50e-6, 20e-6))
    # 10 ms only: chaos amplifies the rounding of pi by 1e4 in 10 ms and by 1e8 in 20 ms.
    one = integrate(here, Harmonic(frequency_hz, amplitude_m), 0.01, Accuracy.REFERENCE)
    other = integrate(there, Harmonic(frequency_hz, amplitude_m, math.pi), 0.01, Accuracy.REFERENCE)
    assert one.impacts.count == other.impacts.count
    assert distance(one.final_state, -other.final_state) < 1e-6


@pytest.mark.parametrize("exponent", [3, 5, 7, 29, 47])
def test_a_free_oscillator_with_a_power_law_has_its_closed_form_period(exponent):
    # For the highest exponents, the force at 40 um is weak: 5e-3 N for p^47, a period of 50 ms.
    specimen = colliding_pair(PowerLaw(46e-6, ((exponent, 5.0),)), faint=(1e-9, 2e-9, 3e-9))
    amplitude, force = 40e-6, 5.0
    m1, m2 = specimen.masses[1:]
    mass = m1 * m2 / (m1 + m2)
    stiff = force / 46e-6**exponent if exponent < 40 else None
    coefficient = (
        stiff * amplitude ** (exponent - 1)
        if stiff
        else force / 46e-6 * (amplitude / 46e-6) ** (exponent - 1)
    )
    inverse = 1.0 / (exponent + 1)
    # T = 4 sqrt((n+1)/2) / sqrt(k A^(n-1) / m) times the integral of du/sqrt(1 - u^(n+1)) (beta function).
    quarter = math.sqrt(math.pi) * math.gamma(inverse) * inverse / math.gamma(inverse + 0.5)
    period = 4.0 * math.sqrt((exponent + 1) / 2.0) * quarter / math.sqrt(coefficient / mass)
    start = np.array([0.0, amplitude * m2 / (m1 + m2), -amplitude * m1 / (m1 + m2), 0.0, 0.0, 0.0])
    run = integrate(specimen, STILL, 10.0 * period, Accuracy.REFERENCE, start)
    p, rate = run.final_state[1] - run.final_state[2], run.final_state[4] - run.final_state[5]
    speed = math.sqrt(2.0 * coefficient * amplitude**2 / ((exponent + 1) * mass))
    assert run.outcome is Outcome.REACHED_END
    assert p == pytest.approx(amplitude, rel=1e-7)
    assert abs(rate) < 1e-6 * speed


def test_a_linear_stop_gives_the_bilinear_frequency():
    stiffness = 4e5
    specimen = replace(colliding_pair(LinearGap(stiffness), 1e-12), stiffnesses=(1e-2, 2e4, 3e-2))
    specimen = replace(specimen, lower_gap_m=math.inf)
    m1, m2 = specimen.masses[1:]
    mass = m1 * m2 / (m1 + m2)
    soft, stiff = math.sqrt(2e4 / mass), math.sqrt((2e4 + stiffness) / mass)
    period = math.pi / soft + math.pi / stiff
    start = np.array([0.0, -20e-6 * m2 / (m1 + m2), 20e-6 * m1 / (m1 + m2), 0.0, 0.0, 0.0])
    run = integrate(specimen, STILL, 20.0 * period, Accuracy.REFERENCE, start)
    assert run.impacts.count == 20
    assert np.diff(run.impacts.times_s) == pytest.approx(period, rel=1e-6)
    assert run.final_state[1] - run.final_state[2] == pytest.approx(-20e-6, rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-2, 1.0), st.floats(0.0, 2.0))
def test_the_speed_after_a_lossy_collision_matches_the_closed_form(speed, loss):
    specimen = replace(colliding_pair(HuntCrossley(4.9e9, loss)), lower_gap_m=math.inf)
    m1, m2 = specimen.masses[1:]
    p = 44.999e-6
    share = np.array([0.0, m2 / (m1 + m2), -m1 / (m1 + m2)])
    run = integrate(
        specimen, STILL, 1e-9 / speed + 3e-4, Accuracy.REFERENCE, np.concatenate([p * share, speed * share])
    )
    after = run.final_state[5] - run.final_state[4]

    # d(r^2/2)/dd = -(k/m) d^1.5 (1 + loss r): r - ln(1 + loss r)/loss changes equally in and out.
    def invariant(r):
        return (
            (loss * r - math.log1p(loss * r)) / loss**2
            if loss * abs(r) > 1e-3
            else r**2 / 2 - loss * r**3 / 3
        )

    assert run.impacts.count == 1
    assert 0.0 < after <= speed * (1.0 + 1e-4)
    assert invariant(-after) == pytest.approx(invariant(speed), rel=1e-3)


@pytest.mark.parametrize("contact", ["power:5", "linear_gap", "hunt_crossley:0.5"])
def test_a_sampled_sine_gives_the_same_motion_as_the_sine_under_any_contact_law(contact):
    specimen, rate = paper(contact), 20_000.0
    sine = DRIVE.amplitude_m * np.sin(2.0 * np.pi * DRIVE.frequency_hz * np.arange(1300) / rate)
    sampled = integrate(specimen, Sampled(sine, rate), 0.05, Accuracy.REFERENCE)
    harmonic = integrate(specimen, DRIVE, 0.05, Accuracy.REFERENCE)
    assert distance(sampled.final_state, harmonic.final_state) < 1e-5


@pytest.mark.parametrize("contact", ["power:47", "power:201"])
@pytest.mark.parametrize("accuracy", list(Accuracy))
def test_an_integration_step_that_goes_too_deep_into_a_steep_power_law_is_rejected(contact, accuracy):
    for drive in (Harmonic(260.0, 5e-6), Harmonic(430.0, 50e-6), Harmonic(210.0, 1e-3)):
        run = integrate(paper(contact), drive, 1.0, accuracy, sample_rate_hz=1e4)
        assert run.outcome is Outcome.REACHED_END
        assert np.max(np.abs(run.states[:, 1] - run.states[:, 2])) < 80e-6


def test_very_soft_springs_do_not_reduce_accuracy():
    # m1 and m2 have very soft springs: their modes are a million times slower than the power law.
    soft = replace(
        gong2025(damping_time_s=0.0), stiffnesses=(1e-6, 1e-6, 1e-6), contact=PowerLaw(46e-6, ((3, 5.0),))
    )
    start = np.array([0.0, 20e-6, -20e-6, 0.0, 0.0, 0.0])
    run = integrate(soft, Harmonic(1.0, 0.0), 0.05, Accuracy.REFERENCE, start)
    m1, m2 = soft.masses[1:]
    p, rate = run.final_state[1] - run.final_state[2], run.final_state[4] - run.final_state[5]
    held = [5.0 / 46e-6**3 * each**4 / 4.0 for each in (40e-6, p)]
    moving = 0.5 * m1 * m2 / (m1 + m2) * rate**2
    assert held[1] + moving == pytest.approx(held[0], rel=1e-9)
