"""Amplifier, coil and table, and the specimen that pushes back on it, step by step under a voltage.

Every quantity handed over is its mean over a step: of the voltage because it is held, of the base's
acceleration and of m0's velocity because their integrals are known at both ends. Means alias nothing
that happens inside a step and all lie at the step's middle, so channels agree in phase.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from ..kernels import kernel
from ..model import Specimen
from ..stepping import IntervalTables, advance_interval, base_reaction, interval_tables, new_state
from ._parts import Amplifier, FloatArray, Shaker

BASE_DISPLACEMENT, BASE_VELOCITY, COIL_CURRENT = range(3)
"""State of the shaker [m, m/s, A]."""
LOW_CUT, HIGH_CUT = range(3, 5)
"""State of the amplifier's band edges [V]."""
REACTION_BEFORE = 5
"""The specimen's force on the base one step earlier [N]."""
_STATE_SIZE = 6

MOTION_COLUMNS = ("base_displacement", "base_velocity", "current", "x", "y", "z", "vx", "vy", "vz")
"""Of shaker and specimen at the end of a step, SI units; x, y and z are absolute."""
_SHAKER_SIZE = 3


class _ShakerTables(NamedTuple):
    """What a step is computed with."""

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


class ShakerParts(NamedTuple):
    """What `move_shaker` moves, and moves by."""

    state: FloatArray
    specimen: FloatArray
    tables: _ShakerTables
    counts: NDArray[np.int64]
    """Contacts, bumps and limited steps, of which a `LoadedShaker` keeps the sums."""


@dataclass(frozen=True)
class ShakenMotion:
    """What happened in a stretch of steps; arrays of one value a step, means over the step."""

    amplifier_voltage: FloatArray
    """At the coil [V]."""
    base_acceleration: FloatArray
    """[m/s2]"""
    m0_velocity: FloatArray
    """[m/s]"""
    ends: FloatArray
    """Shape (steps, 9), columns MOTION_COLUMNS, at the ends of the steps; no rows unless asked for."""

    @classmethod
    def of(cls, count: int, end_rows: int) -> Self:
        """Make room for so many steps, and for the ends of the first of them."""
        ends = np.empty((end_rows, len(MOTION_COLUMNS)))
        return cls(np.empty(count), np.empty(count), np.empty(count), ends)


class MotionFailed(ArithmeticError):
    """The motion is no longer finite, or a contact makes no progress; nothing can follow it."""


class LoadedShaker:
    """Amplifier, shaker and specimen, moved by the voltage at the amplifier's input.

    Coil and table are solved exactly for a voltage and a force that are held over a step; the specimen
    exactly between its impacts, which are resolved inside a step (`vibench.sim.stepping`). The specimen's
    force on the table is extrapolated to the middle of the step, at a cost of about (5/12)(omega h)^2 of it
    (docs/decisions/0006-virtual-rig.md). One thread at a time.
    """

    def __init__(
        self,
        amplifier: Amplifier,
        shaker: Shaker,
        specimen: Specimen,
        step_s: float,
        start: ArrayLike = (0.0,) * 6,
    ) -> None:
        """Start with the table at rest.

        Raises ValueError when the step is not positive and finite, or the specimen cannot start so.

        Parameters
        ----------
        amplifier, shaker, specimen
            What is moved. A specimen of any contact law.
        step_s
            Length of a step [s]; a hundredth of the shortest period of interest errs by 1e-3.
        start
            The specimen's x, y, z, vx, vy, vz [m, m/s], absolute, shape (6,).

        """
        self.impacts = 0
        """Contacts begun since the start."""
        self.bumps = 0
        """Steps that the table has spent in its rubber stops."""
        self.limited_steps = 0
        """Steps in which the amplifier clipped or limited its current."""
        self._tables = _shaker_tables(amplifier, shaker, specimen, step_s)
        self._state = np.zeros(_STATE_SIZE)
        self._specimen = new_state(specimen, start)
        self._counts = np.zeros(3, dtype=np.int64)

    @property
    def gain(self) -> float:
        """Output volts of the amplifier per input volt; may be changed between stretches."""
        return self._tables.gain

    @gain.setter
    def gain(self, gain: float) -> None:
        self._tables = self._tables._replace(gain=gain)

    @property
    def parts(self) -> ShakerParts:
        """What a compiled loop around it moves; `account` says when it has."""
        self._counts[:] = 0
        return ShakerParts(self._state, self._specimen, self._tables, self._counts)

    def change_specimen(self, specimen: Specimen) -> None:
        """Go on with another specimen on the table, its masses where those of the last one are now.

        Raises ValueError when it cannot be there.
        """
        self._specimen = new_state(specimen, self._specimen[:6])
        self._tables = self._tables._replace(specimen=interval_tables(specimen, self._tables.step))

    def move(self, drive_v: FloatArray, noise_v: FloatArray | None = None, end_rows: int = 0) -> ShakenMotion:
        """Advance by as many steps as ``drive_v`` has values.

        Parameters
        ----------
        drive_v
            Mean voltage at the amplifier's input over each step [V], shape (steps,).
        noise_v
            Added at the amplifier's output [V], shape (steps,).
        end_rows
            For how many steps, counted from the first, the state at their ends is kept.

        Raises
        ------
        MotionFailed
            When the motion is no longer finite; this shaker cannot go on.

        """
        motion = ShakenMotion.of(len(drive_v), end_rows)
        self.move_into(motion, drive_v, np.zeros(len(drive_v)) if noise_v is None else noise_v)
        return motion

    def move_into(self, motion: ShakenMotion, drive_v: FloatArray, noise_v: FloatArray) -> None:
        """Advance like `move`, into arrays that are there."""
        good = move_shaker(
            drive_v,
            noise_v,
            self.parts,
            motion.amplifier_voltage,
            motion.base_acceleration,
            motion.m0_velocity,
            motion.ends,
        )
        self.account(good, len(drive_v))

    def account(self, good: int, count: int) -> None:
        """Add up what `move_shaker` counted in a stretch; MotionFailed when it did not finish."""
        if good < count:
            msg = (
                f"The specimen's motion was lost {good} steps into a stretch of {count}: it is not finite, "
                "or a contact made no progress. Lower the drive, or check it for values that are no numbers"
            )
            raise MotionFailed(msg)
        self.impacts += int(self._counts[0])
        self.bumps += int(self._counts[1])
        self.limited_steps += int(self._counts[2])


