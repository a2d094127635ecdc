"""The native engine against the compiled kernels that it will replace: the same motions, for every law."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, integrate
from vibench.sim.engine import NativeRun, RunRecord

UNITS = np.repeat([1e-4, 0.1], 3)
"""Of an error: 100 um and 0.1 m/s."""
LAWS = (
    "hertz",
    "hunt_crossley:0.5",
    "linear_gap",
    "rigid:0.8",
    "rigid:0.2",
    "rigid:0",
    "linear",
    "power:5",
    "power:47",
)
DRIVES = [(130.0, 20e-6, 0.3), (100.0, 5e-6, 0.3), (260.0, 5e-6, 0.05), (300.0, 50e-6, 0.012)]


def error_of(motion, expected):
    return float(np.max(np.abs(motion - expected) / UNITS))


def native(specimen, drive, duration_s, accuracy="standard", start=None, first_s=0.0, **words):
    motion = np.zeros(6) if start is None else start
    run = NativeRun(specimen, drive, motion, Accuracy(accuracy).tolerance, start_time_s=first_s)
    record = RunRecord(100_000, start_s=first_s, **words)
    return run, record, run.advance(first_s + duration_s, record)


@pytest.mark.parametrize("accuracy", ["standard", "reference"])
@pytest.mark.parametrize("law", LAWS)
def test_both_engines_follow_the_same_motion(law, accuracy):
    specimen = gong2025(contact=law)
    for frequency_hz, amplitude_m, duration_s in DRIVES:
        drive = Harmonic(frequency_hz, amplitude_m)
        run, record, outcome = native(specimen, drive, duration_s, accuracy)
        old = integrate(specimen, drive, duration_s, accuracy)
        assert outcome is old.outcome is Outcome.REACHED_END
        # Rounding, grown by chaos at 260 and 300 Hz.
        assert error_of(run.motion, old.final_state) < 1e-10
        assert np.abs(record.impact_times_s - old.impacts.times_s).max(initial=0.0) < 1e-11


@pytest.mark.parametrize("law", LAWS)
def test_standard_is_as_far_from_reference_as_it_promises(law):
    specimen, drive = gong2025(contact=law), Harmonic(130.0, 20e-6)
    quick, _, _ = native(specimen, drive, 1.0)
    exact = integrate(specimen, drive, 1.0, "reference")
    assert error_of(quick.motion, exact.final_state) < Accuracy.STANDARD.promise


@pytest.mark.parametrize("law", LAWS)
def test_random_scenes_agree(law):
    draws = np.random.default_rng(45)
    for _ in range(12):
        gaps = tuple(float(gap) for gap in draws.uniform(15e-6, 80e-6, 2))
        if draws.random() < 0.2:
            gaps = (math.inf, gaps[1]) if draws.random() < 0.5 else (gaps[0], math.inf)
        specimen = gong2025(damping_time_s=10 ** draws.uniform(-6.0, -4.5), gap_m=gaps, contact=law)
        drive = Harmonic(draws.uniform(20.0, 700.0), 10 ** draws.uniform(-6.5, -4.0), draws.uniform(0.0, 6.0))
        start = draws.uniform(-1.0, 1.0, 6) * np.repeat([5e-6, 5e-3], 3)
        first_s = draws.uniform(0.0, 100.0)
        words = {"start": start, "first_s": first_s, "sample_rate_hz": 20e3, "samples": 101}
        run, record, outcome = native(specimen, drive, 0.005, **words)
        old = integrate(specimen, drive, 0.005, "standard", start, 20e3, start_time_s=first_s)
        assert outcome is old.outcome
        assert record.impacts == old.impacts.count
        assert error_of(run.motion, old.final_state) < 1e-8
        kept = min(len(record.samples), len(old.states))
        assert kept >= 100
        assert error_of(record.samples[:kept], old.states[:kept]) < 1e-8


@pytest.mark.parametrize("law", ["hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8"])
def test_a_start_in_contact_and_a_mirrored_start_agree(law):
    specimen, drive = gong2025(contact=law), Harmonic(120.0, 10e-6)
    depth = 0.0 if law.startswith("rigid") else 1e-7
    start = np.array([1e-6, 45e-6 + depth, 0.0, 0.01, 0.05, -0.02])
    run, _, _ = native(specimen, drive, 0.01, start=start)
    old = integrate(specimen, drive, 0.01, "standard", start)
    assert error_of(run.motion, old.final_state) < 1e-9
    mirrored, _, _ = native(specimen, replace(drive, phase_rad=math.pi), 0.01, start=-start)
    assert error_of(mirrored.motion, -run.motion) < 1e-9


def test_beyond_critical_damping_both_engines_agree():
    specimen, drive = gong2025(damping_time_s=2e-3), Harmonic(40.0, 60e-6)
    run, _, _ = native(specimen, drive, 0.2)
    assert error_of(run.motion, integrate(specimen, drive, 0.2).final_state) < 1e-10


def test_a_run_cut_into_pieces_ends_where_the_whole_one_does():
    specimen, drive = gong2025(), Harmonic(130.0, 20e-6)
    whole, _, _ = native(specimen, drive, 0.1)
    run, record = NativeRun(specimen, drive, np.zeros(6), Accuracy.STANDARD.tolerance), RunRecord(1000)
    for until_s in np.linspace(0.0, 0.1, 38)[1:]:
        assert run.advance(float(until_s), record) is Outcome.REACHED_END
    # Contacts cut in their midst are resolved in steps, the others as a whole: within the promise, not equal.
    assert error_of(run.motion, whole.motion) < Accuracy.STANDARD.promise
    assert run.time_s == 0.1


def test_a_run_ends_when_the_room_for_impacts_is_full():
    run, record = NativeRun(gong2025(), Harmonic(130.0, 20e-6), np.zeros(6), 3e-7), RunRecord(3)
    assert run.advance(1.0, record) is Outcome.TOO_MANY_IMPACTS
    assert record.impacts == 3
