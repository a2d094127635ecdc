"""Amplifier, shaker and specimen together: closed forms, energy, limits."""

from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import AcquisitionError
from vibench.acquisition.rig import BaseQuantity, RigModel, load_rig, suspended_mass_kg
from vibench.acquisition.rig._model import amplifier_gain
from vibench.sim import base_transmissibility, gong2025
from vibench.virtual_rig.world._plant import TRUTH_COLUMNS, Plant
from vibench.virtual_rig.world._time_grid import USUAL_GRID

RIG = load_rig(Path(__file__).parents[3] / "hardware_configs" / "virtual_rig.toml")
STEP_S = USUAL_GRID.step_s
SECOND = int(USUAL_GRID.rate_hz)
LINES_HZ = np.array([30, 94, 150, 201, 266, 310, 436, 500, 777])
COLUMN = {name: number for number, name in enumerate(TRUTH_COLUMNS)}


def changed(section, **values):
    return RIG.model_copy(update={section: getattr(RIG, section).model_copy(update=values)})


def tones(amplitude_v, frequencies_hz, seconds=1):
    """Means over the steps of sines of equal amplitude, a whole number of periods in a second."""
    edges_s = np.arange(seconds * SECOND + 1) * STEP_S
    phases = 2 * np.pi * np.asarray(frequencies_hz, dtype=float)[:, None] * edges_s
    rates = 2 * np.pi * np.asarray(frequencies_hz, dtype=float)[:, None] * STEP_S
    return amplitude_v * np.sum(-np.diff(np.cos(phases + np.arange(len(phases))[:, None])) / rates, axis=0)


def settled(plant, drive, seconds):
    for _ in range(seconds):
        plant.move(drive, np.zeros(len(drive)))
    return plant.move(drive, np.zeros(len(drive)), len(drive))


def loaded_rig(specimen, frequency_hz):
    """Base acceleration and m0 velocity per volt, specimen and its reaction included: the closed form."""
    shaker, s = RIG.shaker, 2j * np.pi * frequency_hz
    moved = base_transmissibility(specimen, frequency_hz)[:, 0]
    stiffness, damping = specimen.stiffnesses[0], specimen.dampings[0]
    reaction = (stiffness + s * damping) * (moved - 1)
    dynamic = (
        shaker.suspension_stiffness_n_per_m
        + s * shaker.suspension_damping_ns_per_m
        + s**2 * suspended_mass_kg(shaker)
        - reaction
    )
    impedance = shaker.coil_resistance_ohm + s * shaker.coil_inductance_h
    force_constant = shaker.force_constant_n_per_a
    base = force_constant * amplifier_gain(RIG.amplifier, s) / (impedance * dynamic + s * force_constant**2)
    return s**2 * base, s * moved * base


def lines(means):
    """Complex amplitudes of a second of means at LINES_HZ, the mean's droop and middle undone."""
    angle = np.pi * LINES_HZ * STEP_S
    return np.fft.rfft(means)[LINES_HZ] * 2 / len(means) / np.sinc(angle / np.pi) * np.exp(-1j * angle)


@pytest.fixture(scope="module")
def linear_motion():
    """A second of periodic motion far below the first contact."""
    plant = Plant(RIG, gong2025(), STEP_S)
    drive = tones(1e-3, LINES_HZ)
    motion = settled(plant, drive, 4)
    assert plant.impacts == 0
    return drive, motion


def test_base_and_specimen_answer_as_the_closed_form_of_the_loaded_rig(linear_motion):
    drive, motion = linear_motion
    acceleration, velocity = loaded_rig(gong2025(), LINES_HZ.astype(float))
    assert lines(motion.base_acceleration) / lines(drive) == pytest.approx(acceleration, rel=1e-3)
    assert lines(motion.m0_velocity) / lines(drive) == pytest.approx(velocity, rel=1e-3)


def test_the_specimen_notches_the_base_where_it_resonates(linear_motion):
    drive, motion = linear_motion
    measured = np.abs(lines(motion.base_acceleration) / lines(drive))
    alone = np.abs(RigModel(RIG).transfer(BaseQuantity.ACCELERATION, LINES_HZ))
    at_resonance = np.abs(measured / alone - 1)[LINES_HZ == 266]
    beside = np.abs(measured / alone - 1)[LINES_HZ == 777]
    assert at_resonance > 0.03
    assert beside < 0.02
    acceleration, _ = loaded_rig(gong2025(), np.arange(255.0, 275.0, 0.1))
    assert np.min(np.abs(acceleration)) < 0.97 * alone[LINES_HZ == 266]


def test_without_a_specimen_to_speak_of_the_shaker_is_the_rig_model():
    dust = gong2025(contact="linear")
    dust = type(dust)(
        masses=tuple(1e-6 * m for m in dust.masses),
        stiffnesses=tuple(1e-6 * k for k in dust.stiffnesses),
        dampings=tuple(1e-6 * c for c in dust.dampings),
        gap_m=dust.gap_m,
        contact=dust.contact,
    )
    drive = tones(1e-3, LINES_HZ)
    motion = settled(Plant(RIG, dust, STEP_S), drive, 2)
    expected = RigModel(RIG).transfer(BaseQuantity.ACCELERATION, LINES_HZ)
    assert lines(motion.base_acceleration) / lines(drive) == pytest.approx(expected, rel=5e-4)
    voltage = RigModel(RIG).transfer(BaseQuantity.AMPLIFIER_VOLTAGE, LINES_HZ)
    assert lines(motion.amplifier_voltage) / lines(drive) == pytest.approx(voltage, rel=5e-4)


