"""The growth time of an unstable periodic motion matches the simulated departure from it."""

import numpy as np
import pytest

from tests.sim.as_written import hardening
from vibench.sim import FrequencyPath, integrate, periodic_orbit
from vibench.sim.branches import MotionSearch, growth_time_s, least_growth_time_s, shoot_branches
from vibench.sim.specimen.drive import Harmonic
from vibench.sim.specimen.specimen import state_scales

PERIODS = 12


@pytest.mark.thorough
def test_the_distance_from_an_unstable_motion_grows_e_fold_in_one_growth_time():
    specimen = hardening()
    found = next(shoot_branches(specimen, FrequencyPath((3e-6,)), 95.0, 125.0, MotionSearch(2, 1)))
    branch = found.branch
    at = int(np.argmax(np.abs(branch.multipliers[:, 0])))
    drive = Harmonic(float(branch.frequencies_hz[at]), 3e-6)
    orbit = periodic_orbit(specimen, drive, found.shape, 1, branch.states[at])
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