def _shaker_tables(amplifier: Amplifier, shaker: Shaker, specimen: Specimen, step_s: float) -> _ShakerTables:
    specimen_tables = interval_tables(specimen, step_s)
    equations = shaker.equations()
    inputs = equations.B.shape[1]
    joint = np.zeros((_SHAKER_SIZE + inputs, _SHAKER_SIZE + inputs))
    joint[:_SHAKER_SIZE] = np.hstack([equations.A, equations.B])
    low, high = (2 * np.pi * cut * step_s for cut in (amplifier.low_cut_hz, amplifier.high_cut_hz))
    return _ShakerTables(
        step=step_s,
        gain=amplifier.gain,
        low_decay=math.exp(-low),
        low_mean=_mean_of_decay(low),
        high_decay=math.exp(-high),
        high_mean=_mean_of_decay(high),
        clip=amplifier.clip_v,
        current_limit=amplifier.current_limit_a,
        transition=np.ascontiguousarray(expm(joint * step_s)[:_SHAKER_SIZE]),
        stroke=shaker.stroke_m,
        stop_stiffness=shaker.stop_stiffness_n_per_m,
        stop_damping=shaker.stop_damping_ns_per_m,
        specimen=specimen_tables,
    )


def _mean_of_decay(steps_per_time_constant: float) -> float:
    """Mean of exp(-t) from zero to the argument: 1 where nothing decays."""
    return -math.expm1(-steps_per_time_constant) / steps_per_time_constant if steps_per_time_constant else 1.0


@kernel
def move_shaker(
    drive: FloatArray,
    noise: FloatArray,
    parts: ShakerParts,
    amplifier_voltage: FloatArray,
    base_acceleration: FloatArray,
    m0_velocity: FloatArray,
    ends: FloatArray,
) -> int:
    """Advance step by step; return the steps done, fewer than asked for when the specimen failed."""
    state, specimen, tables, counts = parts
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
        if ends.shape[0] > n:
            ends[n, 0] = u1
            ends[n, 1] = v1
            ends[n, 2] = current
            ends[n, 3:9] = specimen[:6]
    return int(drive.size)


@kernel
def _amplified(volts: float, state: FloatArray, tables: _ShakerTables) -> float:
    """Mean output over a step of the amplifier as far as it is linear, its input held."""
    low, high = state[LOW_CUT], state[HIGH_CUT]
    below = volts + (low - volts) * tables.low_mean if tables.low_decay < 1.0 else 0.0
    state[LOW_CUT] = volts + (low - volts) * tables.low_decay
    passed = volts - below
    mean = passed + (high - passed) * tables.high_mean
    state[HIGH_CUT] = passed + (high - passed) * tables.high_decay
    return float(tables.gain * mean)


@kernel
def _stop_force(displacement: float, velocity: float, tables: _ShakerTables) -> float:
    """Force of the rubber stops on the table; they push and never pull."""
    if displacement > tables.stroke:
        pressed = tables.stop_stiffness * (displacement - tables.stroke) + tables.stop_damping * velocity
        return -max(pressed, 0.0)
    if displacement < -tables.stroke:
        pressed = tables.stop_stiffness * (-displacement - tables.stroke) - tables.stop_damping * velocity
        return max(pressed, 0.0)
    return 0.0
