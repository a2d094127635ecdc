"""Runs of the native engine match strict steps for every law; growing perturbations do not overflow."""

import math

import numpy as np
import pytest

from tests.sim.as_written import distance
from vibench.sim import Accuracy, Harmonic, Outcome, gong2025
from vibench.sim.engine.run import NativeRun, RunRecord

LAWS = (
    *("hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "rigid:0.2", "rigid:0", "linear"),
    *("power:5", "power:3+5+7", "power:47"),
)


def native(specimen, drive, duration_s, accuracy="standard", start=None, first_s=0.0, **words):
    motion = np.zeros(6) if start is None else start
    run = NativeRun(specimen, drive, motion, Accuracy(accuracy).tolerance, start_time_s=first_s)
    record = RunRecord(100_000, start_s=first_s, **words)
    return run, record, run.advance(first_s + duration_s, record)


@pytest.mark.parametrize("law", LAWS)
def test_random_scenes_match_an_integration_with_strict_steps(law):
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
        assert distance(run.motion, strict.motion) < 1e-5


def test_overflowing_perturbations_are_stored_as_logarithms():
    run, record = NativeRun(gong2025(), Harmonic(260.0, 5e-6), np.zeros(6), 3e-7), RunRecord(100_000)
    run.carry(np.eye(6)[:1])
    assert run.advance(20.0, record) is Outcome.REACHED_END
    assert np.all(np.isfinite(run.changes))
    assert run.growth[0] > 0.0