@pytest.mark.parametrize("amplitude_v", [1e-3, 0.4])
def test_electrical_work_is_heat_friction_and_stored_energy(amplitude_v):
    specimen = gong2025()
    plant = Plant(RIG, specimen, STEP_S)
    drive = amplitude_v * np.sin(2 * np.pi * 260 * STEP_S * np.arange(SECOND))
    before = plant.move(drive, np.zeros(SECOND), SECOND).truth[-1]
    motion = plant.move(drive, np.zeros(SECOND), SECOND)
    assert (plant.impacts > 100) == (amplitude_v > 0.1)
    truth = np.vstack([before, np.empty((0, 9)), motion.truth]) if len(motion.truth) else None
    assert truth is not None
    state = {name: truth[:, number] for name, number in COLUMN.items()}

    def integral(power):
        return STEP_S * np.sum((power[1:] + power[:-1]) / 2)

    current, base_velocity = state["current"], state["base_velocity"]
    work = STEP_S * np.sum(motion.amplifier_voltage * (current[1:] + current[:-1]) / 2)
    heat = RIG.shaker.coil_resistance_ohm * integral(current**2)
    friction = RIG.shaker.suspension_damping_ns_per_m * integral(base_velocity**2)
    slips = (state["vx"] - base_velocity, state["vy"] - state["vz"], state["vz"] - state["vx"])
    friction += sum(c * integral(slip**2) for c, slip in zip(specimen.dampings, slips, strict=True))
    stored = stored_energy(specimen, state)
    assert work == pytest.approx(heat + friction + stored[-1] - stored[0], rel=1e-3)


def stored_energy(specimen, state):
    shaker = RIG.shaker
    kinetic = suspended_mass_kg(shaker) * state["base_velocity"] ** 2
    kinetic += sum(m * state[v] ** 2 for m, v in zip(specimen.masses, ("vx", "vy", "vz"), strict=True))
    stretches = (state["x"] - state["base_displacement"], state["y"] - state["z"], state["z"] - state["x"])
    elastic = shaker.suspension_stiffness_n_per_m * state["base_displacement"] ** 2
    elastic += sum(k * stretch**2 for k, stretch in zip(specimen.stiffnesses, stretches, strict=True))
    return 0.5 * (kinetic + elastic + shaker.coil_inductance_h * state["current"] ** 2)


def test_the_amplifier_clips_at_its_largest_voltage():
    rig = changed("amplifier", clip_v=5.0)
    plant = Plant(rig, gong2025(), STEP_S)
    drive = tones(5.0, [100.0])
    motion = plant.move(drive, np.zeros(SECOND))
    assert np.max(np.abs(motion.amplifier_voltage)) == pytest.approx(5.0)
    assert plant.limited_steps > SECOND / 2


def test_the_amplifier_gives_no_more_current_than_its_limiter_is_set_to():
    limit = RIG.amplifier.current_limit_a.model_copy(update={"value": 1.0})
    plant = Plant(changed("amplifier", current_limit_a=limit), gong2025(), STEP_S)
    motion = plant.move(tones(3.0, [200.0]), np.zeros(SECOND), SECOND)
    current = motion.truth[:, COLUMN["current"]]
    assert np.max(np.abs(current)) == pytest.approx(np.sqrt(2.0))
    assert plant.limited_steps > 0


def test_noise_is_added_at_the_amplifiers_output():
    plant = Plant(RIG, gong2025(), STEP_S)
    noise = np.random.default_rng(1).standard_normal(SECOND)
    assert np.array_equal(plant.move(np.zeros(SECOND), noise).amplifier_voltage, noise)


def test_the_rubber_stops_end_the_stroke_and_are_counted():
    plant = Plant(RIG, gong2025(), STEP_S)
    free = abs(complex(RigModel(RIG).transfer(BaseQuantity.STROKE, 8.0))) * 6.0
    stroke = RIG.shaker.limits.stroke_m.value
    assert free > 1.2 * stroke
    motion = plant.move(tones(6.0, [8.0]), np.zeros(SECOND), SECOND)
    reached = np.max(np.abs(motion.truth[:, COLUMN["base_displacement"]]))
    assert stroke < reached < 1.15 * stroke
    assert plant.bumps > 0


def test_a_small_drive_never_touches_the_rubber_stops():
    plant = Plant(RIG, gong2025(), STEP_S)
    plant.move(tones(0.5, [50.0]), np.zeros(SECOND))
    assert plant.bumps == 0
    assert plant.limited_steps == 0


def test_a_motion_that_is_not_finite_is_an_error_that_says_what_to_do():
    plant = Plant(RIG, gong2025(), STEP_S)
    drive = np.zeros(100)
    drive[40] = np.nan
    with pytest.raises(AcquisitionError, match=r"lost its way.*restart"):
        plant.move(drive, np.zeros(100))


def test_truth_is_kept_only_when_asked_for():
    plant = Plant(RIG, gong2025(), STEP_S)
    assert plant.move(np.zeros(10), np.zeros(10)).truth.shape == (0, len(TRUTH_COLUMNS))
    assert plant.move(np.zeros(10), np.zeros(10), 10).truth.shape == (10, len(TRUTH_COLUMNS))


def test_two_stretches_are_one_stretch():
    drive = tones(0.7, [260.0])
    whole, parts = Plant(RIG, gong2025(), STEP_S), Plant(RIG, gong2025(), STEP_S)
    expected = whole.move(drive, np.zeros(SECOND)).m0_velocity
    got = [parts.move(part, np.zeros(len(part))).m0_velocity for part in np.split(drive, [1, 2, 777, 50_000])]
    assert np.array_equal(np.concatenate(got), expected)
    assert parts.impacts == whole.impacts > 0
