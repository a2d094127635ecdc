"""Runs on a piecewise cubic base: exact without contact, independent of intervals, refused if invalid."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from tests.sim.as_written import UNITS
from vibench.sim import Accuracy, Outcome, gong2025
from vibench.sim.engine.run import CubicRun, RunRecord
from vibench.sim.specimen.modes import state_matrix

LAWS = (
    *("hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "rigid:0.2", "linear"),
    *("power:5", "power:3+5+7", "power:47"),
)


def sine_pieces(frequency_hz, amplitude_m, duration_s, interval_s):
    time_s = np.arange(round(duration_s / interval_s) + 1) * interval_s
    spline = CubicSpline(time_s, amplitude_m * np.sin(2.0 * np.pi * frequency_hz * time_s))
    return np.ascontiguousarray(spline.c[::-1].T)


def advance(specimen, pieces, interval_s, accuracy=Accuracy.STANDARD, start=(0.0,) * 6):
    run, record = CubicRun(specimen, interval_s, start, accuracy.tolerance), RunRecord(100_000)
    assert run.advance(np.atleast_2d(pieces), record) is Outcome.REACHED_END
    return run, record


def exact_linear(specimen, motion, base, duration_s):
    """Return the motion without contact under a cubic base motion, by an augmented matrix exponential."""
    system, entry = state_matrix(specimen)
    stiffness, damping = specimen.stiffnesses[0], specimen.dampings[0]
    force = stiffness * base + damping * np.append(base[1:] * [1.0, 2.0, 3.0], 0.0)
    joint = np.zeros((10, 10))
    joint[:6, :6] = system * duration_s
    joint[:6, 6:] = np.outer(entry, duration_s * duration_s ** np.arange(4) * force)
    for power in range(1, 4):
        joint[6 + power, 5 + power] = power
    return (expm(joint) @ np.concatenate([motion, [1.0, 0.0, 0.0, 0.0]]))[:6]


@pytest.mark.parametrize("interval_s", [1e-6, 1e-5, 1.7e-4, 2e-3])
@pytest.mark.parametrize("contact", ["linear", "hertz", "power:201"])
def test_an_interval_without_contact_is_exact(interval_s, contact):
    # Stops at 1 m are never reached, and a power law with this reference is negligible.
    specimen = gong2025(contact=contact, gap_m=1.0)
    motion = np.array([3e-5, -2e-5, 1e-5, 0.02, -0.05, 0.03])
    base = np.array([1e-5, 0.01, 5.0 / interval_s**0.5, -1e-6 / interval_s**3])
    run, record = advance(specimen, base, interval_s, start=motion)
    assert record.impacts == 0
    expected = exact_linear(specimen, motion, base, interval_s)
    for part in (slice(0, 3), slice(3, 6)):
        error = np.abs(run.motion[part] - expected[part]).max()
        assert error < 1e-12 * np.abs(expected[part]).max()


@pytest.mark.parametrize("contact", LAWS)
def test_a_motion_does_not_depend_on_the_division_of_the_base_motion_into_intervals(contact):
    specimen, speed, reached = gong2025(damping_time_s=3e-5, contact=contact), 0.3, []
    for intervals in (1, 7, 64):
        length = 2e-3 / intervals
        pieces = [[speed * length * index, speed, 0.0, 0.0] for index in range(intervals)]
        reached.append(advance(specimen, pieces, length, Accuracy.REFERENCE))
    for run, record in reached[1:]:
        assert record.impacts == reached[0][1].impacts
        assert np.max(np.abs(run.motion - reached[0][0].motion) / UNITS) < 1e-8


@pytest.mark.parametrize("contact", LAWS)
def test_a_run_split_between_intervals_equals_the_whole_run_bit_for_bit(contact):
    specimen, pieces = gong2025(contact=contact), sine_pieces(130.0, 40e-6, 0.05, 2e-5)
    whole, record = advance(specimen, pieces, 2e-5)
    run, parts = CubicRun(specimen, 2e-5, np.zeros(6), Accuracy.STANDARD.tolerance), RunRecord(100_000)
    for part in np.array_split(pieces, 37):
        run.advance(part, parts)
    np.testing.assert_array_equal(run.motion, whole.motion)
    np.testing.assert_array_equal(parts.impact_times_s, record.impact_times_s)


@pytest.mark.parametrize("contact", LAWS)
def test_standard_accuracy_differs_from_reference_accuracy_by_no_more_than_promised(contact):
    specimen, pieces = gong2025(contact=contact), sine_pieces(130.0, 20e-6, 0.5, 2e-5)
    run, _ = advance(specimen, pieces, 2e-5)
    exact, _ = advance(specimen, pieces, 2e-5, Accuracy.REFERENCE)
    assert np.max(np.abs(run.motion - exact.motion) / UNITS) < Accuracy.STANDARD.promise


def test_a_run_ends_at_the_first_impact_that_the_record_cannot_hold():
    specimen, pieces = gong2025(), sine_pieces(130.0, 20e-6, 0.2, 2e-5)
    _, whole = advance(specimen, pieces, 2e-5)
    run, record = CubicRun(specimen, 2e-5, np.zeros(6), Accuracy.STANDARD.tolerance), RunRecord(5)
    assert run.advance(pieces, record) is Outcome.TOO_MANY_IMPACTS
    np.testing.assert_array_equal(record.impact_times_s, whole.impact_times_s[:5])
    assert run.time_s == pytest.approx(whole.impact_times_s[5], abs=1e-15)


@pytest.mark.parametrize("contact", LAWS)
def test_a_drive_with_nan_is_reported_and_does_not_block_the_run(contact):
    pieces = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, np.nan, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    run = CubicRun(gong2025(contact=contact), 1e-5, np.zeros(6), Accuracy.STANDARD.tolerance)
    motions, impacts = run.follow(pieces, RunRecord(10))
    assert (len(motions), len(impacts)) == (1, 1)
    assert run.advance(pieces, RunRecord(10)) is not Outcome.REACHED_END


def test_empty_intervals_and_times_outside_the_intervals_are_refused():
    with pytest.raises(ValueError, match=r"Interval 0\.0 s is not allowed"):
        CubicRun(gong2025(), 0.0, np.zeros(6), 1e-7)
    run = CubicRun(gong2025(), 1e-5, np.zeros(6), 1e-7)
    with pytest.raises(ValueError, match="start and end must be within its intervals"):
        run.advance(np.zeros((3, 4)), RunRecord(10), last_to_s=2e-5)
    with pytest.raises(ValueError, match="rigid stops are at"):
        CubicRun(gong2025(contact="rigid:0.5"), 1e-5, [0.0, 1e-3, 0.0, 0.0, 0.0, 0.0], 1e-7)
