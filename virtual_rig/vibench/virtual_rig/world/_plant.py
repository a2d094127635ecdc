"""The moving part of the rig, step by step: amplifier, coil and table, and the specimen on it.

Every quantity handed over is its mean over a step: of the voltage because it is held, of the base's
acceleration and of m0's velocity because their integrals are known at both ends. Means alias nothing
that happens inside a step and all lie at the step's middle, so channels agree in phase.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from vibench.acquisition import AcquisitionError
from vibench.acquisition.rig import Rig, RigModel
from vibench.sim import Specimen
from vibench.sim.kernels import kernel
from vibench.sim.stepping import IntervalTables, advance_interval, base_reaction, interval_tables, new_state

FloatArray = NDArray[np.float64]

_STOP_STIFFNESS_N_PER_M = 2e5
"""Of the rubber stops that end the stroke; assumed: 45 N press 0.2 mm into them."""
_STOP_DAMPING_NS_PER_M = 50.0
"""Of the same; assumed: the table comes back with about half its energy."""
_PEAK_OVER_RMS = 2.0**0.5
"""The current limiter's setting is the rms of the largest sine it lets pass."""

BASE_DISPLACEMENT, BASE_VELOCITY, COIL_CURRENT = range(3)
"""State of the shaker [m, m/s, A]."""
LOW_CUT, HIGH_CUT = range(3, 5)
"""State of the amplifier's band edges [V]."""
REACTION_BEFORE = 5
"""The specimen's force on the base one step earlier [N]."""
_PLANT_SIZE = 6

TRUTH_COLUMNS = ("base_displacement", "base_velocity", "current", "x", "y", "z", "vx", "vy", "vz")
"""What the truth holds at the end of a step, SI; the specimen's as in vibench.sim.model."""
_SHAKER_SIZE = 3


class PlantTables(NamedTuple):
    """Numbers of the plant that do not change."""

    step: float
    """Physical length of a step [s]."""
    gain: float
    low_decay: float
    low_mean: float
    """Of a first-order lag over a step: what is left at its end, and the mean of what is left."""
    high_decay: float
    high_mean: float
    clip: float
    """[V]"""
    current_limit: float
    """Peak [A]."""
    transition: FloatArray
    """Shape (3, 5): shaker state, voltage and force before -> shaker state one step later."""
    stroke: float
    stop_stiffness: float
    stop_damping: float
    specimen: IntervalTables


@dataclass(frozen=True)
class Motion:
    """What happened in a stretch of steps; arrays of one value a step, means over the step."""

    amplifier_voltage: FloatArray
    """[V]"""
    base_acceleration: FloatArray
    """[m/s2]"""
    m0_velocity: FloatArray
    """[m/s]"""
    truth: FloatArray
    """Shape (steps, 9), columns TRUTH_COLUMNS, at the ends of the steps; no rows unless asked for."""


class Plant:
    """Amplifier, shaker and specimen, from rest, driven by the voltage at the amplifier's input."""

    def __init__(self, rig: Rig, specimen: Specimen, step_s: float) -> None:
        """Start from rest; ``step_s`` is the physical length of a step."""
        self.impacts = 0
        """Contacts begun since the rig was switched on."""
        self.bumps = 0
        """Steps that the table has spent in its rubber stops."""
        self.limited_steps = 0
        """Steps in which the amplifier clipped or limited its current."""
        self._tables = _plant_tables(rig, specimen, step_s)
        self._state = np.zeros(_PLANT_SIZE)
        self._specimen = new_state(specimen)
        self._counts = np.zeros(3, dtype=np.int64)

    def set_gain(self, gain: float) -> None:
        """Turn the amplifier's knob to a gain (output volts per input volt)."""
        self._tables = self._tables._replace(gain=gain)

    def move(self, drive_v: FloatArray, noise_v: FloatArray, truth_rows: int = 0) -> Motion:
        """Advance by as many steps as ``drive_v`` has means; ``noise_v`` adds at the amplifier's output.

        Raises
        ------
        AcquisitionError
            When the specimen's motion is no longer finite.

        """
        count = len(drive_v)
        motion = Motion(
            np.empty(count), np.empty(count), np.empty(count), np.empty((truth_rows, len(TRUTH_COLUMNS)))
        )
        self._counts[:] = 0
        good = _move(
            drive_v,
            noise_v,
            self._state,
            self._specimen,
            self._tables,
            motion.amplifier_voltage,
            motion.base_acceleration,
            motion.m0_velocity,
            motion.truth,
            self._counts,
        )
        if good < count:
            raise AcquisitionError(
                f"The simulated specimen lost its way {good} steps into a stretch of {count}: its motion is "
                "not finite or a contact made no progress. The rig stands still: lower the drive, restart it"
            )
        self.impacts += int(self._counts[0])
        self.bumps += int(self._counts[1])
        self.limited_steps += int(self._counts[2])
        return motion


