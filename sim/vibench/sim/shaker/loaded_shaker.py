"""Amplifier, coil and table, and the specimen that pushes back on it, step by step under a voltage.

Every quantity handed over is its mean over a step: of the voltage because it is held, of the base's
acceleration and of m0's velocity because their integrals are known at both ends. Means alias nothing
that happens inside a step and all lie at the step's middle, so channels agree in phase.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from ..engine.cubic_run import cubic_tables, start_on_cubics
from ..engine.run import native_engine
from ..model.accuracy import Accuracy
from ..model.specimen import Specimen
from .parts import Amplifier, FloatArray, Shaker

MOTION_COLUMNS = ("base_displacement", "base_velocity", "current", "x", "y", "z", "vx", "vy", "vz")
"""Of shaker and specimen at the end of a step, SI units; x, y and z are absolute."""
_SHAKER_SIZE = 3
_CONTACT_TOLERANCE = Accuracy.STANDARD.tolerance


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
    exactly between its impacts, which are resolved inside a step (native/cubic.hpp). The specimen's
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
        engine = native_engine()
        self.structure = engine.new("LoadedShaker", step=step_s, tolerance=_CONTACT_TOLERANCE)
        """As the engine moves it."""
        self._step_s = step_s
        self._place(specimen, start)
        equations = shaker.equations()
        inputs = equations.B.shape[1]
        joint = np.zeros((_SHAKER_SIZE + inputs, _SHAKER_SIZE + inputs))
        joint[:_SHAKER_SIZE] = np.hstack([equations.A, equations.B])
        low, high = (2 * np.pi * cut * step_s for cut in (amplifier.low_cut_hz, amplifier.high_cut_hz))
        engine.fill(
            self.structure,
            gain=amplifier.gain,
            low_decay=math.exp(-low),
            low_mean=_mean_of_decay(low),
            high_decay=math.exp(-high),
            high_mean=_mean_of_decay(high),
            clip=amplifier.clip_v,
            current_limit=amplifier.current_limit_a,
            stroke=shaker.stroke_m,
            stop_stiffness=shaker.stop_stiffness_n_per_m,
            stop_damping=shaker.stop_damping_ns_per_m,
        )
        self.structure["transition"] = expm(joint * step_s)[:_SHAKER_SIZE]

    @property
    def impacts(self) -> int:
        """Contacts begun since the start."""
        return int(self.structure["impacts"])

    @property
    def bumps(self) -> int:
        """Steps that the table has spent in its rubber stops."""
        return int(self.structure["bumps"])

    @property
    def limited_steps(self) -> int:
        """Steps in which the amplifier clipped or limited its current."""
        return int(self.structure["limited_steps"])

    @property
    def gain(self) -> float:
        """Output volts of the amplifier per input volt; may be changed between stretches."""
        return float(self.structure["gain"])

    @gain.setter
    def gain(self, gain: float) -> None:
        self.structure["gain"] = gain

    def change_specimen(self, specimen: Specimen) -> None:
        """Go on with another specimen on the table, its masses where those of the last one are now.

        Raises ValueError when it cannot be there.
        """
        self._place(specimen, np.array(self.structure["specimen"]["motion"]))

    def _place(self, specimen: Specimen, motion: ArrayLike) -> None:
        engine = native_engine()
        tables, state = cubic_tables(engine, specimen, self._step_s), engine.new("State")
        start_on_cubics(engine, tables, specimen, state, motion, _CONTACT_TOLERANCE)
        engine.fill(self.structure, tables=tables, specimen=state)

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
        drive, motion = np.ascontiguousarray(drive_v, np.float64), ShakenMotion.of(len(drive_v), end_rows)
        noise = np.zeros(len(drive)) if noise_v is None else np.ascontiguousarray(noise_v, np.float64)
        self.move_into(motion, drive, noise)
        return motion

    def move_into(self, motion: ShakenMotion, drive_v: FloatArray, noise_v: FloatArray) -> None:
        """Advance like `move`, into arrays that are there."""
        self.prepare(motion, drive_v, noise_v)
        self.account(native_engine().call("move_shaker", self.structure), len(drive_v))

    def prepare(self, motion: ShakenMotion, drive_v: FloatArray, noise_v: FloatArray) -> None:
        """Lend the engine the arrays of a stretch."""
        native_engine().fill(
            self.structure,
            drive=drive_v,
            noise=noise_v,
            amplifier_voltage=motion.amplifier_voltage,
            base_acceleration=motion.base_acceleration,
            m0_velocity=motion.m0_velocity,
            ends=motion.ends,
        )

    def account(self, good: int, count: int) -> None:
        """Raise MotionFailed when only ``good`` steps of a stretch could be done."""
        if good < count:
            msg = (
                f"The specimen's motion was lost {good} steps into a stretch of {count}: it is not finite, "
                "or a contact made no progress. Lower the drive, or check it for values that are no numbers"
            )
            raise MotionFailed(msg)


def _mean_of_decay(steps_per_time_constant: float) -> float:
    """Mean of exp(-t) from zero to the argument: 1 where nothing decays."""
    return -math.expm1(-steps_per_time_constant) / steps_per_time_constant if steps_per_time_constant else 1.0
