"""Branches of exact periodic motions with impacts, along frequency or amplitude, through folds. SI units."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..kernels import Table, Vector
from ..model import Harmonic, chosen
from ..motion import state_scales
from ._branch import Branch, Parameter, ParameterWord
from ._branch_following import Family, OrbitReport, branch_range, follow
from ._continuation import ArcSteps
from ._period_map import PeriodMap
from ._shooting import PeriodicOrbit, ShootingEnd, described_orbit

ORBIT_STEPS = ArcSteps(first=0.01, longest=0.1, shortest=1e-7, tolerance=1e-9, most_points=500)
"""A residual below 1e-9 of the gap: what the flow at reference accuracy allows."""


@dataclass(frozen=True, eq=False)
class OrbitFamily:
    """Fixed points of the period map; the last component is the parameter over its scale."""

    mapping: PeriodMap
    parameter: Parameter
    drive: Harmonic
    """Gives what does not change."""
    scale: float
    """Hz, or m, per unit of length."""

    @property
    def tolerance(self) -> float:
        """None: the flow is exact, nothing can be left out."""
        return math.inf

    def drive_at(self, point: Vector) -> Harmonic:
        """Give the drive at a point."""
        value = float(point[-1]) * self.scale
        if self.parameter is Parameter.FREQUENCY:
            return replace(self.drive, frequency_hz=value)
        return replace(self.drive, amplitude_m=value)

    def state_at(self, point: Vector) -> Vector:
        """Give the state at the drive's time zero."""
        return point[:-1] * state_scales(self.mapping.specimen, self.drive)

    def linearised(self, point: Vector) -> tuple[Vector, Table]:
        """How far the motion goes in a period, and the derivatives by state and parameter."""
        if point[-1] <= 0.0:
            return np.full(6, math.nan), np.full((6, 7), math.nan)
        drive, state = self.drive_at(point), self.state_at(point)
        own = state_scales(self.mapping.specimen, self.drive)
        # The map measures velocities by the drive at the point, this family by one drive throughout.
        ratio = state_scales(self.mapping.specimen, drive) / own
        gone = (self.mapping.image(state, drive) - state) / own
        derivative = ratio[:, None] * self.mapping.derivative(state, drive) / ratio[None, :]
        slopes = {
            Parameter.FREQUENCY: self.mapping.frequency_slope,
            Parameter.AMPLITUDE: self.mapping.amplitude_slope,
        }
        along = ratio * slopes[self.parameter](state, drive) / point[-1]
        return gone, np.column_stack([derivative - np.eye(6), along])

    def report(self, point: Vector) -> OrbitReport:
        """Responses, multipliers and contacts."""
        orbit = described_orbit(self.mapping, self.drive_at(point), self.state_at(point), 0.0)
        return OrbitReport(
            frequency_hz=orbit.drive.frequency_hz,
            amplitude_m=orbit.drive.amplitude_m,
            response_i=orbit.response_i,
            response_ii=orbit.response_ii,
            state=orbit.state,
            signs=orbit.signs,
            left_out=0.0,
        )

    def refined(self, point: Vector, tangent: Vector) -> tuple[Family, Vector, Vector] | None:  # noqa: ARG002 - exact
        """None: there is no finer resolution."""
        return None


def periodic_branch(
    orbit: PeriodicOrbit, parameter: Parameter | ParameterWord, stop: float, steps: ArcSteps = ORBIT_STEPS
) -> Branch:
    """Follow a periodic motion along frequency [Hz] or drive amplitude [m], from where it is to ``stop``.

    The branch ends at ``stop``, or back at its start's value where it turned round.

    Raises
    ------
    ValueError
        When the orbit did not converge, or ``stop`` is not allowed.

    """
    parameter = chosen(Parameter, parameter)
    if orbit.outcome is not ShootingEnd.CONVERGED:
        msg = f"A branch cannot start at {orbit.drive}: {orbit.outcome}."
        raise ValueError(msg)
    value, scale = branch_range(parameter, orbit.drive.frequency_hz, orbit.drive.amplitude_m, stop)
    family = OrbitFamily(orbit.period_map, parameter, orbit.drive, scale)
    scales = state_scales(orbit.period_map.specimen, orbit.drive)
    start = np.append(orbit.state / scales, value / scale)
    here, there = value / scale, stop / scale
    bounds = (min(here, there), max(here, there))
    return follow(family, start, there - here, bounds, steps, parameter).branch
