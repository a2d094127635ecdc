"""Extreme parameters give a correct result or a refusal in one sentence, and never hang or give NaN."""

import math
import signal
import time
from dataclasses import replace

import numpy as np
import pytest

from tests.sim.as_written import as_written, distance, paper, stored_energy
from vibench.sim import (
    Accuracy,
    Harmonic,
    Hertz,
    HuntCrossley,
    LinearGap,
    LinearSweep,
    Outcome,
    RigidStops,
    Sampled,
    base_transmissibility,
    gong2025,
    integrate,
    lyapunov_exponent,
    lyapunov_spectrum,
    steady_response,
)
from vibench.sim.chain import band_frequencies_hz, chain_of, integrate_chain
from vibench.sim.scene.shares import wilson_share

pytestmark = pytest.mark.timeout(300)
"""A hang is a failure: the first test compiles, the others take milliseconds."""

STOPS = ["hertz", "linear_gap", "hunt_crossley:1", "rigid:0", "rigid:0.8", "rigid:1"]
SPRINGY = ["hertz", "linear_gap", "hunt_crossley:1"]
POWERS = ["power:3", "power:47", "power:201"]
LAWS = [*STOPS, *POWERS]
DRIVE = Harmonic(130.0, 20e-6)


def steady_start(specimen, drive):
    """Return the state at time zero of the steady motion without contact."""
    moved = -1j * drive.amplitude_m * base_transmissibility(specimen, drive.frequency_hz)[0, :3]
    return np.concatenate([moved, 2j * math.pi * drive.frequency_hz * moved]).real


def motion(specimen, drive, duration_s):
    run = integrate(specimen, drive, duration_s, sample_rate_hz=1000.0 / duration_s)
    assert run.outcome is Outcome.REACHED_END
    assert np.all(np.isfinite(run.states))
    assert np.all(np.diff(run.impacts.times_s) >= 0.0)
    return run


@pytest.mark.thorough
@pytest.mark.parametrize("contact", LAWS)
@pytest.mark.parametrize(
    ("drive", "duration_s"),
    [
        (Harmonic(0.01, 1e-2), 100.0),
        (Harmonic(50e3, 1e-2), 0.05),
        (Harmonic(130.0, 1e-2), 0.1),
        (Harmonic(1e9, 1e-3), 1e-6),
        (Harmonic(1e-6, 1.0), 1.0),
        (LinearSweep(0.01, 50e3, 0.05, 1e-5), 0.05),
    ],
)
def test_every_drive_is_integrated_to_its_end(contact, drive, duration_s):
    run = motion(paper(contact), drive, duration_s)
    p = np.abs(run.states[:, 1] - run.states[:, 2])
    # Even 10 mm of base motion compress a stop by less than 200 um.
    assert p.max() < 200e-6


@pytest.mark.parametrize("contact", LAWS)
@pytest.mark.parametrize("frequency_hz", [0.01, 130.0, 50e3])
def test_a_drive_of_one_picometre_gives_the_transmissibility(contact, frequency_hz):
    specimen, drive = paper(contact), Harmonic(frequency_hz, 1e-12)
    window_s = max(0.1, 1.0 / frequency_hz)
    start = steady_start(specimen, drive)
    response = steady_response(specimen, drive, duration_s=window_s, window_s=window_s, initial_state=start)
    expected = abs(base_transmissibility(specimen, frequency_hz)[0])
    assert response.impacts == response.impacts_before == 0
    assert response.response_ii == pytest.approx(expected[0], rel=1e-6)
    # At 0.01 Hz p is about 1e-8 x, and a power law has an accuracy of 1e-6 in x.
    assert response.relative_ii == pytest.approx(expected[3], rel=1e-5, abs=1e-11)


@pytest.mark.parametrize("contact", SPRINGY)
def test_the_smallest_gaps_agree_with_direct_integration(contact):
    specimen = paper(contact, gap_m=1e-12)
    ours = integrate(specimen, DRIVE, 0.003, Accuracy.REFERENCE)
    assert ours.outcome is Outcome.REACHED_END
    assert ours.impacts.count > 1
    assert distance(ours.final_state, as_written(specimen, DRIVE, 0.003, longest_step_s=2e-6)) < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("contact", [*SPRINGY, *POWERS])
@pytest.mark.parametrize("drive", [Harmonic(130.0, 1e-2), Harmonic(50e3, 1e-2)])
def test_motions_under_very_large_drives_agree_with_direct_integration(contact, drive):
    specimen, duration_s = paper(contact), 0.0015
    ours = integrate(specimen, drive, duration_s, Accuracy.REFERENCE)
    theirs = as_written(specimen, drive, duration_s, longest_step_s=1e-6)
    assert distance(ours.final_state, theirs) < 1e-6 * max(1.0, distance(theirs, 0.0))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
