"""Amplifier, coil, table and specimen under a voltage, with the specimen's force on the table.

All results are means over a time step. These means are exact, because the voltage is constant in a step and
the integrals of base acceleration and m0 velocity are known at both ends. Impacts do not alias in such means.
The means refer to the centre of the step, so that all channels agree in phase.
"""

import math
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..engine.run import Accuracy, cubic_tables, native_engine, start_at
from ..specimen.specimen import Floats, Specimen

STOP_STIFFNESS_N_PER_M = 2e5
"""Assumed stiffness of the rubber stops at the ends of the table's stroke: 45 N compress them by 0.23 mm."""
STOP_DAMPING_NS_PER_M = 50.0
"""Assumed damping of the rubber stops at the stroke's ends: a rebound halves the table's energy."""


@dataclass(frozen=True)
class Amplifier:
    """Amplifier: gain, two first-order band limits, and limits of voltage and current.

    The default amplifier does not change the voltage; use this amplifier for a voltage recorded at the coil.
    Raises ValueError when a number is not allowed.
    """

    gain: float = 1.0
    """Gain: output over input voltage, not zero; negative for an inverting amplifier."""
    low_cut_hz: float = 0.0
    """Lower -3 dB frequency of the amplifier [Hz]; 0 for DC coupling."""
    high_cut_hz: float = math.inf
    """Upper -3 dB frequency of the amplifier [Hz]."""
    clip_v: float = math.inf
    """Largest output voltage of the amplifier, peak [V]."""
    current_limit_a: float = math.inf
    """Largest current, peak [A]; the amplifier reduces its voltage to stay below this limit."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.gain) and self.gain):
            raise ValueError(f"A gain of {self.gain} is not allowed: it must be finite and not zero.")
        if not 0.0 <= self.low_cut_hz < self.high_cut_hz:
            raise ValueError(
                f"A band from {self.low_cut_hz} to {self.high_cut_hz} Hz is not allowed: the lower end must "
                "be 0 Hz or above, and below the upper end."
            )
        for name in ("clip_v", "current_limit_a"):
            if not getattr(self, name) > 0.0:
                raise ValueError(
                    f"{name} = {getattr(self, name)} is not allowed: it must be positive, or infinite."
                )


@dataclass(frozen=True)
class StateSpace:
    """Linear system s' = A s + B u; for a shaker s = (displacement, velocity, current) in SI units."""

    A: Floats
    """State matrix A, shape (3, 3)."""
    B: Floats
    """Input matrix, for the voltage at the coil [V] and an external force on the table [N], shape (3, 2)."""


@dataclass(frozen=True)
class Shaker:
    """Electrodynamic shaker: coil and suspended table, with rubber stops at the ends of the stroke.

    Raises ValueError when a number is not allowed.
    """

    moving_mass_kg: float
    """Mass of coil, table and fixture, without the specimen [kg]."""
    suspension_stiffness_n_per_m: float
    suspension_damping_ns_per_m: float
    force_constant_n_per_a: float
    """Force per current [N/A], equal to induced voltage per table velocity [V s/m] (Beranek, ch. 3)."""
    coil_resistance_ohm: float
    """Resistance of coil and cable in series [ohm]."""
    coil_inductance_h: float
    stroke_m: float = math.inf
    """Displacement from rest at which the table touches the rubber stops [m]."""
    stop_stiffness_n_per_m: float = STOP_STIFFNESS_N_PER_M
    stop_damping_ns_per_m: float = STOP_DAMPING_NS_PER_M

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not 0.0 < value <= (math.inf if each.name == "stroke_m" else 1e300):
                raise ValueError(f"{each.name} = {value} is not allowed: it must be positive.")

    def equations(self) -> StateSpace:
        """Return the equations of coil and table as a linear first-order system.

        With moving mass m, force constant G, coil voltage u and a force F on the table::

            m x'' + d x' + k x = G i + F          L i' + R i + G x' = u
        """
        mass, force_constant, inductance = (
            self.moving_mass_kg,
            self.force_constant_n_per_a,
            self.coil_inductance_h,
        )
        table = np.array(
            [-self.suspension_stiffness_n_per_m, -self.suspension_damping_ns_per_m, force_constant]
        )
        coil = np.array([0.0, -force_constant, -self.coil_resistance_ohm])
        return StateSpace(
            A=np.array([[0.0, 1.0, 0.0], table / mass, coil / inductance]),
            B=np.array([[0.0, 0.0], [0.0, 1 / mass], [1 / inductance, 0.0]]),
        )


MOTION_COLUMNS = ("base_displacement", "base_velocity", "current", "x", "y", "z", "vx", "vy", "vz")
"""States of shaker and specimen at the end of a step, in SI units; x, y and z are absolute."""
_SHAKER_SIZE = 3
_CONTACT_TOLERANCE = Accuracy.STANDARD.tolerance


@dataclass(frozen=True)
class ShakenMotion:
    """Motion in consecutive time steps; values are means over a step, shape (steps,)."""

    amplifier_voltage: Floats
    """Voltage at the coil [V]."""
    base_acceleration: Floats
    """Acceleration of the table [m/s2]."""
    m0_velocity: Floats
    """Absolute velocity of m0 [m/s]."""
    ends: Floats
    """States at the ends of the first ``rows`` steps, columns MOTION_COLUMNS, shape (rows, 9)."""
    contacts: Floats
    """Number of contacts up to the end of each block of steps, shape (blocks,); may be empty."""

    @classmethod
    def of(cls, count: int, end_rows: int, block: int = 0) -> Self:
        """Return arrays for ``count`` steps, ``end_rows`` states, and a contact count per ``block`` steps."""
        ends, begun = (
            np.empty((end_rows, len(MOTION_COLUMNS))),
            np.empty(math.ceil(count / block) if block else 0),
        )
        return cls(np.empty(count), np.empty(count), np.empty(count), ends, begun)


