"""Amplifier, shaker and specimen: closed forms, energy, limits, and replay of the coil voltage."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import base_transmissibility, gong2025
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS, Amplifier, LoadedShaker, MotionFailed

from .table_and_specimen import SHAKER, base_per_coil_volt

AMPLIFIER = Amplifier(
    gain=10**0.5, low_cut_hz=0.3, high_cut_hz=30e3, clip_v=21.0, current_limit_a=5.0 * np.sqrt(2.0)
)
STOPPED = replace(SHAKER, stroke_m=4e-3)
RATE_HZ = 102_400.0
STEP_S = 1 / RATE_HZ
SECOND = int(RATE_HZ)
LINES_HZ = np.array([30, 94, 150, 201, 266, 310, 436, 500, 777])
COLUMN = {name: number for number, name in enumerate(MOTION_COLUMNS)}


def loaded_shaker(specimen=None, amplifier=AMPLIFIER, start=(0.0,) * 6):
    return LoadedShaker(amplifier, STOPPED, specimen or gong2025(), STEP_S, start)


def tones(amplitude_v, frequencies_hz, seconds=1):
    """Return means over each step of a sum of sines with whole periods per second."""
    edges_s = np.arange(seconds * SECOND + 1) * STEP_S
    phases = 2 * np.pi * np.asarray(frequencies_hz, dtype=float)[:, None] * edges_s
    rates = 2 * np.pi * np.asarray(frequencies_hz, dtype=float)[:, None] * STEP_S
    return amplitude_v * np.sum(-np.diff(np.cos(phases + np.arange(len(phases))[:, None])) / rates, axis=0)


def settle(table, drive, seconds):
    for _ in range(seconds):
        table.move(drive, np.zeros(len(drive)))
    return table.move(drive, np.zeros(len(drive)), len(drive))


def amplifier_gain(frequency_hz):
    s = 2j * np.pi * frequency_hz
    low, high = 2 * np.pi * AMPLIFIER.low_cut_hz, 2 * np.pi * AMPLIFIER.high_cut_hz
    return AMPLIFIER.gain * s / (s + low) / (1 + s / high)


def per_volt(frequency_hz, specimen=None):
    """Return base acceleration and m0 velocity per input volt, in closed form with the specimen."""
    s = 2j * np.pi * frequency_hz
    base = amplifier_gain(frequency_hz) * base_per_coil_volt(frequency_hz, specimen)
    moved = 1.0 if specimen is None else base_transmissibility(specimen, frequency_hz)[:, 0]
    return s**2 * base, s * moved * base


def lines(means):
    """Return complex amplitudes of step means at LINES_HZ, corrected for averaging over the step."""
    angle = np.pi * LINES_HZ * STEP_S
    return np.fft.rfft(means)[LINES_HZ] * 2 / len(means) / np.sinc(angle / np.pi) * np.exp(-1j * angle)


@pytest.fixture(scope="module")
def linear_motion():
    """Drive and one second of periodic motion without contact."""
    table = loaded_shaker()
    drive = tones(1e-3, LINES_HZ)
    motion = settle(table, drive, 4)
    assert table.impacts == 0
    return drive, motion


def test_the_base_and_the_specimen_move_as_in_the_closed_form_of_the_loaded_rig(linear_motion):
    drive, motion = linear_motion
    acceleration, velocity = per_volt(LINES_HZ.astype(float), gong2025())
    assert lines(motion.base_acceleration) / lines(drive) == pytest.approx(acceleration, rel=1e-3)
    assert lines(motion.m0_velocity) / lines(drive) == pytest.approx(velocity, rel=1e-3)


def test_a_table_with_a_negligible_specimen_moves_like_the_bare_table():
    dust = gong2025(contact="linear")
    dust = type(dust)(
        masses=tuple(1e-6 * m for m in dust.masses),
        stiffnesses=tuple(1e-6 * k for k in dust.stiffnesses),
        dampings=tuple(1e-6 * c for c in dust.dampings),
        gap_m=dust.gap_m,
        contact=dust.contact,
    )
    drive = tones(1e-3, LINES_HZ)
    motion = settle(loaded_shaker(dust), drive, 2)
    expected, _ = per_volt(LINES_HZ)
    assert lines(motion.base_acceleration) / lines(drive) == pytest.approx(expected, rel=5e-4)
    assert lines(motion.amplifier_voltage) / lines(drive) == pytest.approx(amplifier_gain(LINES_HZ), rel=5e-4)


@pytest.mark.parametrize("amplitude_v", [1e-3, 0.4])
def test_the_electrical_work_equals_the_sum_of_heat_friction_and_stored_energy(amplitude_v):
    specimen = gong2025()
    table = loaded_shaker(specimen)
    drive = amplitude_v * np.sin(2 * np.pi * 260 * STEP_S * np.arange(SECOND))
    before = table.move(drive, np.zeros(SECOND), SECOND).ends[-1]
    motion = table.move(drive, np.zeros(SECOND), SECOND)
    assert (table.impacts > 100) == (amplitude_v > 0.1)
    ends = np.vstack([before, motion.ends])
    state = {name: ends[:, number] for name, number in COLUMN.items()}

    def integral(power):
        return STEP_S * np.sum((power[1:] + power[:-1]) / 2)

    current, base_velocity = state["current"], state["base_velocity"]
    work = STEP_S * np.sum(motion.amplifier_voltage * (current[1:] + current[:-1]) / 2)
    heat = SHAKER.coil_resistance_ohm * integral(current**2)
    friction = SHAKER.suspension_damping_ns_per_m * integral(base_velocity**2)
    slips = (state["vx"] - base_velocity, state["vy"] - state["vz"], state["vz"] - state["vx"])
    friction += sum(c * integral(slip**2) for c, slip in zip(specimen.dampings, slips, strict=True))
    stored = stored_energy(specimen, state)
    assert work == pytest.approx(heat + friction + stored[-1] - stored[0], rel=1e-3)


def stored_energy(specimen, state):
    kinetic = SHAKER.moving_mass_kg * state["base_velocity"] ** 2
    kinetic += sum(m * state[v] ** 2 for m, v in zip(specimen.masses, ("vx", "vy", "vz"), strict=True))
    stretches = (state["x"] - state["base_displacement"], state["y"] - state["z"], state["z"] - state["x"])
    elastic = SHAKER.suspension_stiffness_n_per_m * state["base_displacement"] ** 2
    elastic += sum(k * stretch**2 for k, stretch in zip(specimen.stiffnesses, stretches, strict=True))
    return 0.5 * (kinetic + elastic + SHAKER.coil_inductance_h * state["current"] ** 2)


def test_the_output_of_the_amplifier_is_clipped_at_its_largest_voltage():
    table = loaded_shaker(amplifier=replace(AMPLIFIER, clip_v=5.0))
    drive = tones(5.0, [100.0])
    motion = table.move(drive, np.zeros(SECOND))
    assert np.max(np.abs(motion.amplifier_voltage)) == pytest.approx(5.0)
    assert table.structure["limited_steps"] > SECOND / 2


def test_the_amplifier_current_stays_within_its_limit():
    table = loaded_shaker(amplifier=replace(AMPLIFIER, current_limit_a=1.0))
    motion = table.move(tones(3.0, [200.0]), np.zeros(SECOND), SECOND)
    current = motion.ends[:, COLUMN["current"]]
    assert np.max(np.abs(current)) == pytest.approx(1.0)
    assert table.structure["limited_steps"] > 0


def test_noise_is_added_at_the_amplifier_output():
    table = loaded_shaker()
    noise = np.random.default_rng(1).standard_normal(SECOND)
    assert np.array_equal(table.move(np.zeros(SECOND), noise).amplifier_voltage, noise)


def test_the_rubber_stops_limit_the_stroke_and_their_contacts_are_counted():
    table = loaded_shaker()
    free = 6.0 * abs(per_volt(8.0)[0]) / (2 * np.pi * 8.0) ** 2
    stroke = STOPPED.stroke_m
    assert free > 1.2 * stroke
    motion = table.move(tones(6.0, [8.0]), np.zeros(SECOND), SECOND)
    reached = np.max(np.abs(motion.ends[:, COLUMN["base_displacement"]]))
    assert stroke < reached < 1.15 * stroke
    assert table.structure["bumps"] > 0


def test_a_motion_that_is_not_finite_raises_an_error_that_states_its_time():
    table = loaded_shaker()
    drive = np.zeros(100)
    drive[40] = np.nan
    with pytest.raises(MotionFailed, match="after 40 of 100 steps"):
        table.move(drive, np.zeros(100))


@pytest.mark.thorough
def test_replaying_the_recorded_coil_voltage_reproduces_the_table_motion():
    drive = tones(0.7, [266.0])
    measured = loaded_shaker()
    recorded = measured.move(drive, 0.01 * np.random.default_rng(2).standard_normal(SECOND))
    driven = loaded_shaker(amplifier=Amplifier())
    again = driven.move(recorded.amplifier_voltage)
    assert driven.impacts == measured.impacts > 0
    assert again.base_acceleration == pytest.approx(recorded.base_acceleration, rel=1e-9, abs=1e-9)
    assert driven.structure["limited_steps"] == 0


def test_one_simulation_of_a_voltage_equals_a_simulation_in_blocks():
    drive, block = tones(0.7, [266.0])[:9500], 1000
    whole, stepwise = loaded_shaker(), loaded_shaker()
    motion = whole.move(drive, block=block)
    parts, begun = [], []
    for first in range(0, len(drive), block):
        parts.append(stepwise.move(drive[first : first + block]).m0_velocity)
        begun.append(stepwise.impacts)
    assert motion.contacts.tolist() == begun
    assert begun[-1] == whole.impacts > 0
    assert np.array_equal(motion.m0_velocity, np.concatenate(parts))


def test_a_displaced_specimen_moves_the_undriven_table():
    start = (2e-6, 1e-6, 1e-6, 0.0, 0.0, 0.0)
    motion = loaded_shaker(start=start).move(np.zeros(1000), end_rows=1000)
    assert motion.ends[0, 3:6] == pytest.approx(start[:3], rel=0.01)
    # The first force on the table is k0 x.
    push = gong2025().stiffnesses[0] * start[0] / SHAKER.moving_mass_kg
    assert motion.base_acceleration[1] == pytest.approx(push, rel=0.01)


@pytest.mark.parametrize(
    ("part", "wrong"),
    [
        (AMPLIFIER, {"gain": 0.0}),
        (AMPLIFIER, {"gain": np.nan}),
        (AMPLIFIER, {"low_cut_hz": -1.0}),
        (AMPLIFIER, {"high_cut_hz": 0.2}),
        (AMPLIFIER, {"clip_v": np.nan}),
        (AMPLIFIER, {"current_limit_a": 0.0}),
        (STOPPED, {"moving_mass_kg": 0.0}),
        (STOPPED, {"coil_inductance_h": np.inf}),
        (STOPPED, {"stroke_m": np.nan}),
    ],
)
def test_impossible_amplifier_and_shaker_values_are_refused(part, wrong):
    with pytest.raises(ValueError, match="is not allowed"):
        replace(part, **wrong)


@pytest.mark.parametrize("step_s", [0.0, -1.0, np.inf, np.nan])
def test_an_invalid_time_step_is_refused(step_s):
    with pytest.raises(ValueError, match="Interval"):
        LoadedShaker(AMPLIFIER, STOPPED, gong2025(), step_s)
