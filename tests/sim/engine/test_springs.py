"""Linear stops are integrated exactly at every accuracy level."""

import numpy as np
import pytest

from benchmarks.independent_solution import STATE_UNITS, independent_state, state_error
from vibench.sim import Accuracy, Harmonic, gong2025, integrate
from vibench.sim.scene.followed_run import FollowedRun

SCENES = [
    (Harmonic(130.0, 20e-6), 45e-6),
    (Harmonic(260.0, 5e-6), (20e-6, 60e-6)),
    (Harmonic(311.0, 40e-6, 0.7), (20e-6, 60e-6)),
]


def settled_run(drive, gap_m, time_s=0.5):
    specimen = gong2025(gap_m=gap_m, contact="linear_gap")
    run = FollowedRun(specimen, drive, Accuracy.QUICK.tolerance, np.zeros(6))
    run.follow(round(time_s * drive.frequency_hz) / drive.frequency_hz)
    return run


def growth(run, span_s, start):
    """Return the largest growth factor of eight small changes of the initial state, at least 1."""
    random, size = np.random.default_rng(1), 1e-9
    end = integrate(run.specimen, run.drive, span_s, Accuracy.REFERENCE, start).final_state
    most = 1.0
    for change in random.standard_normal((8, 6)):
        other = start + size * STATE_UNITS * change / np.abs(change).max()
        changed = integrate(run.specimen, run.drive, span_s, Accuracy.REFERENCE, other).final_state
        most = max(most, state_error(changed, end) / size)
    return most


@pytest.mark.timeout(600)
@pytest.mark.parametrize(("drive", "gap_m"), SCENES, ids=str)
@pytest.mark.parametrize("level", Accuracy)
def test_linear_stops_match_the_independent_solution_at_every_accuracy_level(drive, gap_m, level):
    run, span_s = settled_run(drive, gap_m), 3.0 / drive.frequency_hz
    start = run.motion
    truth = independent_state(run.specimen, drive, span_s, start)
    found = integrate(run.specimen, drive, span_s, level, start)
    assert found.impacts.count > 0
    # The independent solution errs by some 1e-12, which a chaotic motion amplifies.
    assert state_error(found.final_state, truth) < 1e-11 * growth(run, span_s, start)
