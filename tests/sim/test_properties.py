"""Properties of motions for every contact law: symmetry, scaling, and independence of how they are run."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import given, settings, strategies as st

from tests.sim.as_written import paper
from vibench.sim import (
    Accuracy,
    Harmonic,
    Hertz,
    HuntCrossley,
    LinearGap,
    LinearSweep,
    LogarithmicSweep,
    Outcome,
    PowerLaw,
    Sampled,
    integrate,
)

LAWS = ["hertz", "linear_gap", "hunt_crossley:0.5", "power:5", "power:29", "rigid:0", "rigid:0.7", "rigid:1"]
DRIVE = Harmonic(170.0, 20e-6)
DURATION_S = 0.015
"""Duration that includes the first impacts, but is too short for chaos to make rounding errors large."""
LIMITS = 1e-6 * np.repeat([1e-4, 0.1], 3)
"""Allowed difference of two states at reference accuracy: a millionth of 100 um and of 0.1 m/s."""

laws = st.sampled_from(LAWS)
places = st.tuples(*[st.floats(-20e-6, 20e-6)] * 3)
speeds = st.tuples(*[st.floats(-0.2, 0.2)] * 3)


def end_state(specimen, drive=DRIVE, duration_s=DURATION_S, start=None):
    run = integrate(specimen, drive, duration_s, Accuracy.REFERENCE, start)
    assert run.outcome is Outcome.REACHED_END
    assert run.impacts.count > 5 or isinstance(specimen.contact, PowerLaw)
    return run.final_state


def noise(seed, rate=20_000.0, duration_s=0.03):
    """Return a band-limited random displacement of about 20 um."""
    coarse = np.random.default_rng(seed).normal(0.0, 20e-6, round(duration_s * 1000) + 2)
    time_s = np.arange(round(duration_s * rate))
    return Sampled(np.interp(time_s, np.arange(len(coarse)) * rate / 1000.0, coarse), rate)


@settings(max_examples=60, deadline=None)
@given(
    contact=laws,
    place=places,
    gap_m=st.floats(41e-6, 60e-6),
    is_upper=st.booleans(),
    drive=st.sampled_from([Harmonic(40.0, 2e-3), Harmonic(170.0, 50e-6), Harmonic(430.0, 1e-4)]),
)
def test_a_stop_that_is_not_reached_has_no_effect(contact, place, gap_m, is_upper, drive):
    """Without an upper stop, p once passed through the lower stop while moving upwards."""
    far, none = ((gap, gap_m) if is_upper else (gap_m, gap) for gap in (1.0, math.inf))
    start = np.array([*place, 0.0, 0.0, 0.0])
    ends = []
    for lower, upper in (far, none):
        specimen = replace(paper(contact), gap_m=upper, lower_gap_m=lower)
        run = integrate(specimen, drive, 0.05, Accuracy.REFERENCE, start, sample_rate_hz=1e5)
        ends.append((run.impacts.count, *run.final_state))
        if contact.startswith("rigid"):
            p = run.states[:, 1] - run.states[:, 2]
            assert max(p.max() - upper, -p.min() - lower) < 1e-15
    assert ends[0][0] == ends[1][0]
    assert np.all(np.abs(np.subtract(*ends))[1:] < LIMITS)


@settings(max_examples=20, deadline=None)
@given(contact=laws, place=places, speed=speeds, seed=st.integers(0, 1000))
def test_a_mirrored_drive_and_initial_state_mirror_the_motion_bit_for_bit(contact, place, speed, seed):
    start, drive, still = np.array([*place, *speed]), noise(seed), Harmonic(100.0, 0.0)
    mirrored = Sampled(-drive.displacement_m, drive.sample_rate_hz)
    for one, other, duration_s in ((drive, mirrored, 0.02), (still, still, 0.05)):
        here = integrate(paper(contact), one, duration_s, initial_state=start, sample_rate_hz=5e3)
        there = integrate(paper(contact), other, duration_s, initial_state=-start, sample_rate_hz=5e3)
        np.testing.assert_array_equal(here.states, -there.states)
        np.testing.assert_array_equal(here.impacts.times_s, there.impacts.times_s)


def scaled_specimen(specimen, length, time, mass):
    """Return the specimen with all lengths, times and masses multiplied by these factors."""
    stiffness, damping, force = mass / time**2, mass / time, mass * length / time**2
    match specimen.contact:
        case Hertz(stiffness=contact):
            law = Hertz(contact * stiffness / math.sqrt(length))
        case LinearGap(stiffness=contact):
            law = LinearGap(contact * stiffness)
        case HuntCrossley(stiffness=contact, loss=loss):
            law = HuntCrossley(contact * stiffness / math.sqrt(length), loss * time / length)
        case PowerLaw(reference=reference, terms=terms):
            law = PowerLaw(reference * length, tuple((n, each * force) for n, each in terms))
        case law:
            pass
    return replace(
        specimen,
        masses=tuple(m * mass for m in specimen.masses),
        stiffnesses=tuple(k * stiffness for k in specimen.stiffnesses),
        dampings=tuple(c * damping for c in specimen.dampings),
        gap_m=specimen.gap_m * length,
        contact=law,
    )


@settings(max_examples=60, deadline=None)
@given(
    contact=laws,
    length=st.floats(-4.0, 4.0).map(lambda power: 10.0**power),
    time=st.floats(-3.0, 3.0).map(lambda power: 10.0**power),
    mass=st.floats(-6.0, 6.0).map(lambda power: 10.0**power),
)
def test_a_motion_scales_with_the_units_of_length_and_time_and_mass(contact, length, time, mass):
    specimen = paper(contact)
    scaled = scaled_specimen(specimen, length, time, mass)
    drive = Harmonic(DRIVE.frequency_hz / time, DRIVE.amplitude_m * length)
    end = end_state(scaled, drive, DURATION_S * time) / length
    end[3:] *= time
    assert np.all(np.abs(end - end_state(specimen)) < LIMITS)


@settings(max_examples=20, deadline=None)
@given(contact=laws, rate=st.floats(10.0, 3e5))
def test_the_output_sampling_rate_does_not_change_the_motion(contact, rate):
    for drive in (DRIVE, LinearSweep(150.0, 250.0, 0.1, 30e-6)):
        plain = integrate(paper(contact), drive, 0.1)
        sampled = integrate(paper(contact), drive, 0.1, sample_rate_hz=rate)
        np.testing.assert_array_equal(sampled.final_state, plain.final_state)
        np.testing.assert_array_equal(sampled.impacts.times_s, plain.impacts.times_s)


@settings(max_examples=20, deadline=None)
@given(contact=laws, cuts=st.lists(st.floats(0.0, 0.1), min_size=1, max_size=6))
def test_a_run_split_at_any_time_ends_in_the_same_state(contact, cuts):
    # The motion is not chaotic, since every split of a run adds a rounding error.
    specimen = paper(contact, damping_time_s=1e-4)
    for drive in (Harmonic(95.0, 8e-6), LogarithmicSweep(90.0, 110.0, 0.1, 8e-6)):
        whole, motion, now = integrate(specimen, drive, 0.1, Accuracy.REFERENCE), None, 0.0
        for until in (*sorted(cuts), 0.1):
            part = integrate(specimen, drive, until - now, Accuracy.REFERENCE, motion, start_time_s=now)
            motion, now = part.final_state, until
        assert np.all(np.abs(motion - whole.final_state) < LIMITS)
