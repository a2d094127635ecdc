"""Branches of harmonic balance: responses along frequency or amplitude, through folds. SI units.

Harmonic balance of a specimen under a drive, from the start that suits its contact. SI units.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..kernels import Table, Vector
from ..model import Harmonic, Specimen, Y, Z, chosen
from ._balance_solver import BalanceOptions, Guess, balance, described, linear_guess
from ._branch import Branch, Parameter, ParameterWord
from ._branch_following import (
    Followed,
    OrbitReport,
    branch_range,
    follow,
    follow_both_ways,
    parameter_value,
    range_scale,
)
from ._condensation import LinearStructure, condense, structure_of
from ._continuation import ArcEnd, ArcSteps
from ._drive_path import DrivePath, path_from
from ._floquet import Motion, crossings, multipliers, transition
from ._frequency_time import phasors_of
from ._harmonic_balance import (
    Balance,
    BalanceEnd,
    BalanceProblem,
    HarmonicSet,
    harmonics_up_to,
    with_harmonics,
)
from ._orbit_events import OrbitSigns, Symmetry
from ._restoring_force import RestoringForce, spring_of
from ._shooting import SAMPLES, PeriodicOrbit, ShootingEnd, periodic_orbit

SAFE_SHARE = 0.1
"""A power law hardly bends the response while p stays below this part of its length scale."""


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


def harmonic_balance_branch(
    structure: LinearStructure,
    spring: RestoringForce,
    start: Balance,
    parameter: Parameter | ParameterWord,
    stop: float,
    options: BalanceOptions = BalanceOptions(),  # noqa: B008 - frozen
    steps: ArcSteps = ArcSteps(),  # noqa: B008 - frozen
) -> Branch:
    """Follow a solution along frequency [Hz] or drive amplitude [m], from where it is to ``stop``.

    The branch ends at ``stop``, or back at its start's value where it turned round. Harmonics are added
    where those left out would matter.

    Raises
    ------
    ValueError
        When the start did not converge, or is where the branch shall stop.

    """
    return _followed(structure, spring, start, chosen(Parameter, parameter), stop, options, steps).branch


def _followed(
    structure: LinearStructure,
    spring: RestoringForce,
    start: Balance,
    parameter: Parameter,
    stop: float,
    options: BalanceOptions,
    steps: ArcSteps,
) -> Followed:
    _refuse_no_solution(start)
    value, scale = branch_range(parameter, start.frequency_hz, start.amplitude_m, stop)
    path = path_from(parameter, start.frequency_hz, start.amplitude_m)
    family, point = _family_at(structure, spring, start, path, value, scale, options)
    here, there = value / scale, stop / scale
    return follow(family, point, there - here, (min(here, there), max(here, there)), steps)


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
    _refuse_no_solution(start)
    value = parameter_value(path, Harmonic(start.frequency_hz, start.amplitude_m))
    scale = range_scale(low, high, value)
    family, point = _family_at(structure, spring, start, path, value, scale, options)
    return follow_both_ways(family, point, (low / scale, high / scale), steps)


def _refuse_no_solution(start: Balance) -> None:
    if start.outcome is BalanceEnd.NO_SOLUTION:
        msg = f"A branch cannot start at {start.frequency_hz} Hz and {start.amplitude_m} m: {start.outcome}."
        raise ValueError(msg)


def _family_at(
    structure: LinearStructure,
    spring: RestoringForce,
    start: Balance,
    path: DrivePath,
    value: float,
    scale: float,
    options: BalanceOptions,
) -> tuple[BalanceFamily, Vector]:
    problem = BalanceProblem(structure, spring, start.harmonics)
    family = BalanceFamily(problem, path, scale, options)
    return family, np.append(problem.packed(start.relative), value / scale)


def raised_balance(
    structure: LinearStructure,
    spring: RestoringForce,
    frequency_hz: float,
    amplitude_m: float,
    options: BalanceOptions = BalanceOptions(),  # noqa: B008 - frozen
    steps: ArcSteps = ArcSteps(),  # noqa: B008 - frozen
) -> tuple[Balance, Branch]:
    """Find the motion that is reached by raising the drive from nothing: along the branch, through folds.

    Gives the motion, and the branch along amplitude that leads there. Where the branch was lost on the
    way, the motion's outcome is NO_SOLUTION.
    """
    seen = condense(structure, 2.0 * math.pi * frequency_hz, np.array([1]))
    weak = min(0.5 * amplitude_m, SAFE_SHARE * spring.length / max(abs(seen.linear), 1e-300))
    start = balance(structure, spring, frequency_hz, weak, options)
    followed = _followed(structure, spring, start, Parameter.AMPLITUDE, amplitude_m, options, steps)
    family, branch = followed.family, followed.branch
    assert isinstance(family, BalanceFamily)
    found = family.balance_at(followed.last)
    if branch.end is ArcEnd.REACHED_BOUND and found.amplitude_m > weak:
        return found, branch
    return replace(found, outcome=BalanceEnd.NO_SOLUTION), branch


SPECTRUM_SHARE = 8
"""Harmonics kept of an orbit's spectrum: one in eight of those that its samples could show."""

CONTACT_HARMONICS = 255
"""With fewer, a balance of stiff stops may settle on a motion that is none."""


def orbit_guess(orbit: PeriodicOrbit) -> Guess:
    """Start a harmonic balance from an exact orbit of the drive's period."""
    states = orbit.period_map.orbit(orbit.state, orbit.drive, SAMPLES).states[:SAMPLES]
    harmonics = np.arange(SAMPLES // SPECTRUM_SHARE)
    return Guess(harmonics, phasors_of(states[:, Y] - states[:, Z])[harmonics])


def balance_specimen(
    specimen: Specimen,
    drive: Harmonic,
    options: BalanceOptions = BalanceOptions(),  # noqa: B008 - frozen
) -> Balance:
    """Find the periodic motion of a specimen by harmonic balance.

    A motion that meets stops starts from the exact orbit that shooting finds behind a run from rest; a
    smooth spring from its first-order motion, and if that fails from the branch from a weak drive upwards.
    The drive's phase must be zero. Look at ``outcome`` first: in chaos the motion found, if any, is unstable.

    Raises
    ------
    ValueError
        When the drive has a phase, or the stops are rigid.

    """
    if drive.phase_rad != 0.0:
        msg = f"Drive phase {drive.phase_rad} rad is not allowed: harmonic balance takes phase zero."
        raise ValueError(msg)
    structure, spring = structure_of(specimen), spring_of(specimen)
    where = drive.frequency_hz, drive.amplitude_m
    if spring.kinks and abs(linear_guess(structure, *where).relative[0]) > spring.length:
        orbit = periodic_orbit(specimen, drive)
        if orbit.outcome is ShootingEnd.CONVERGED:
            many = replace(options, fewest=min(options.most, max(options.fewest, CONTACT_HARMONICS)))
            return balance(structure, spring, *where, many, orbit_guess(orbit))
    found = balance(structure, spring, *where, options)
    if found.outcome is BalanceEnd.NO_SOLUTION and not spring.kinks:
        return raised_balance(structure, spring, *where, options)[0]
    return found
