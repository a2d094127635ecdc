"""Branches of harmonic balance: responses along frequency or amplitude, through folds. SI units."""

import math
from dataclasses import dataclass

import numpy as np

from ..model.arrays import Table, Vector
from ..model.drive import Harmonic
from ..model.state import Y, Z
from .balance_solver import BalanceOptions, Guess, described
from .branch import Branch
from .branch_following import DrivePath, OrbitReport, follow_both_ways, parameter_value, range_scale
from .condensation import LinearStructure
from .continuation import ArcSteps
from .floquet import Motion, crossings, multipliers, transition
from .frequency_time import phasors_of
from .harmonic_balance import (
    Balance,
    BalanceEnd,
    BalanceProblem,
    HarmonicSet,
    harmonics_up_to,
    with_harmonics,
)
from .orbit_events import OrbitSigns, Symmetry
from .restoring_force import RestoringForce
from .shooting import SAMPLES, PeriodicOrbit


@dataclass(frozen=True, eq=False)
class BalanceFamily:
    """Solutions of the balance at one number of harmonics; the last component is the parameter / scale."""

    problem: BalanceProblem
    path: DrivePath
    scale: float
    """Hz, or m, per unit of length."""
    options: BalanceOptions

    @property
    def tolerance(self) -> float:
        """Part of the fundamental of p."""
        return self.options.tolerance

    def drive(self, point: Vector) -> tuple[float, float]:
        """Frequency [Hz] and amplitude [m] at a point."""
        return self.path.drive(float(point[-1]) * self.scale)

    def linearised(self, point: Vector) -> tuple[Vector, Table]:
        """Residual and its derivatives by all unknowns and the parameter."""
        frequency, amplitude = self.drive(point)
        omega = 2.0 * math.pi * frequency
        residual, jacobian, by_omega, by_amplitude = self.problem.linearised(point[:-1], omega, amplitude)
        df, da = self.path.slopes(float(point[-1]) * self.scale)
        along = (2.0 * math.pi * df * by_omega + da * by_amplitude) * self.scale
        return residual, np.column_stack([jacobian, along])

    def report(self, point: Vector) -> OrbitReport:
        """Responses, multipliers and contacts."""
        found = self.balance_at(point)
        return OrbitReport(
            frequency_hz=found.frequency_hz,
            amplitude_m=found.amplitude_m,
            response_i=found.response_i,
            response_ii=found.response_ii,
            state=found.state,
            signs=orbit_signs(self.problem.structure, self.problem.spring, found, self.options.kept),
            left_out=found.left_out,
        )

    def balance_at(self, point: Vector) -> Balance:
        """Give the solution at a point."""
        frequency, amplitude = self.drive(point)
        return described(self.problem, point[:-1], frequency, amplitude, self.tolerance)

    def refined(self, point: Vector, tangent: Vector) -> "tuple[BalanceFamily, Vector, Vector] | None":
        """Twice the harmonics, the new ones of size zero."""
        highest = int(self.problem.harmonics[-1])
        more = min(2 * highest + 1, self.options.most)
        if more <= highest:
            return None
        harmonics = harmonics_up_to(more, self.options.kept)
        problem = BalanceProblem(self.problem.structure, self.problem.spring, harmonics)
        finer = BalanceFamily(problem, self.path, self.scale, self.options)
        return finer, self._carried(point, problem), self._carried(tangent, problem)

    def _carried(self, point: Vector, problem: BalanceProblem) -> Vector:
        phasors = self.problem.phasors(point[:-1])
        padded = with_harmonics(phasors, self.problem.harmonics, problem.harmonics)
        return np.append(problem.packed(padded), point[-1])


def orbit_signs(
    structure: LinearStructure, spring: RestoringForce, found: Balance, kept: HarmonicSet
) -> OrbitSigns:
    """Stability and contacts of a solution, by the exact variational equation along it."""
    motion = Motion(found.frequency_hz, found.harmonics, found.relative)
    contacts = len(crossings(spring, motion, 2.0 * math.pi)) // 2
    if kept is HarmonicSet.ODD:
        half = -transition(structure, spring, motion, math.pi)
        return OrbitSigns(multipliers(half), contacts, Symmetry.MIRRORED)
    return OrbitSigns(multipliers(transition(structure, spring, motion)), contacts, Symmetry.NONE)


def balance_branch_within(
    structure: LinearStructure,
    spring: RestoringForce,
    start: Balance,
    path: DrivePath,
    low: float,
    high: float,
    options: BalanceOptions = BalanceOptions(),  # noqa: B008 - frozen
    steps: ArcSteps = ArcSteps(),  # noqa: B008 - frozen
) -> Branch:
    """Follow a solution both ways along a drive path to the ends of a range, ascending [Hz, or m].

    As `periodic_branch_within`; harmonics are added where those left out would matter. Raises ValueError when
    the start did not converge, or lies outside.
    """
    if start.outcome is BalanceEnd.NO_SOLUTION:
        msg = f"A branch cannot start at {start.frequency_hz} Hz and {start.amplitude_m} m: {start.outcome}."
        raise ValueError(msg)
    value = parameter_value(path, Harmonic(start.frequency_hz, start.amplitude_m))
    scale = range_scale(low, high, value)
    problem = BalanceProblem(structure, spring, start.harmonics)
    point = np.append(problem.packed(start.relative), value / scale)
    family = BalanceFamily(problem, path, scale, options)
    return follow_both_ways(family, point, (low / scale, high / scale), steps)


SPECTRUM_SHARE = 8
"""Harmonics kept of an orbit's spectrum: one in eight of those that its samples could show."""


def orbit_guess(orbit: PeriodicOrbit) -> Guess:
    """Start a harmonic balance from an exact orbit of the drive's period."""
    states = orbit.period_map.orbit(orbit.state, orbit.drive, SAMPLES).states[:SAMPLES]
    harmonics = np.arange(SAMPLES // SPECTRUM_SHARE)
    return Guess(harmonics, phasors_of(states[:, Y] - states[:, Z])[harmonics])
