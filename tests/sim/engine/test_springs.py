"""Stops that are springs: flown exactly, whatever the accuracy that was asked for."""

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, gong2025, integrate
from vibench.sim.accuracy_benchmark.independent_solution import STATE_UNITS, independent_state, state_error
from vibench.sim.engine.run import Watch
from vibench.sim.scene.followed_run import FollowedRun, Samples

DRIVES = [Harmonic(130.0, 20e-6), Harmonic(260.0, 5e-6), Harmonic(311.0, 40e-6, 0.7)]
GAPS = [45e-6, (20e-6, 60e-6)]


def settled(drive, gap_m, time_s=0.5):
    specimen = gong2025(gap_m=gap_m, contact="linear_gap")
    run = FollowedRun(specimen, drive, Accuracy.QUICK.tolerance, np.zeros(6))
    run.follow(round(time_s * drive.frequency_hz) / drive.frequency_hz)
    return run


def growth(run, span_s, start):
    """How much of a small change of the start is there at the end: the most of eight changes; at least 1."""
    random, size = np.random.default_rng(1), 1e-9
    end = integrate(run.specimen, run.drive, span_s, Accuracy.REFERENCE, start).final_state
    most = 1.0
    for change in random.standard_normal((8, 6)):
        other = start + size * STATE_UNITS * change / np.abs(change).max()
        changed = integrate(run.specimen, run.drive, span_s, Accuracy.REFERENCE, other).final_state
        most = max(most, state_error(changed, end) / size)
    return most


@pytest.mark.timeout(600)
@pytest.mark.parametrize("gap_m", GAPS, ids=["even", "uneven"])
@pytest.mark.parametrize("drive", DRIVES, ids=str)
@pytest.mark.parametrize("level", Accuracy)
def test_it_is_the_independent_solution_at_every_level(drive, gap_m, level):
    run, span_s = settled(drive, gap_m), 3.0 / drive.frequency_hz
    start = run.state
    truth = independent_state(run.specimen, drive, span_s, start)
    found = integrate(run.specimen, drive, span_s, level, start)
    assert found.impacts.count > 0
    # The independent solution errs by some 1e-12, here and there, and a chaotic motion magnifies that.
    assert state_error(found.final_state, truth) < 1e-11 * growth(run, span_s, start)


def test_peaks_and_lines_are_those_of_close_samples_and_change_nothing():
    drive = DRIVES[2]
    run = settled(drive, GAPS[1])
    watched, sampled = run.apart(), run.apart()
    until_s, count = run.time_s + 4.0 / drive.frequency_hz, 80_000
    seen = watched.follow(until_s, Watch.PEAKS_AND_LINES)
    states = sampled.follow(
        until_s, samples=Samples(run.time_s, count * drive.frequency_hz / 4.0, count)
    ).states
    assert np.array_equal(watched.state, sampled.state)
    p = states[:, 1] - states[:, 2]
    assert np.abs(p).max() > max(GAPS[1]), "no contact was sampled"
    assert seen.peak_x_m == pytest.approx(np.abs(states[:, 0]).max(), rel=1e-6)
    assert np.abs(p).max() <= seen.peak_p_m < np.abs(p).max() * (1.0 + 1e-4)
    turned = np.exp(-1j * (2.0 * np.pi * 4.0 * np.arange(count) / count + drive.phase_rad))
    for area, motion in ((seen.area_x, states[:, 0]), (seen.area_p, p)):
        assert area == pytest.approx((motion * turned).mean() * 4.0 / drive.frequency_hz, rel=2e-4)


def test_a_run_that_begins_and_ends_within_contacts_is_that_in_one():
    drive = DRIVES[0]
    specimen = gong2025(contact="linear_gap")
    whole = settled(drive, GAPS[0])
    begun_s = whole.time_s
    stretch = whole.apart().follow(begun_s + 0.02, samples=Samples(begun_s, 4e5, 8000))
    p = stretch.states[:, 1] - stretch.states[:, 2]
    (inside,) = np.flatnonzero(np.abs(p) > specimen.gap_m)[[3]]
    cut = whole.apart()
    cut.follow(begun_s + inside / 4e5)
    at = cut.state
    assert abs(at[1] - at[2]) > specimen.gap_m
    anew = FollowedRun(specimen, drive, Accuracy.STANDARD.tolerance, at, cut.time_s)
    ends = []
    for run in (whole, cut, anew):
        run.follow(begun_s + 0.02)
        ends.append(run.state)
    assert state_error(ends[1], ends[0]) < 1e-9
    assert state_error(ends[2], ends[0]) < 1e-9


def test_a_small_change_is_carried_as_the_difference_of_two_runs():
    drive = DRIVES[0]
    run = settled(drive, GAPS[1])
    until_s = run.time_s + 2.3 / drive.frequency_hz
    run.follow_tangent()
    begins, change = run.state, run._run.changes[0]
    step = 1e-6 / np.linalg.norm(change / run._scales)
    ends = []
    for sign in (1.0, -1.0):
        other = FollowedRun(run.specimen, drive, 1e-7, begins + sign * step * change, run.time_s)
        other.follow(until_s)
        ends.append(other.state)
    run.follow(until_s)
    carried = np.exp(run._run.growth[0]) * run._run.changes[0]
    difference = (ends[0] - ends[1]) / (2.0 * step)
    off = np.linalg.norm((carried - difference) / run._scales)
    assert off < 1e-4 * np.linalg.norm(carried / run._scales)