@pytest.mark.parametrize("contact", SPRINGY)
def test_any_contact_stiffness_is_solved_within_its_accuracy(contact, factor):
    law = paper(contact).contact
    specimen = replace(paper(contact), contact=replace(law, stiffness=factor * law.stiffness))
    finals = [integrate(specimen, DRIVE, 0.02, level).final_state for level in Accuracy]
    assert distance(finals[0], finals[2]) < 1e-2
    assert distance(finals[1], finals[2]) < 1e-4
    if factor <= 1.0:
        assert distance(finals[2], as_written(specimen, DRIVE, 0.02)) < 1e-6


def with_scaled_mass(specimen, place, factor):
    masses = list(specimen.masses)
    masses[place] *= factor
    return replace(specimen, masses=tuple(masses))


@pytest.mark.thorough
@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("factor", [1e-6, 1e6])
@pytest.mark.parametrize(
    "contact", ["hertz", *(pytest.param(law, marks=pytest.mark.slow) for law in SPRINGY[1:])]
)
def test_mass_ratios_of_a_million_agree_with_direct_integration(contact, factor, place):
    specimen = with_scaled_mass(paper(contact, gap_m=1e-6), place, factor)
    start = [0.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    if (factor, place) == (1e-6, 1):
        # The damper stops such a light m1 at once, so it starts on the stop.
        start[1] = 1e-6
    ours = integrate(specimen, DRIVE, 1e-4, Accuracy.REFERENCE, start)
    assert ours.outcome is Outcome.REACHED_END
    assert ours.impacts.count > 0
    assert distance(ours.final_state, as_written(specimen, DRIVE, 1e-4, start, 1e-6)) < 1e-6


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("factor", [1e-6, 1e6])
@pytest.mark.parametrize("contact", ["rigid:0", "rigid:0.8", "rigid:1", "power:47"])
def test_mass_ratios_of_a_million_with_other_contact_laws_agree_between_accuracies(contact, factor, place):
    specimen = with_scaled_mass(paper(contact, gap_m=5e-6), place, factor)
    drive = Harmonic(430.0, 50e-6)
    finals = [
        integrate(specimen, drive, 0.002, level, max_impact_rate_hz=1e7).final_state for level in Accuracy
    ]
    assert distance(finals[1], finals[2]) < 1e-4 * max(1.0, distance(finals[2], 0.0))


@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "hunt_crossley:1", "rigid:0.8", "rigid:1"])
@pytest.mark.parametrize("frequency_hz", [60.0, 130.0, 300.0])
def test_only_motion_beyond_grazing_strikes_the_stop(contact, frequency_hz):
    specimen = paper(contact)
    path = base_transmissibility(specimen, frequency_hz)[0, 3]
    omega = 2.0 * math.pi * frequency_hz
    # Time of the first extreme of p = Re(-i A0 path exp(i omega t)).
    peak = ((0.5 * math.pi - np.angle(path)) % math.pi) / omega
    for margin, strikes in ((-1e-11, 0), (1e-11, 1)):
        drive = Harmonic(frequency_hz, specimen.gap_m / abs(path) * (1.0 + margin))
        start = steady_start(specimen, drive)
        run = integrate(specimen, drive, peak + 0.1 / frequency_hz, initial_state=start)
        assert run.impacts.count == strikes
        # Near its extreme p is a parabola, which gives the time of the impact before the extreme.
        if strikes:
            assert peak - run.impacts.times_s[0] == pytest.approx(math.sqrt(2.0 * margin) / omega, rel=0.1)