class MotionFailed(ArithmeticError):
    """Error: the motion is not finite, or a contact makes no progress; this shaker cannot be used further."""


class LoadedShaker:
    """Amplifier, shaker and specimen, driven by the voltage at the amplifier's input.

    Coil and table are solved exactly for a voltage and a force that are constant in a time step. The specimen
    is solved exactly between impacts; impacts are integrated within a step (native/cubic.hpp). The specimen's
    force on the table is extrapolated and constant in a step. This causes a relative error of (omega h)^2 /
    12 in the motion (docs/decisions/0006-virtual-rig.md). Use an object in one thread at a time.
    """

    def __init__(
        self,
        amplifier: Amplifier,
        shaker: Shaker,
        specimen: Specimen,
        step_s: float,
        start: ArrayLike = (0.0,) * 6,
    ) -> None:
        """Begin with the table at rest.

        Raises ValueError when the step is not positive and finite, or the start is not allowed.

        Parameters
        ----------
        amplifier, shaker, specimen
            Parts of the model; the specimen may have any contact law.
        step_s
            Length of a step [s]; a hundredth of the shortest period of interest gives an error of 1e-3.
        start
            Initial x, y, z, vx, vy, vz of the specimen in the inertial frame, shape (6,) [m, m/s].
        """
        engine = native_engine()
        self.structure = engine.new("LoadedShaker", step=step_s, tolerance=_CONTACT_TOLERANCE)
        """The `LoadedShaker` of native/structures.hpp that the engine advances."""
        self.step_s = step_s
        """Length of a time step [s]."""
        self._place(specimen, start)
        x, _, _, vx, _, _ = self.structure["specimen"]["motion"]
        self.structure["reactions_before"] = specimen.stiffnesses[0] * x + specimen.dampings[0] * vx
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
        self.structure["transition"] = scipy.linalg.expm(joint * step_s)[:_SHAKER_SIZE]

    @property
    def impacts(self) -> int:
        """Number of contacts since the first time step."""
        return int(self.structure["impacts"])

    @property
    def gain(self) -> float:
        """Ratio of output to input voltage of the amplifier; may be changed between calls of `move`."""
        return float(self.structure["gain"])

    @gain.setter
    def gain(self, gain: float) -> None:
        self.structure["gain"] = gain

    def change_specimen(self, specimen: Specimen) -> None:
        """Replace the specimen by another, which continues from the current state.

        Raises ValueError when the new specimen cannot have this state.
        """
        self._place(specimen, np.array(self.structure["specimen"]["motion"]))

    def _place(self, specimen: Specimen, motion: ArrayLike) -> None:
        engine = native_engine()
        tables, state = cubic_tables(engine, specimen, self.step_s), engine.new("State")
        start_at(engine, tables, specimen, state, motion, _CONTACT_TOLERANCE)
        engine.fill(self.structure, tables=tables, specimen=state)

    def move(
        self, drive_v: Floats, noise_v: Floats | None = None, end_rows: int = 0, block: int = 0
    ) -> ShakenMotion:
        """Advance by one step for each value of ``drive_v``, and return the motion.

        Raises MotionFailed when the motion is not finite; this shaker cannot be used further.

        Parameters
        ----------
        drive_v
            Mean voltage at the amplifier's input over each step [V], shape (steps,).
        noise_v
            Voltage that is added at the amplifier's output [V], shape (steps,).
        end_rows
            Number of steps, counted from the first, whose final states are stored.
        block
            Number of steps between two counts of the contacts; 0 for no counts.
        """
        drive = np.ascontiguousarray(drive_v, np.float64)
        motion = ShakenMotion.of(len(drive_v), end_rows, block)
        self.structure["block"] = block
        noise = np.zeros(len(drive)) if noise_v is None else np.ascontiguousarray(noise_v, np.float64)
        self.move_into(motion, drive, noise)
        return motion

    def move_into(self, motion: ShakenMotion, drive_v: Floats, noise_v: Floats) -> None:
        """Advance as `move` does, but write the motion into given arrays."""
        self.prepare(motion, drive_v, noise_v)
        self.account(native_engine().call("move_shaker", self.structure), len(drive_v))

    def prepare(self, motion: ShakenMotion, drive_v: Floats, noise_v: Floats) -> None:
        """Set the arrays that the engine reads and writes in the next steps."""
        native_engine().fill(
            self.structure,
            drive=drive_v,
            noise=noise_v,
            amplifier_voltage=motion.amplifier_voltage,
            base_acceleration=motion.base_acceleration,
            m0_velocity=motion.m0_velocity,
            ends=motion.ends,
            begun=motion.contacts,
        )

    def account(self, good: int, count: int) -> None:
        """Raise MotionFailed if only the first ``good`` of ``count`` time steps were completed."""
        if good < count:
            raise MotionFailed(
                f"The specimen's motion was lost after {good} of {count} steps: it is not finite, or a "
                "contact made no progress. Lower the drive, or check that all values of the drive are numbers"
            )


def _mean_of_decay(steps_per_time_constant: float) -> float:
    """Return the mean of exp(-t) for t between zero and the argument; 1 if the argument is zero."""
    return -math.expm1(-steps_per_time_constant) / steps_per_time_constant if steps_per_time_constant else 1.0
