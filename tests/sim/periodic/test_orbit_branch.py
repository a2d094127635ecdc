import numpy as np
import pytest

from vibench.sim import (
    Accuracy,
    FrequencyPath,
    Harmonic,
    Parameter,
    gong2025,
    integrate,
    periodic_branch,
    periodic_orbit,
)
from vibench.sim.periodic.branch import BifurcationKind, OrbitShape
from vibench.sim.periodic.continuation import ArcEnd, ArcSteps
from vibench.sim.periodic.orbit_branch import periodic_branch_within
from vibench.sim.specimen.specimen import state_scales

SPECIMEN = gong2025(damping_time_s=3e-5)
STEPS = ArcSteps(first=0.02, longest=0.3, shortest=1e-7, tolerance=1e-9, most_points=60)


@pytest.fixture(scope="module")
def upward_branch():
    """The branch of the mirrored motion at 5 um from 100 to 112 Hz."""
    orbit = periodic_orbit(SPECIMEN, Harmonic(100.0, 5e-6), OrbitShape.MIRRORED)
    return periodic_branch(orbit, Parameter.FREQUENCY, 112.0, STEPS)


@pytest.mark.thorough
def test_a_symmetric_branch_does_not_end_at_its_mirror_image():
    """An orbit and its mirror image differ by rounding only, whose sign has no meaning."""
    orbit = periodic_orbit(SPECIMEN, Harmonic(130.0, 20e-6))
    branch = periodic_branch(orbit, Parameter.FREQUENCY, 130.2)
    assert branch.end is ArcEnd.REACHED_BOUND
    assert branch.events == ()


def test_a_complex_pair_is_on_the_unit_circle_at_a_neimark_sacker_point(upward_branch):
    points = [event for event in upward_branch.events if event.kind is BifurcationKind.NEIMARK_SACKER]
    assert points
    for event in points:
        orbit = periodic_orbit(SPECIMEN, Harmonic(event.frequency_hz, 5e-6), start=event.state)
        on_circle = np.abs(np.abs(orbit.floquet_multipliers) - 1.0) < 1e-5
        assert np.count_nonzero(on_circle) == 2
        assert np.abs(orbit.floquet_multipliers[on_circle].imag).min() > 0.1


def test_perturbations_decay_at_stable_points_and_grow_at_unstable_points_of_a_branch(upward_branch):
    for is_stable in (True, False):
        place = int(np.flatnonzero(upward_branch.is_stable == is_stable)[-1])
        drive = Harmonic(float(upward_branch.frequencies_hz[place]), 5e-6)
        start, scales = upward_branch.states[place], state_scales(SPECIMEN, drive)
        push = 1e-7 * scales
        periods = 60 / drive.frequency_hz
        ends = [
            integrate(SPECIMEN, drive, periods, Accuracy.REFERENCE, s).final_state
            for s in (start, start + push)
        ]
        growth = np.abs((ends[1] - ends[0]) / scales).max() / 1e-7
        expected = abs(upward_branch.multipliers[place, 0]) ** 60
        assert (growth < 1.0) == is_stable
        assert 0.01 * expected < growth < 100.0 * expected


@pytest.mark.thorough
def test_an_isolated_branch_closes_beside_another_branch():
    """At its fold at 94.188 Hz the branch of period one is near and has the same tangent."""
    start = [9.918125e-07, -1.045327e-05, -2.993997e-06, 7.055605e-03, 2.760657e-02, 1.403336e-02]
    orbit = periodic_orbit(gong2025(), Harmonic(96.0, 5e-6), OrbitShape.MIRRORED, 3, start)
    branch = periodic_branch_within(orbit, FrequencyPath((5e-6,)), 88.0, 100.0)
    assert branch.begin is branch.end is ArcEnd.CLOSED
    folds = [each.frequency_hz for each in branch.events if each.kind is BifurcationKind.FOLD]
    assert sorted(folds) == pytest.approx([94.1881, 98.8147], abs=2e-4)


def test_a_branch_with_equal_start_and_end_values_is_refused():
    orbit = periodic_orbit(SPECIMEN, Harmonic(130.0, 20e-6))
    with pytest.raises(ValueError, match="two different positive ends"):
        periodic_branch(orbit, Parameter.FREQUENCY, 130.0)
