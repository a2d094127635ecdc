"""Closed forms of table and specimen driven by sines match time simulation."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.sim import Specimen, base_transmissibility, gong2025
from vibench.sim.shaker.linear_motion import linear_motion
from vibench.sim.shaker.loaded_shaker import Amplifier, LoadedShaker

from .table_and_specimen import SHAKER

AMPLIFIER = Amplifier(gain=-3.0, low_cut_hz=3.0, high_cut_hz=20e3)
RATE_HZ = 51_200.0
VOLTAGE, CURRENT, BASE, M0, P = range(5)


def random_specimen(rng):
    masses, springs = (
        [2.0 ** rng.uniform(-1, 1) * each for each in row]
        for row in ((5.8e-3, 2.1e-3, 2e-3), (2.4e4, 829.0, 1.2e4))
    )
    dampings = tuple(2e-5 * spring for spring in springs)
    return Specimen(tuple(masses), tuple(springs), dampings, rng.uniform(1e-5, 6e-5), gong2025().contact)


def simulate(specimen, frequency_hz, volts):
    """Return the fundamentals of base acceleration and m0 velocity, and the number of impacts."""
    shaken = LoadedShaker(AMPLIFIER, SHAKER, specimen, 1 / RATE_HZ)
    middle_s = (np.arange(round(3.0 * RATE_HZ)) + 0.5) / RATE_HZ
    motion = shaken.move(volts * np.sin(2 * np.pi * frequency_hz * middle_s))
    kept = round(1.5 * RATE_HZ)
    # Phasors relative to the sine drive, with a Hann window against leakage.
    turn = 2j * np.exp(-2j * np.pi * frequency_hz * middle_s[-kept:]) * 2 * np.hanning(kept) / kept
    return motion.base_acceleration[-kept:] @ turn, motion.m0_velocity[-kept:] @ turn, shaken.impacts


@pytest.mark.parametrize("seed", range(6))
def test_the_closed_form_without_contact_equals_the_integration(seed):
    rng = np.random.default_rng(seed)
    specimen, frequency_hz = random_specimen(rng), rng.uniform(40.0, 600.0)
    linear = linear_motion(AMPLIFIER, SHAKER, specimen, frequency_hz)
    volts = 0.02 * specimen.gap_m / abs(linear.per_volt[0, P])
    base, m0, impacts = simulate(specimen, frequency_hz, volts)
    moved = linear.response(volts, specimen.gap_m)[0]
    s = 2j * math.pi * frequency_hz
    assert impacts == 0
    assert base == pytest.approx(s**2 * moved[BASE], rel=3e-3)
    assert m0 == pytest.approx(s * moved[M0], rel=3e-3)


def test_the_closed_form_predicts_the_base_better_with_the_specimen_than_without_the_specimen():
    rng = np.random.default_rng(7)
    off_db = []
    for _ in range(12):
        specimen, frequency_hz = random_specimen(rng), rng.uniform(60.0, 550.0)
        with_it, bare = (linear_motion(AMPLIFIER, SHAKER, each, frequency_hz) for each in (specimen, None))
        volts = rng.uniform(2.0, 8.0) * specimen.gap_m / abs(with_it.per_volt[0, P])
        base, _, impacts = simulate(specimen, frequency_hz, volts)
        assert impacts > 0
        modelled = [abs(each.response(volts, specimen.gap_m)[0, BASE]) for each in (with_it, bare)]
        off_db.append(20 * np.log10((2 * math.pi * frequency_hz) ** 2 * np.array(modelled) / abs(base)))
    to_first_order, without = np.sqrt(np.mean(np.square(off_db), axis=0))
    assert to_first_order < 0.6 * without
    assert to_first_order < 1.5


@given(st.floats(5.0, 2e3))
def test_the_response_of_the_specimen_to_its_base_does_not_depend_on_the_shaker(frequency_hz):
    specimen = gong2025()
    per_volt = linear_motion(AMPLIFIER, SHAKER, specimen, frequency_hz).per_volt[0]
    answer = base_transmissibility(specimen, frequency_hz)[0]
    assert per_volt[M0] / per_volt[BASE] == pytest.approx(answer[0], rel=1e-9)
    assert per_volt[P] / per_volt[BASE] == pytest.approx(answer[3], rel=1e-9)


@pytest.mark.parametrize("stiffer", [0.5, 3.0, 1e7])
def test_the_lever_ratio_predicts_the_response_with_a_changed_middle_spring(stiffer):
    frequency_hz = np.array([20.0, 94.0, 201.0, 266.0, 350.0, 436.0, 500.0])
    specimen = gong2025()
    k0, k1, k2 = specimen.stiffnesses
    other = Specimen(specimen.masses, (k0, stiffer * k1, k2), specimen.dampings, 45e-6, specimen.contact)
    motion = linear_motion(AMPLIFIER, SHAKER, specimen, frequency_hz)
    moved = linear_motion(AMPLIFIER, SHAKER, other, frequency_hz).per_volt
    assert motion.stuck_motion + motion.lever * moved[:, [P]] == pytest.approx(moved, rel=1e-8)
    if stiffer > 1e6:
        assert motion.stuck_motion[:, M0] == pytest.approx(moved[:, M0], rel=1e-4)


@given(st.floats(20.0, 600.0), st.floats(1e-7, 2e-3))
def test_the_computed_voltage_gives_the_requested_base_motion(frequency_hz, base_m):
    specimen = gong2025()
    motion = linear_motion(AMPLIFIER, SHAKER, specimen, frequency_hz)
    volts = motion.volts_for(base_m, specimen.gap_m)
    per_base = motion.per_volt[0, P] / motion.per_volt[0, BASE]
    if abs(per_base) * base_m <= specimen.gap_m:
        assert abs(motion.per_volt[0, BASE]) * volts[0] == pytest.approx(base_m, rel=1e-9)
    elif abs(motion.per_volt[0, P]) * volts[0] > specimen.gap_m:
        assert abs(motion.response(volts, specimen.gap_m)[0, BASE]) == pytest.approx(base_m, rel=1e-6)


@given(st.floats(20.0, 600.0), st.floats(1e-3, 10.0))
def test_the_relative_displacement_of_the_closed_form_is_limited_to_the_gap(frequency_hz, volts):
    specimen = gong2025()
    motion = linear_motion(AMPLIFIER, SHAKER, specimen, frequency_hz)
    moved = motion.response(volts, specimen.gap_m)[0]
    free = volts * motion.per_volt[0]
    if abs(free[P]) <= specimen.gap_m:
        assert moved == pytest.approx(free)
    else:
        assert abs(moved[P]) == pytest.approx(specimen.gap_m, rel=1e-6)
