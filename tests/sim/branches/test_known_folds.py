"""Fold points match other programs: independent harmonic balance and Runge-Kutta shooting."""

import pytest

from tests.sim.as_written import hardening
from vibench.sim import AmplitudePath, BifurcationKind, FrequencyPath, gong2025
from vibench.sim.branches import MotionSearch, shoot_branches

FEW = MotionSearch(places=2, starts=1)


def folds(specimen, path, low, high):
    found = next(shoot_branches(specimen, path, low, high, FEW))
    return [each for each in found.branch.events if each.kind is BifurcationKind.FOLD]


@pytest.mark.thorough
def test_a_hardening_branch_over_frequency_folds_at_98_296_and_116_296_hz():
    found = folds(hardening(), FrequencyPath((3e-6,)), 95.0, 125.0)
    assert sorted(each.frequency_hz for each in found) == pytest.approx([98.296, 116.296], abs=2e-3)


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
    found = folds(hardening(), AmplitudePath(frequency), 0.3e-6 * lower_um, 1.3e-6 * upper_um)
    levels = sorted(1e6 * each.amplitude_m for each in found)
    assert levels[0] == pytest.approx(lower_um, abs=0.006)
    assert levels[-1] == pytest.approx(upper_um, rel=0.005)


@pytest.mark.thorough
def test_the_motion_with_contacts_begins_at_0_818_um_and_97_95_hz():
    specimen, path = gong2025(), AmplitudePath(97.95)
    found = list(shoot_branches(specimen, path, 0.4e-6, 1.9e-6, MotionSearch(places=3, starts=4)))
    levels = [
        1e6 * each.amplitude_m
        for one in found
        if one.periods == 1
        for each in one.branch.events
        if each.kind is BifurcationKind.FOLD
    ]
    assert min(abs(level - 0.818) for level in levels) < 0.002
