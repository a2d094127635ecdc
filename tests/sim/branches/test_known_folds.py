"""Branches match other programs and the flow: folds, and the growth time of an unstable motion."""

import numpy as np
import pytest

from tests.sim.as_written import hardening
from vibench.sim import (
    AmplitudePath,
    BifurcationKind,
    FrequencyPath,
    Harmonic,
    gong2025,
    integrate,
    periodic_orbit,
)
from vibench.sim.branches import MotionSearch, growth_time_s, least_growth_time_s, shoot_branches
from vibench.sim.specimen.specimen import state_scales

FEW = MotionSearch(places=2, starts=1)
PERIODS = 12


@pytest.fixture(scope="module")
def over_frequency():
    """The branch of a hardening specimen from 95 to 125 Hz at 3 um; its middle part is unstable."""
    return next(shoot_branches(hardening(), FrequencyPath((3e-6,)), 95.0, 125.0, FEW))


def folds(found):
    return [each for each in found.branch.events if each.kind is BifurcationKind.FOLD]


@pytest.mark.thorough
def test_a_hardening_branch_over_frequency_folds_at_98_296_and_116_296_hz(over_frequency):
    found = sorted(each.frequency_hz for each in folds(over_frequency))
    assert found == pytest.approx([98.296, 116.296], abs=2e-3)


@pytest.mark.thorough
def test_the_distance_from_an_unstable_motion_grows_e_fold_in_one_growth_time(over_frequency):
    specimen, branch = hardening(), over_frequency.branch
    at = int(np.argmax(np.abs(branch.multipliers[:, 0])))
    drive = Harmonic(float(branch.frequencies_hz[at]), 3e-6)
    orbit = periodic_orbit(specimen, drive, over_frequency.shape, 1, branch.states[at])
    told_s = float(growth_time_s(drive.frequency_hz, abs(orbit.floquet_multipliers[0])))
    scales = state_scales(specimen, drive)
    start = orbit.state + 1e-6 * scales
    # During the first periods the difference turns into the growing direction.
    run = integrate(specimen, drive, 4 * PERIODS / drive.frequency_hz, "reference", start, drive.frequency_hz)
    away = np.linalg.norm((run.states - orbit.state) / scales, axis=1)
    grown_s = 2 * PERIODS / drive.frequency_hz / np.log(away[4 * PERIODS] / away[2 * PERIODS])
    assert 0.01 < told_s < 1.0
    assert grown_s == pytest.approx(told_s, rel=0.02)


def test_stable_motions_have_an_infinite_growth_time():
    times_s = growth_time_s([100.0, 100.0], [0.3, np.e])
    assert np.isinf(times_s[0])
    assert times_s[1] == pytest.approx(0.01)
    assert growth_time_s(100.0, np.e, periods=3) == pytest.approx(0.03)


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf])
def test_an_invalid_loop_time_is_refused(wrong):
    with pytest.raises(ValueError, match="positive, finite"):
        least_growth_time_s(wrong)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frequency", "lower_um", "upper_um"),
    [
        (103.0, 1.80, 9.35),
        pytest.param(106.0, 2.10, 14.1, marks=pytest.mark.slow),
        pytest.param(112.0, 2.63, 24.5, marks=pytest.mark.slow),
        (285.0, 9.32, 17.3),
    ],
)
def test_a_branch_over_the_drive_level_folds_at_the_ends_of_its_unstable_part(frequency, lower_um, upper_um):
    path = AmplitudePath(frequency)
    found = next(shoot_branches(hardening(), path, 0.3e-6 * lower_um, 1.3e-6 * upper_um, FEW))
    levels = sorted(1e6 * each.amplitude_m for each in folds(found))
    assert levels[0] == pytest.approx(lower_um, abs=0.006)
    assert levels[-1] == pytest.approx(upper_um, rel=0.005)


@pytest.mark.thorough
def test_the_motion_with_contacts_begins_at_0_818_um_and_97_95_hz():
    specimen, path = gong2025(), AmplitudePath(97.95)
    found = list(shoot_branches(specimen, path, 0.4e-6, 1.9e-6, MotionSearch(places=3, starts=4)))
    levels = [1e6 * each.amplitude_m for one in found if one.periods == 1 for each in folds(one)]
    assert min(abs(level - 0.818) for level in levels) < 0.002
