"""Motions on the native engine: strict steps, mirrored and cut runs, samples, and how a run ends."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, Outcome, gong2025
from vibench.sim.engine.run import NativeRun, RunRecord

UNITS = np.repeat([1e-4, 0.1], 3)
"""Of an error: 100 um and 0.1 m/s."""
LAWS = (
    *("hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "rigid:0.2", "rigid:0", "linear"),
    *("power:5", "power:3+5+7", "power:47"),
)


def error_of(motion, expected):
    return float(np.max(np.abs(motion - expected) / UNITS))


def native(specimen, drive, duration_s, accuracy="standard", start=None, first_s=0.0, **words):
    motion = np.zeros(6) if start is None else start
    run = NativeRun(specimen, drive, motion, Accuracy(accuracy).tolerance, start_time_s=first_s)
    record = RunRecord(100_000, start_s=first_s, **words)
    return run, record, run.advance(first_s + duration_s, record)


@pytest.mark.parametrize("law", LAWS)
def test_standard_is_as_far_from_reference_as_it_promises(law):
    specimen, drive = gong2025(contact=law), Harmonic(130.0, 20e-6)
    quick, _, _ = native(specimen, drive, 1.0)
    exact, _, _ = native(specimen, drive, 1.0, "reference")
    assert error_of(quick.motion, exact.motion) < Accuracy.STANDARD.promise


@pytest.mark.parametrize("law", LAWS)
def test_random_scenes_end_where_strict_steps_do(law):
    draws = np.random.default_rng(45)
    for _ in range(12):
        gaps = tuple(float(gap) for gap in draws.uniform(15e-6, 80e-6, 2))
        if draws.random() < 0.2:
            gaps = (math.inf, gaps[1]) if draws.random() < 0.5 else (gaps[0], math.inf)
        specimen = gong2025(damping_time_s=10 ** draws.uniform(-6.0, -4.5), gap_m=gaps, contact=law)
        drive = Harmonic(draws.uniform(20.0, 700.0), 10 ** draws.uniform(-6.5, -4.0), draws.uniform(0.0, 6.0))
        start = draws.uniform(-1.0, 1.0, 6) * np.repeat([5e-6, 5e-3], 3)
        words = {"start": start, "first_s": draws.uniform(0.0, 100.0)}
        run, record, outcome = native(specimen, drive, 0.005, **words)
        strict, exact, _ = native(specimen, drive, 0.005, "reference", **words)
        assert outcome is Outcome.REACHED_END
        assert record.impacts == exact.impacts
        assert error_of(run.motion, strict.motion) < 1e-5


@pytest.mark.parametrize("law", LAWS)
def test_a_sample_is_where_a_run_that_ends_there_comes_to(law):
    specimen, drive = gong2025(contact=law), Harmonic(260.0, 5e-6)
    _, record, _ = native(specimen, drive, 0.02, "reference", sample_rate_hz=997.0, samples=20)
    for place in (3, 11, 19):
        ended, _, _ = native(specimen, drive, place / 997.0, "reference")
        assert error_of(record.samples[place], ended.motion) < 1e-8


@pytest.mark.parametrize("law", ["hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "power:5"])
def test_a_mirrored_start_moves_as_the_mirror_image(law):
    specimen, drive = gong2025(contact=law), Harmonic(120.0, 10e-6)
    depth = 0.0 if law.startswith("rigid") else 1e-7
    start = np.array([1e-6, 45e-6 + depth, 0.0, 0.01, 0.05, -0.02])
    run, _, _ = native(specimen, drive, 0.01, start=start)
    mirrored, _, _ = native(specimen, replace(drive, phase_rad=math.pi), 0.01, start=-start)
    assert error_of(mirrored.motion, -run.motion) < 1e-9


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


def test_changes_that_grow_beyond_all_numbers_are_kept_as_logarithms():
    run, record = NativeRun(gong2025(), Harmonic(260.0, 5e-6), np.zeros(6), 3e-7), RunRecord(100_000)
    run.carry(np.eye(6)[:1])
    assert run.advance(20.0, record) is Outcome.REACHED_END
    assert np.all(np.isfinite(run.changes))
    assert run.growth[0] > 0.0