def _plant_tables(rig: Rig, specimen: Specimen, step_s: float) -> PlantTables:
    amplifier, shaker = rig.amplifier, rig.shaker
    equations = RigModel(rig).shaker_equations()
    inputs = equations.B.shape[1]
    joint = np.zeros((_SHAKER_SIZE + inputs, _SHAKER_SIZE + inputs))
    joint[:_SHAKER_SIZE] = np.hstack([equations.A, equations.B])
    low, high = (2 * np.pi * cut * step_s for cut in (amplifier.low_cut_hz, amplifier.high_cut_hz))
    return PlantTables(
        step=step_s,
        gain=amplifier.gain,
        low_decay=float(np.exp(-low)),
        low_mean=_mean_of_decay(low),
        high_decay=float(np.exp(-high)),
        high_mean=_mean_of_decay(high),
        clip=amplifier.clip_v,
        current_limit=amplifier.current_limit_a.value * _PEAK_OVER_RMS,
        transition=np.ascontiguousarray(expm(joint * step_s)[:_SHAKER_SIZE]),
        stroke=shaker.limits.stroke_m.value,
        stop_stiffness=_STOP_STIFFNESS_N_PER_M,
        stop_damping=_STOP_DAMPING_NS_PER_M,
        specimen=interval_tables(specimen, step_s),
    )


def _mean_of_decay(steps_per_time_constant: float) -> float:
    """Mean of exp(-t) from zero to the argument: 1 where nothing decays."""
    return (
        float(-np.expm1(-steps_per_time_constant) / steps_per_time_constant)
        if steps_per_time_constant
        else 1.0
    )


@kernel
def _move(
    drive: FloatArray,
    noise: FloatArray,
    state: FloatArray,
    specimen: FloatArray,
    tables: PlantTables,
    amplifier_voltage: FloatArray,
    base_acceleration: FloatArray,
    m0_velocity: FloatArray,
    truth: FloatArray,
    counts: NDArray[np.int64],
) -> int:
    """Advance step by step; return the steps done, fewer than asked for when the specimen failed."""
    h, t = tables.step, tables.transition
    base = np.empty(4)
    for n in range(drive.size):
        u0, v0, i0 = state[BASE_DISPLACEMENT], state[BASE_VELOCITY], state[COIL_CURRENT]
        reaction = base_reaction(specimen, u0, v0, tables.specimen)
        # At the middle of the step, by extrapolation: a force held from the step's start would
        # lag by half a step and feed energy into the table.
        force = 1.5 * reaction - 0.5 * state[REACTION_BEFORE]
        state[REACTION_BEFORE] = reaction
        stop = _stop_force(u0, v0, tables)
        if stop != 0.0:
            counts[1] += 1
        force += stop

        asked = _amplified(drive[n], state, tables)
        voltage = min(max(asked, -tables.clip), tables.clip) + noise[n]
        coasting = t[2, 0] * u0 + t[2, 1] * v0 + t[2, 2] * i0 + t[2, 4] * force
        current = coasting + t[2, 3] * voltage
        if abs(current) > tables.current_limit:
            current = min(max(current, -tables.current_limit), tables.current_limit)
            voltage = (current - coasting) / t[2, 3]
            counts[2] += 1
        elif asked != min(max(asked, -tables.clip), tables.clip):
            counts[2] += 1

        u1 = t[0, 0] * u0 + t[0, 1] * v0 + t[0, 2] * i0 + t[0, 3] * voltage + t[0, 4] * force
        v1 = t[1, 0] * u0 + t[1, 1] * v0 + t[1, 2] * i0 + t[1, 3] * voltage + t[1, 4] * force
        state[BASE_DISPLACEMENT], state[BASE_VELOCITY], state[COIL_CURRENT] = u1, v1, current

        mean_velocity = (u1 - u0) / h
        base[0] = u0
        base[1] = v0
        base[2] = (3.0 * mean_velocity - 2.0 * v0 - v1) / h
        base[3] = (v0 + v1 - 2.0 * mean_velocity) / (h * h)
        x0 = specimen[0]
        impacts = advance_interval(specimen, base, tables.specimen)
        if impacts < 0:
            return n
        counts[0] += impacts

        amplifier_voltage[n] = voltage
        base_acceleration[n] = (v1 - v0) / h
        m0_velocity[n] = (specimen[0] - x0) / h
        if truth.shape[0] > n:
            truth[n, 0] = u1
            truth[n, 1] = v1
            truth[n, 2] = current
            truth[n, 3:9] = specimen[:6]
    return int(drive.size)


@kernel
def _amplified(volts: float, state: FloatArray, tables: PlantTables) -> float:
    """Mean output over a step of the amplifier as far as it is linear, its input held."""
    low, high = state[LOW_CUT], state[HIGH_CUT]
    below = volts + (low - volts) * tables.low_mean if tables.low_decay < 1.0 else 0.0
    state[LOW_CUT] = volts + (low - volts) * tables.low_decay
    passed = volts - below
    mean = passed + (high - passed) * tables.high_mean
    state[HIGH_CUT] = passed + (high - passed) * tables.high_decay
    return float(tables.gain * mean)


@kernel
def _stop_force(displacement: float, velocity: float, tables: PlantTables) -> float:
    """Force of the rubber stops on the table; they push and never pull."""
    if displacement > tables.stroke:
        pressed = tables.stop_stiffness * (displacement - tables.stroke) + tables.stop_damping * velocity
        return -max(pressed, 0.0)
    if displacement < -tables.stroke:
        pressed = tables.stop_stiffness * (-displacement - tables.stroke) - tables.stop_damping * velocity
        return max(pressed, 0.0)
    return 0.0
