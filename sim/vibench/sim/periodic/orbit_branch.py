"""Branches of exact periodic motions with impacts, along frequency or amplitude, through folds. SI units."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..specimen.drive import Harmonic, Parameter, ParameterWord
from ..specimen.specimen import Floats, state_scales
from ..specimen.stops import member
from .branch import Branch, OrbitReport
from .branch_following import (
    RANGE_LENGTH,
    AmplitudePath,
    DrivePath,
    Family,
    FrequencyPath,
    follow,
    follow_both_ways,
    parameter_value,
    range_scale,
)
from .continuation import ArcSteps
from .shooting import PeriodicOrbit, PeriodMap, ShootingEnd, describe_orbit

ORBIT_STEPS = ArcSteps(first=0.01, longest=0.1, shortest=1e-7, tolerance=1e-9, most_points=500)
"""Step lengths; the tolerance, 1e-9 gaps, is the smallest that reference accuracy can reach."""


@dataclass(frozen=True, eq=False)
class ExactFamily(ABC):
    """Periodic motions as fixed points of the period map."""

    mapping: PeriodMap
    reference: Harmonic
    """Reference drive, whose frequency scales the velocities."""
    tolerance: ClassVar = math.inf
    """Error limit for refining: none, because shooting has no resolution that could be increased."""

    @property
    def scales(self) -> Floats:
        """Scales of the six state variables, shape (6,) [m, m/s]."""
        return state_scales(self.mapping.specimen, self.reference)

    def closure(self, state: Floats, drive: Harmonic) -> tuple[Floats, Floats, Floats]:
        """Return the closure error after a period, its Jacobian, and the ratio of two sets of scales.

        The map scales velocities by the drive frequency, the family by the reference frequency.
        """
        ratio = state_scales(self.mapping.specimen, drive) / self.scales
        _, gone, derivative = next(self.mapping.iterates(state, drive))
        return ratio * gone, ratio[:, None] * derivative / ratio[None, :] - np.eye(6), ratio

    def refine(self, point: Floats, tangent: Floats) -> tuple[Family, Floats, Floats] | None:  # noqa: ARG002
        """Return None, because shooting has no finer resolution."""
        return None

    @abstractmethod
    def drive_at(self, point: Floats) -> Harmonic:
        """Return the drive at a point of the curve."""

    def state_at(self, point: Floats) -> Floats:
        """Return the state at time zero of the drive, for a point of the curve."""
        return point[:6] * self.scales

    def report(self, point: Floats) -> OrbitReport:
        """Return responses, Floquet multipliers and contacts of the motion at a point."""
        drive = self.drive_at(point)
        found = next(self.mapping.iterates(self.state_at(point), drive))
        return describe_orbit(self.mapping, drive, *found)


@dataclass(frozen=True, eq=False)
class OrbitFamily(ExactFamily):
    """Fixed points of the period map along a drive path; the last coordinate is parameter / scale."""

    path: DrivePath
    scale: float
    """Change of the parameter that counts as one unit of arc length [Hz, or m]."""

    def drive_at(self, point: Floats) -> Harmonic:
        """Return the drive at a point of the curve."""
        return Harmonic(*self.path.drive(float(point[-1]) * self.scale))

    def linearise(self, point: Floats) -> tuple[Floats, Floats]:
        """Return the closure error after a period, and its derivatives d/d(state) and d/d(parameter)."""
        if point[-1] <= 0.0:
            return np.full(6, math.nan), np.full((6, 7), math.nan)
        drive, state = self.drive_at(point), self.state_at(point)
        gone, by_state, ratio = self.closure(state, drive)
        by_frequency, by_amplitude = self.path.slopes(float(point[-1]) * self.scale)
        slope = np.zeros(6)
        if by_frequency != 0.0:
            slope += by_frequency / drive.frequency_hz * self.mapping.frequency_slope(state, drive)
        if by_amplitude != 0.0:
            slope += by_amplitude / drive.amplitude_m * self.mapping.amplitude_slope(state, drive)
        along = ratio * slope * self.scale
        return gone, np.column_stack([by_state, along])


def periodic_branch(
    orbit: PeriodicOrbit, parameter: Parameter | ParameterWord, stop: float, steps: ArcSteps = ORBIT_STEPS
) -> Branch:
    """Follow a periodic motion along frequency [Hz] or drive amplitude [m] to ``stop``.

    The branch ends at ``stop``, or at the starting value if the branch turns back that far. Folds are passed
    by pseudo-arclength continuation (Keller 1977).

    Raises ValueError when the orbit did not converge, or ``stop`` is not allowed.
    """
    parameter = member(Parameter, parameter)
    drive = orbit.drive
    is_frequency = parameter is Parameter.FREQUENCY
    path = FrequencyPath((drive.amplitude_m,)) if is_frequency else AmplitudePath(drive.frequency_hz)
    value = parameter_value(path, drive)
    if not 0.0 < stop < math.inf or stop == value:
        raise ValueError(f"A branch from {value} to {stop} is not allowed: give two different positive ends.")
    scale = abs(stop - value) / RANGE_LENGTH
    family, start = _family_at(orbit, path, value, scale)
    here, there = value / scale, stop / scale
    return follow(family, start, there - here, (min(here, there), max(here, there)), steps)


def periodic_branch_within(
    orbit: PeriodicOrbit, path: DrivePath, low: float, high: float, steps: ArcSteps = ORBIT_STEPS
) -> Branch:
    """Follow a periodic motion in both directions along a drive path, from ``low`` to ``high``.

    Return the whole branch, with its folds; without folds its parameter ascends. `Branch.begin` and
    `Branch.end` state the reasons for both ends of the branch. A closed branch is followed once around.
    Raises ValueError when the orbit did not converge, or is outside the range.

    Parameters
    ----------
    orbit
        Periodic motion whose drive is on the path and within the range.
    path
        `FrequencyPath` or `AmplitudePath`.
    low, high
        Ends of the range, ascending [Hz, or m].
    steps
        Step lengths and tolerances. In scaled units the range has length 10.
    """
    value = parameter_value(path, orbit.drive)
    family, start = _family_at(orbit, path, value, range_scale(low, high, value))
    return follow_both_ways(family, start, (low / family.scale, high / family.scale), steps)


def _family_at(
    orbit: PeriodicOrbit, path: DrivePath, value: float, scale: float
) -> tuple[OrbitFamily, Floats]:
    if orbit.outcome is not ShootingEnd.CONVERGED:
        raise ValueError(f"A branch cannot start at {orbit.drive}: {orbit.outcome}.")
    family = OrbitFamily(orbit.period_map, orbit.drive, path, scale)
    return family, np.append(orbit.state / family.scales, value / scale)