def accelerated_specimen(contact, acceleration):
    """Return a specimen at rest in a constantly accelerated frame, m1 just touching its lower stop."""
    specimen, rate = paper(contact, damping_time_s=2e-4), 10_000.0
    time_s = np.arange(6001) / rate
    base = Sampled(0.5 * acceleration * time_s**2, rate)
    (m0, m1, m2), (k0, _, k2) = specimen.masses, specimen.stiffnesses
    x = -(m0 + m1 + m2) * acceleration / k0
    z = x - (m1 + m2) * acceleration / k2
    return specimen, base, np.array([x, z - specimen.gap_m, z, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("contact", SPRINGY)
def test_a_pressed_contact_settles_at_its_static_indentation(contact):
    acceleration = 20.0
    specimen, base, start = accelerated_specimen(contact, acceleration)
    run = integrate(specimen, base, 0.6, Accuracy.REFERENCE, start)
    left = specimen.masses[1] * acceleration - specimen.stiffnesses[1] * specimen.gap_m
    exponent = 1.0 if contact == "linear_gap" else 1.5
    pressed = (left / specimen.contact.stiffness) ** (1.0 / exponent)
    p = run.final_state[1] - run.final_state[2]
    assert run.outcome is Outcome.REACHED_END
    assert -p - specimen.gap_m == pytest.approx(pressed, rel=2e-3)
    assert abs(run.final_state[4] - run.final_state[5]) < 1e-6


@pytest.mark.parametrize("duration_s", [10.0, pytest.param(1000.0, marks=pytest.mark.slow)])
def test_any_number_of_elastic_impacts_on_rigid_stops_conserves_energy(duration_s):
    specimen = gong2025(damping_time_s=0.0, contact="rigid:1")
    start = np.array([2e-5, 0.0, -4e-5, 0.5, 0.25, -0.9])
    run = integrate(
        specimen, Harmonic(100.0, 0.0), duration_s, initial_state=start, sample_rate_hz=1000.0 / duration_s
    )
    assert run.impacts.count > 1000 * duration_s
    energy = stored_energy(specimen, run.states)
    # One rounding error per impact.
    np.testing.assert_allclose(energy, energy[0], rtol=2e-15 * run.impacts.count)


@pytest.mark.parametrize(
    ("contact", "size"),
    [*((contact, size) for contact in STOPS for size in (1e20, 1e100, 1e200, 1e300)), ("power:47", 1e200)],
)
def test_overflowing_motions_end_with_an_outcome(contact, size, monkeypatch):
    monkeypatch.setattr("vibench.sim.specimen.drive.LARGEST_AMPLITUDE_M", 1e100)
    samples = np.sin(np.arange(200) * 0.01) * size
    runs = [
        integrate(paper(contact), Harmonic(130.0, min(size, 1e100)), 0.001),
        integrate(paper(contact), DRIVE, 0.001, initial_state=[0.0, 0.0, 0.0, size, size, 0.5 * size]),
        integrate(paper(contact), Sampled(samples, 1e4), 0.001),
    ]
    for run in runs:
        assert run.outcome is not Outcome.REACHED_END or np.all(np.isfinite(run.final_state))
        assert run.outcome.text


@pytest.mark.parametrize("contact", [*LAWS, "linear"])
def test_a_run_with_too_many_steps_ends_with_advice(contact, monkeypatch):
    monkeypatch.setattr("vibench.sim.engine.run.MOST_STEPS", 1_000_000)
    specimen = paper(contact)
    assert integrate(specimen, DRIVE, 1.0).outcome is Outcome.REACHED_END
    run = integrate(specimen, DRIVE, 1000.0)
    assert run.outcome is Outcome.TOO_LONG
    assert "simulate less time" in run.outcome.text
    assert 1.0 < run.end_time_s < 1000.0


REFUSED = [
    (lambda: gong2025(gap_m=0.0), "Gap 0.0 m is not allowed"),
    (lambda: gong2025(gap_m=math.nan), "Gap nan m is not allowed"),
    (lambda: gong2025(gap_m=(math.inf, math.inf)), "Gap .* is not allowed"),
    (lambda: gong2025(gap_m=(1e-6,)), r"Gap \(1e-06,\) m is not allowed: give one clearance, or"),
    (lambda: gong2025(gap_m=(1e-6, 2e-6, 3e-6)), "give one clearance, or"),
    (lambda: gong2025(damping_time_s=-1e-5), "Damping time -1e-05 s is not allowed"),
    (lambda: replace(gong2025(), masses=(1.0, -1.0, 1.0)), "mass m1 = -1.0 kg is not allowed"),
    (lambda: replace(gong2025(), masses=(1.0, 1.0, math.nan)), "mass m2 = nan kg is not allowed"),
    (lambda: replace(gong2025(), stiffnesses=(math.inf, 1.0, 1.0)), "stiffness k0 = inf N/m is not allowed"),
    (lambda: replace(gong2025(), dampings=(0.0, math.nan, 0.0)), "Damping c1 = nan N s/m is not allowed"),
    (lambda: RigidStops(math.nan), "Restitution nan is not allowed"),
    (lambda: RigidStops(1.0 + 1e-12), "Restitution 1.000000000001 is not allowed"),
    (lambda: Hertz(0.0), "Contact stiffness 0.0 N/m.* is not allowed"),
    (lambda: LinearGap(math.inf), "Stop stiffness inf N/m is not allowed"),
    (lambda: HuntCrossley(1e9, -1.0), "Contact loss -1.0 s/m is not allowed"),
    (lambda: Harmonic(0.0, 1e-6), "Drive frequency 0.0 Hz is not allowed"),
    (lambda: Harmonic(1e300, 1e-6), r"frequency 1e\+300 Hz is not allowed: it must lie between 1e-12 and"),
    (lambda: LinearSweep(1e-300, 1.0, 1.0, 1e-6), "Sweep start 1e-300 Hz is not allowed"),
    (lambda: Harmonic(100.0, math.nan), "nan m is not allowed"),
    (lambda: Sampled(np.array([]), 1e3), r"shape \(0,\) is not allowed"),
    (lambda: Sampled(1e3, np.zeros(10)), r"shape \(\) is not allowed"),
    (lambda: Sampled(np.array([0.0, math.inf, 0.0, 0.0]), 1e3), "Sample 1 of the drive is inf"),
    (lambda: Harmonic(math.nan, 1e-6), "Drive frequency nan Hz is not allowed"),
    (lambda: steady_response(gong2025(), Harmonic(100.0, 0.0)), "A response over a drive amplitude of 0 m"),
    (lambda: steady_response(gong2025(), DRIVE, duration_s=math.inf), "Duration inf s is not allowed"),
    (lambda: steady_response(gong2025(), Harmonic(0.01, 1e-6)), "it must contain one drive period, 100.0 s"),
    (lambda: steady_response(gong2025(), DRIVE, window_s=31.0), r"Window 31\.0 s is not allowed"),
    (lambda: integrate(gong2025(), DRIVE, math.nan), "Duration nan s is not allowed"),
    (lambda: integrate(gong2025(), DRIVE, 1.0, sample_rate_hz=0.0), r"Sample rate 0\.0 Hz is not allowed"),
    (
        lambda: integrate(gong2025(), LinearSweep(50.0, 100.0, 1.0, 1e-6), 2.0),
        r"ends at 2\.0 s, the drive at 1",
    ),
    (lambda: integrate(gong2025(), DRIVE, 1.0, start_time_s=1e300), r"Start time 1e\+300 s is not allowed"),
    (lambda: integrate(gong2025(), DRIVE, 1.0, sample_rate_hz=1e300), r"1e\+300 samples are not allowed"),
    (lambda: integrate(gong2025(), DRIVE, 1.0, max_impact_rate_hz=math.nan), "Impact rate nan Hz"),
    (lambda: steady_response(gong2025(), DRIVE, max_impact_rate_hz=-1.0), "Impact rate -1.0 Hz"),
    (lambda: lyapunov_exponent(gong2025(), DRIVE, max_impact_rate_hz=-1.0), "Impact rate -1.0 Hz"),
    (lambda: wilson_share(0, 0), "0 of 0 trials.* are not allowed"),
    (lambda: wilson_share(11, 10), "11 of 10 trials.* are not allowed"),
    (lambda: wilson_share(1, 10, 2.0), "with an error probability of 2.0 are not allowed"),
    (lambda: band_frequencies_hz(chain_of(gong2025(), 2), [math.nan]), "A wave number that is not finite"),
    (lambda: integrate(gong2025(), DRIVE, 1.0, initial_state=[math.nan] * 6), "give six finite numbers"),
]


@pytest.mark.parametrize(("ask", "sentence"), REFUSED)
def test_impossible_scenes_are_refused_with_a_readable_message(ask, sentence):
    with pytest.raises(ValueError, match=sentence):
        ask()


@pytest.mark.thorough
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers of processor time")
@pytest.mark.parametrize(
    "long_run",
    [
        lambda: integrate(gong2025(), Harmonic(430.0, 50e-6), 1000.0),
        lambda: integrate_chain(chain_of(gong2025(damping_time_s=1.0), 8), Harmonic(220.0, 2e-5), 1.0),
        lambda: lyapunov_spectrum(gong2025(), Harmonic(430.0, 50e-6), "reference", 1000.0),
    ],
    ids=["specimen", "chain", "exponents"],
)
def test_a_signal_such_as_ctrl_c_ends_a_long_run_within_seconds(long_run):
    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGVTALRM, interrupt)
    began_s = time.process_time()
    try:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.5)
        with pytest.raises(KeyboardInterrupt):
            long_run()
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
    assert time.process_time() - began_s < 10.0
