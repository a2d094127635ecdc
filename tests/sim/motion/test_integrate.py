"""Runs of the specimen match scipy, closed forms and the laws of mechanics."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.sim.as_written import as_written, distance, paper, stored_energy
from vibench.sim import Accuracy, Harmonic, LinearSweep, Outcome, Sampled, gong2025, integrate
from vibench.sim.motion.integrate import HERMITE, sweep_interval_s

PERIODIC = Harmonic(130.0, 20e-6)
"""Drive that causes about 260 impacts a second, and a stable periodic motion."""


def energy(specimen, state):
    """Return kinetic plus elastic plus contact energy [J] with the base at rest."""
    pressed = np.maximum(np.abs(state[:, 1] - state[:, 2]) - specimen.gap_m, 0.0)
    return stored_energy(specimen, state) + 0.4 * specimen.contact.stiffness * pressed**2.5


def test_the_phase_of_a_motion_does_not_drift_over_a_million_periods():
    specimen, drive = paper(contact="linear"), Harmonic(256.0, 1e-6)
    start = integrate(specimen, drive, 2.0).final_state
    late = integrate(specimen, drive, 2.0, start_time_s=4096.0).final_state
    np.testing.assert_allclose(late, start, rtol=1e-11, atol=0)


def test_energy_is_conserved_through_a_thousand_impacts():
    specimen = gong2025(damping_time_s=0.0)
    state = np.array([2e-5, 0.0, -4e-5, 0.1, 0.05, -0.2])
    run = integrate(
        specimen, Harmonic(100.0, 0.0), 2.0, Accuracy.REFERENCE, initial_state=state, sample_rate_hz=3e3
    )
    assert run.impacts.count > 1000
    held = energy(specimen, run.states)
    np.testing.assert_allclose(held, held[0], rtol=2e-10 * run.impacts.count)


@pytest.mark.parametrize("contact", ["hertz", "hunt_crossley:0.5", "linear_gap", "power:3", "power:47"])
def test_samples_match_the_motion_between_contacts_and_in_contact(contact):
    specimen = paper(contact)
    run = integrate(specimen, PERIODIC, 0.1, Accuracy.REFERENCE, sample_rate_hz=50_000.0)
    p = run.states[:, 1] - run.states[:, 2]
    pressed = np.flatnonzero(np.abs(p) > specimen.gap_m)
    assert len(run.time_s) == 5001
    assert len(pressed) > 10 or contact == "power:3"
    for index in (*pressed[:5], 1234):
        there = integrate(specimen, PERIODIC, float(run.time_s[index]), Accuracy.REFERENCE)
        assert distance(there.final_state, run.states[index]) < 1e-8


def test_a_sampled_sine_converges_to_the_sine_with_order_four():
    specimen = paper()
    harmonic = integrate(specimen, PERIODIC, 0.25, Accuracy.REFERENCE)
    errors = []
    for rate in (2500.0, 5000.0, 10_000.0):
        time_s = np.arange(round(0.26 * rate)) / rate
        sine = PERIODIC.amplitude_m * np.sin(2.0 * np.pi * PERIODIC.frequency_hz * time_s)
        sampled = integrate(specimen, Sampled(sine, rate), 0.25, Accuracy.REFERENCE)
        assert sampled.impacts.count == harmonic.impacts.count
        errors.append(distance(sampled.final_state, harmonic.final_state))
    assert errors[-1] < 1e-6
    assert np.log2(errors[0] / errors[2]) / 2.0 > 3.5


@pytest.mark.thorough
def test_a_sweep_agrees_with_an_independent_integrator_within_its_stated_error():
    specimen, sweep = paper(), LinearSweep(80.0, 300.0, 0.05, 20e-6)
    ours = integrate(specimen, sweep, 0.03, Accuracy.REFERENCE)
    assert ours.impacts.count > 2
    assert distance(ours.final_state, as_written(specimen, sweep, 0.03)) < 3e-6
    turn = 2.0 * np.pi * sweep.highest_hz * sweep_interval_s(sweep, Accuracy.REFERENCE)
    assert turn**4 / HERMITE < 1e-11


@settings(max_examples=15, deadline=None)
@given(st.floats(60.0, 550.0), st.floats(1.5e-6, 10e-6))
def test_no_impact_of_a_finely_sampled_motion_is_missed(frequency_hz, amplitude_m):
    specimen = paper()
    run = integrate(specimen, Harmonic(frequency_hz, amplitude_m), 0.05, sample_rate_hz=1e6)
    pressed = np.abs(run.states[:, 1] - run.states[:, 2]) > specimen.gap_m
    onsets = run.time_s[1:][pressed[1:] & ~pressed[:-1]]
    for onset in onsets:
        assert np.min(np.abs(run.impacts.times_s - onset)) <= 1.1e-6
    assert run.impacts.count >= len(onsets)


def test_too_many_impacts_end_the_run_with_advice_on_what_to_change():
    run = integrate(paper(), PERIODIC, 30.0, max_impact_rate_hz=10.0)
    assert run.outcome is Outcome.TOO_MANY_IMPACTS
    assert run.end_time_s < 30.0
    assert run.impacts.count == 400
    assert "max_impact_rate_hz" in run.outcome.text
