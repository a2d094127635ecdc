"""What a whole or half period makes of a state, exactly, and of a small change of it. SI units.

A mirrored motion comes back with all signs changed after half a drive period, so that it is a fixed point
of the half map: the flow over half a period, then the mirror. The derivative by the state is exact: it is
carried along with the motion, so that it holds up to a grazing contact (on a rigid stop it grows beyond all
bounds there, as the map's own does). Those by frequency and amplitude are fourth-order central differences at
reference accuracy, with steps far above its error (1e-10) and far below the gap: five to seven digits, and
only Newton's iteration uses them.
"""

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

import numpy as np

from ..model.accuracy import Accuracy
from ..model.arrays import Table, Vector
from ..model.drive import Harmonic
from ..model.outcome import Outcome
from ..model.rigid_stops import RigidStops
from ..model.specimen import Specimen
from ..model.state import Y, Z
from ..motion.flow_derivative import flow_derivative
from ..motion.integrate import Trajectory, integrate
from ..motion.poincare import state_scales

DIFFERENCE = 1e-5
"""Step of a difference, over the parameter."""
OFFSETS, WEIGHTS = (-2.0, -1.0, 1.0, 2.0), (1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0)
"""Fourth-order central difference."""


class OrbitShape(StrEnum):
    """How a periodic motion repeats."""

    MIRRORED = "mirrored"
    """Its mirror image after half an odd number of drive periods; needs equal stops."""
    REPEATED = "repeated"
    """Itself after a whole number of drive periods."""


OrbitShapeWord = Literal["mirrored", "repeated"]


@dataclass(frozen=True, eq=False)
class PeriodMap:
    """The map whose fixed points are periodic motions; states over their scales."""

    specimen: Specimen
    shape: OrbitShape = OrbitShape.REPEATED
    periods: int = 1
    """Drive periods of the whole motion."""

    def __post_init__(self) -> None:
        if self.periods < 1:
            msg = f"A motion of {self.periods} periods is not allowed: 1 or more."
            raise ValueError(msg)
        if self.shape is OrbitShape.MIRRORED and self.periods % 2 == 0:
            msg = f"A mirrored motion of {self.periods} periods cannot be: an odd number, or a repeated one."
            raise ValueError(msg)

    @property
    def turns(self) -> float:
        """Drive periods that the map takes."""
        return 0.5 * self.periods if self.shape is OrbitShape.MIRRORED else float(self.periods)

    @property
    def simpler(self) -> "PeriodMap | None":
        """Map of a motion of half the period, or of one that mirrors itself, which this one may become."""
        if self.shape is OrbitShape.MIRRORED:
            return None
        if self.periods % 2 == 0:
            return replace(self, periods=self.periods // 2)
        lower, upper = self.specimen.gaps_m
        return replace(self, shape=OrbitShape.MIRRORED) if lower == upper else None

    def image(self, state: Vector, drive: Harmonic) -> Vector:
        """State that the map makes of ``state``, shape (6,), at the drive's phase zero; NaN if lost."""
        if not self._may_start(state):
            return np.full(6, math.nan)
        run = self._run(state, drive, self.turns)
        if run.outcome is not Outcome.REACHED_END:
            return np.full(6, math.nan)
        return -run.final_state if self.shape is OrbitShape.MIRRORED else run.final_state

    def orbit(self, state: Vector, drive: Harmonic, samples: int) -> Trajectory:
        """Follow the whole motion, sampled ``samples`` times a drive period."""
        return self._run(state, drive, float(self.periods), samples * drive.frequency_hz)

    def derivative(self, state: Vector, drive: Harmonic) -> Table:
        """D image / d state, both over their scales, shape (6, 6)."""
        if not self._may_start(state):
            return np.full((6, 6), math.nan)
        scales = state_scales(self.specimen, drive)
        duration = self.turns / drive.frequency_hz
        _, derivative = flow_derivative(self.specimen, drive, state, duration, Accuracy.REFERENCE)
        scaled = derivative * scales / scales[:, None]
        return -scaled if self.shape is OrbitShape.MIRRORED else scaled

    def frequency_slope(self, state: Vector, drive: Harmonic) -> Vector:
        """D image / d ln frequency, over the scales, shape (6,)."""
        scales = state_scales(self.specimen, drive)
        drives = [
            replace(drive, frequency_hz=drive.frequency_hz * (1.0 + offset * DIFFERENCE))
            for offset in OFFSETS
        ]
        images = [self.image(state, each) for each in drives]
        return np.asarray(np.dot(WEIGHTS, images) / (DIFFERENCE * scales))

    def amplitude_slope(self, state: Vector, drive: Harmonic) -> Vector:
        """D image / d ln amplitude, over the scales, shape (6,)."""
        scales = state_scales(self.specimen, drive)
        factors = [1.0 + offset * DIFFERENCE for offset in OFFSETS]
        drives = [replace(drive, amplitude_m=drive.amplitude_m * factor) for factor in factors]
        images = [self.image(state, each) for each in drives]
        return np.asarray(np.dot(WEIGHTS, images) / (DIFFERENCE * scales))

    def _may_start(self, state: Vector) -> bool:
        """Refuse a start behind a rigid stop: an iteration that tries one has gone astray."""
        match self.specimen.contact:
            case RigidStops():
                lower, upper = self.specimen.gaps_m
                return bool(-lower <= state[Y] - state[Z] <= upper)
            case _:
                return bool(np.all(np.isfinite(state)))

    def _run(
        self, state: Vector, drive: Harmonic, turns: float, sample_rate_hz: float | None = None
    ) -> Trajectory:
        return integrate(
            self.specimen,
            drive,
            turns / drive.frequency_hz,
            Accuracy.REFERENCE,
            state,
            sample_rate_hz=sample_rate_hz,
        )
