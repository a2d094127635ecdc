"""Base and specimen motion, from which limits are checked: correct amplitudes for any block size."""

import numpy as np
import pytest

from vibench.acquisition.rig import Role
from vibench.acquisition.run.limit_monitor import HIGH_PASS_HZ, BaseMotion, BaseTracker, SpecimenTracker

RATE_HZ = 51_200.0
TIME_S = np.arange(round(3 * RATE_HZ)) / RATE_HZ
STILL = BaseMotion(np.zeros(TIME_S.size), np.zeros(TIME_S.size))


def amplitude(values):
    """Return the peak of the last second, after the initial transient."""
    return np.max(np.abs(values[-round(RATE_HZ) :]))


@pytest.mark.parametrize("frequency_hz", [10.0, 44.0, 160.0, 1000.0])
def test_velocity_and_stroke_are_the_integrals_of_a_sine_acceleration(frequency_hz):
    turn = 2 * np.pi * frequency_hz
    motion = BaseTracker(RATE_HZ).follow(7.0 * np.sin(turn * TIME_S))
    # The high-pass filter acts once on a velocity and twice on a displacement.
    gain = 1 / np.sqrt(1 + (HIGH_PASS_HZ / frequency_hz) ** 4)
    assert amplitude(motion.velocity) == pytest.approx(gain * 7.0 / turn, rel=3e-3)
    assert amplitude(motion.displacement) == pytest.approx(gain**2 * 7.0 / turn**2, rel=6e-3)


def test_the_motion_does_not_depend_on_the_block_size():
    rng = np.random.default_rng(5)
    acceleration = rng.standard_normal(TIME_S.size)
    first, rest = np.split(acceleration, [5120])  # the first block determines the initial state
    at_once, tracker = BaseTracker(RATE_HZ), BaseTracker(RATE_HZ)
    at_once.follow(first)
    tracker.follow(first)
    whole = at_once.follow(rest)
    edges = np.unique(rng.integers(1, rest.size, 40))
    pieces = [tracker.follow(piece) for piece in np.split(rest, edges)]
    np.testing.assert_allclose(
        np.concatenate([each.displacement for each in pieces]), whole.displacement, atol=1e-15
    )


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0, 3.0])
def test_residual_ringing_at_the_start_does_not_inflate_the_computed_motion(phase):
    """The previous run has just ended: base at 66 Hz and 3.6 m/s2, m0 at 95 Hz and 30 mm/s."""
    time_s = TIME_S[: round(0.4 * RATE_HZ)]
    acceleration = 3.6 * np.exp(-60 * time_s) * np.cos(2 * np.pi * 66 * time_s + phase)
    velocity = 0.03 * np.exp(-3 * time_s) * np.cos(2 * np.pi * 95 * time_s + phase)
    base, specimen = BaseTracker(RATE_HZ), SpecimenTracker(RATE_HZ)
    for block, seen in zip(np.split(acceleration, 4), np.split(velocity, 4), strict=True):
        motion = base.follow(block)
        stretched = specimen.follow(seen, motion, np.zeros(seen.size, dtype=np.bool_))
        assert np.max(np.abs(motion.displacement)) < 0.3e-3
        assert np.max(np.abs(stretched)) < 0.3e-3


def test_a_constant_acceleration_offset_gives_no_displacement():
    motion = BaseTracker(RATE_HZ).follow(np.full(TIME_S.size, 9.81))
    assert np.max(np.abs(motion.displacement)) < 1e-12


@pytest.mark.parametrize("role", [Role.M0_ACCELERATION, Role.M0_DISPLACEMENT])
@pytest.mark.parametrize("frequency_hz", [10.0, 95.0, 500.0])
def test_the_spring_stretch_is_equal_for_every_sensor_on_m0(role, frequency_hz):
    turn, seen = 2 * np.pi * frequency_hz, np.zeros(TIME_S.size, dtype=np.bool_)
    base = BaseTracker(RATE_HZ).follow(-1e-3 * turn**2 * np.sin(turn * TIME_S))
    by_velocity = SpecimenTracker(RATE_HZ).follow(3e-3 * turn * np.cos(turn * TIME_S), base, seen)
    factor = -(turn**2) if role is Role.M0_ACCELERATION else 1.0
    found = SpecimenTracker(RATE_HZ, role).follow(factor * 3e-3 * np.sin(turn * TIME_S), base, seen)
    assert amplitude(found) == pytest.approx(amplitude(by_velocity), rel=2e-3)


def test_a_mass_that_moves_with_the_base_gives_no_spring_stretch():
    turn = 2 * np.pi * 10.0
    motion = BaseTracker(RATE_HZ).follow(15.0 * np.sin(turn * TIME_S))
    seen = np.zeros(TIME_S.size, dtype=np.bool_)
    together = SpecimenTracker(RATE_HZ).follow(-15.0 / turn * np.cos(turn * TIME_S), motion, seen)
    assert amplitude(motion.displacement) > 3.7e-3
    assert amplitude(together) < 1e-5


def test_a_mass_on_a_still_base_stretches_its_springs_by_its_own_displacement():
    turn = 2 * np.pi * 95.0
    seen = np.zeros(TIME_S.size, dtype=np.bool_)
    stretched = SpecimenTracker(RATE_HZ).follow(1e-3 * turn * np.cos(turn * TIME_S), STILL, seen)
    assert amplitude(stretched) == pytest.approx(1e-3, rel=2e-3)


def test_an_overloaded_vibrometer_gives_no_motion():
    is_blind = np.ones(TIME_S.size, dtype=np.bool_)
    stuck = SpecimenTracker(RATE_HZ).follow(np.full(TIME_S.size, 1.0), STILL, is_blind)
    assert np.max(np.abs(stuck)) == 0.0
