"""Branches of harmonic balance: responses along frequency or amplitude, through folds. SI units."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..specimen.drive import Harmonic
from ..specimen.specimen import Complex, Floats, Y, Z
from ..specimen.stops import member
from .branch import Branch, OrbitReport, OrbitShape, OrbitSigns
from .branch_following import DrivePath, follow_both_ways, parameter_value, range_scale
from .continuation import ArcSteps
from .first_order_balance import first_order_states
from .floquet import Motion, crossings, multipliers, transition
from .harmonic_balance import (
    Balance,
    BalanceEnd,
    BalanceProblem,
    Harmonics,
    HarmonicSet,
    LinearStructure,
    condense,
    force_harmonics,
    force_tail,
    harmonics_up_to,
    newton,
    phasors_of,
    with_harmonics,
)
from .restoring_force import PowerSpring, RestoringForce
from .shooting import SAMPLES, PeriodicOrbit

TAIL = 4
"""Ratio of the highest harmonic in the error estimate to the highest harmonic of the solution."""


@dataclass(frozen=True)
class BalanceOptions:
    """Options of a harmonic balance: numbers of harmonics, and tolerance."""

    kept: HarmonicSet = HarmonicSet.ODD
    fewest: int = 15
    """Highest harmonic of the first attempt to solve the balance."""
    most: int = 511
    """Highest harmonic of the last attempt to solve the balance."""
    tolerance: float = 1e-4
    """Largest allowed change of p due to neglected harmonics, relative to the fundamental of p."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "kept", member(HarmonicSet, self.kept))
        if not (1 <= self.fewest <= self.most and 0.0 < self.tolerance < math.inf):
            raise ValueError(
                f"From {self.fewest} to {self.most} harmonics at tolerance {self.tolerance} is not allowed: "
                "give at least 1 harmonic, ascending numbers, and a positive tolerance."
            )


@dataclass(frozen=True, eq=False)
class Guess:
    """Initial guess for Newton's iteration: the harmonics of p."""

    harmonics: Harmonics
    relative: Complex
    """Phasors P_k for the drive U = A0 sin(w t), shape (m,) [m]."""


def first_guess(
    structure: LinearStructure, spring: RestoringForce, frequency_hz: float, amplitude_m: float
) -> Guess:
    """Return an initial guess: for a power law the smallest first-order motion, else the linear motion."""
    match spring:
        case PowerSpring():
            return first_order_guesses(structure, spring, frequency_hz, amplitude_m)[0]
        case _:
            fundamental = np.array([1])
            seen = condense(structure, 2.0 * math.pi * frequency_hz, fundamental)
            return Guess(fundamental, np.array([-1j * amplitude_m * seen.linear]))


def first_order_guesses(
    structure: LinearStructure, spring: PowerSpring, frequency_hz: float, amplitude_m: float
) -> list[Guess]:
    """Return all first-order motions for a power law, as initial guesses."""
    states = first_order_states(structure, spring, frequency_hz, amplitude_m)
    return [Guess(np.array([1]), np.array([state.relative])) for state in states]


def balance(
    structure: LinearStructure,
    spring: RestoringForce,
    frequency_hz: float,
    amplitude_m: float,
    options: BalanceOptions = BalanceOptions(),
    start: Guess | None = None,
) -> Balance:
    """Return a motion with the drive's period that is near the initial guess.

    The number of harmonics is doubled until neglected harmonics change p by less than the tolerance. Check
    the ``outcome`` first: with NO_SOLUTION the result is only the best attempt.

    Parameters
    ----------
    structure, spring
        Linear part of the specimen, and nonlinear force along its direction b.
    frequency_hz, amplitude_m
        Frequency [Hz] and amplitude [m] of U = amplitude sin(2 pi frequency t); positive.
    options
        Harmonics and tolerance.
    start
        Initial guess, which selects one of several motions; by default `first_guess`. Strong contact needs a
        close guess, such as a solution at a neighbouring drive or an integrated orbit.
    """
    if not (0.0 < frequency_hz < math.inf and 0.0 < amplitude_m < math.inf):
        raise ValueError(
            f"A drive of {frequency_hz} Hz and {amplitude_m} m is not allowed: both must be positive."
        )
    if options.kept is HarmonicSet.ODD and not spring.is_odd:
        raise ValueError("Odd harmonics alone cannot describe unequal stops: choose HarmonicSet.ALL.")
    omega = 2.0 * math.pi * frequency_hz
    guess = first_guess(structure, spring, frequency_hz, amplitude_m) if start is None else start
    highest = options.fewest
    while True:
        harmonics = harmonics_up_to(highest, options.kept)
        problem = BalanceProblem(structure, spring, harmonics)
        seed = problem.pack(with_harmonics(guess.relative, guess.harmonics, harmonics))
        unknowns, is_solved = newton(problem, seed, omega, amplitude_m)
        found = balance_of_solution(problem, unknowns, frequency_hz, amplitude_m, options.tolerance)
        enough = is_solved and found.outcome is BalanceEnd.CONVERGED
        if enough or highest == options.most:
            return found if is_solved else replace(found, outcome=BalanceEnd.NO_SOLUTION)
        if is_solved:
            guess = Guess(harmonics, found.relative)
        highest = min(2 * highest + 1, options.most)


def balance_of_solution(
    problem: BalanceProblem, unknowns: np.ndarray, frequency_hz: float, amplitude_m: float, tolerance: float
) -> Balance:
    """Return a solution of the balance equations with its displacements, error estimate and outcome."""
    omega = 2.0 * math.pi * frequency_hz
    harmonics, phasors = problem.harmonics, problem.phasors(unknowns)
    seen = condense(problem.structure, omega, harmonics)
    force = force_harmonics(problem.spring, phasors, harmonics, omega).force
    drive = np.where(harmonics == 1, -1j * amplitude_m, 0.0)
    highest = int(problem.harmonics[-1])
    lines = force_tail(problem.spring, phasors, problem.harmonics, omega)
    beyond = np.arange(highest + 1, min(TAIL * highest, len(lines) - 1) + 1)
    moved = condense(problem.structure, omega, beyond).compliance * lines[beyond]
    fundamental = abs(phasors[int(np.searchsorted(problem.harmonics, 1))])
    left_out = float(np.sum(np.abs(moved)) / fundamental) if fundamental > 0.0 else math.inf
    return Balance(
        frequency_hz=frequency_hz,
        amplitude_m=amplitude_m,
        harmonics=harmonics,
        relative=phasors,
        displacements=drive[:, None] * seen.carried - seen.reach * force[:, None],
        left_out=left_out,
        outcome=BalanceEnd.CONVERGED if left_out <= tolerance else BalanceEnd.TOO_FEW_HARMONICS,
    )


@dataclass(frozen=True, eq=False)
class BalanceFamily:
    """Balances with a fixed number of harmonics along a path; the last coordinate is parameter / scale."""

    problem: BalanceProblem
    path: DrivePath
    scale: float
    """Change of the parameter that counts as one unit of arc length [Hz, or m]."""
    options: BalanceOptions

    @property
    def tolerance(self) -> float:
        """Largest allowed error of p due to neglected harmonics, relative to the fundamental of p."""
        return self.options.tolerance

    def drive(self, point: Floats) -> tuple[float, float]:
        """Return drive frequency [Hz] and amplitude [m] at a point of the curve."""
        return self.path.drive(float(point[-1]) * self.scale)

    def linearise(self, point: Floats) -> tuple[Floats, Floats]:
        """Return the residual of the balance, and its derivatives with respect to unknowns and parameter."""
        frequency, amplitude = self.drive(point)
        omega = 2.0 * math.pi * frequency
        residual, jacobian, by_omega, by_amplitude = self.problem.linearise(point[:-1], omega, amplitude)
        df, da = self.path.slopes(float(point[-1]) * self.scale)
        along = (2.0 * math.pi * df * by_omega + da * by_amplitude) * self.scale
        return residual, np.column_stack([jacobian, along])

    def report(self, point: Floats) -> OrbitReport:
        """Return responses, Floquet multipliers and contacts of the motion at a point."""
        frequency, amplitude = self.drive(point)
        found = balance_of_solution(self.problem, point[:-1], frequency, amplitude, self.tolerance)
        signs = orbit_signs(self.problem.structure, self.problem.spring, found, self.options.kept)
        drive = Harmonic(frequency, amplitude)
        return OrbitReport(drive, found.state, signs, found.response_i, found.response_ii, found.left_out)

    def refine(self, point: Floats, tangent: Floats) -> "tuple[BalanceFamily, Floats, Floats] | None":
        """Return the family with twice the harmonics (new harmonics are zero); None at the limit."""
        highest = int(self.problem.harmonics[-1])
        more = min(2 * highest + 1, self.options.most)
        if more <= highest:
            return None
        harmonics = harmonics_up_to(more, self.options.kept)
        problem = BalanceProblem(self.problem.structure, self.problem.spring, harmonics)
        finer = BalanceFamily(problem, self.path, self.scale, self.options)
        return finer, self._convert_point(point, problem), self._convert_point(tangent, problem)

    def _convert_point(self, point: Floats, problem: BalanceProblem) -> Floats:
        phasors = self.problem.phasors(point[:-1])
        padded = with_harmonics(phasors, self.problem.harmonics, problem.harmonics)
        return np.append(problem.pack(padded), point[-1])


def orbit_signs(
    structure: LinearStructure, spring: RestoringForce, found: Balance, kept: HarmonicSet
) -> OrbitSigns:
    """Return Floquet multipliers and contacts of a solution, from perturbations along the motion."""
    motion = Motion(found.frequency_hz, found.harmonics, found.relative)
    contacts = len(crossings(spring, motion, 2.0 * math.pi)) // 2
    if kept is HarmonicSet.ODD:
        half = -transition(structure, spring, motion, math.pi)
        return OrbitSigns(multipliers(half), contacts, OrbitShape.MIRRORED)
    return OrbitSigns(multipliers(transition(structure, spring, motion)), contacts, OrbitShape.REPEATED)


def balance_branch_within(
    structure: LinearStructure,
    spring: RestoringForce,
    start: Balance,
    path: DrivePath,
    low: float,
    high: float,
    options: BalanceOptions = BalanceOptions(),
    steps: ArcSteps = ArcSteps(),  # noqa: B008 - frozen
) -> Branch:
    """Follow a solution in both directions along a drive path, from ``low`` to ``high`` [Hz, or m].

    Points are ordered as in `periodic_branch_within`. Harmonics are added where the truncation error is
    above the tolerance. Raises ValueError when the start did not converge, or is outside the range.
    """
    if start.outcome is BalanceEnd.NO_SOLUTION:
        raise ValueError(
            f"A branch cannot start at {start.frequency_hz} Hz and {start.amplitude_m} m: {start.outcome}."
        )
    value = parameter_value(path, Harmonic(start.frequency_hz, start.amplitude_m))
    scale = range_scale(low, high, value)
    problem = BalanceProblem(structure, spring, start.harmonics)
    point = np.append(problem.pack(start.relative), value / scale)
    family = BalanceFamily(problem, path, scale, options)
    return follow_both_ways(family, point, (low / scale, high / scale), steps)


SPECTRUM_SHARE = 8
"""Number of samples per period and harmonic when harmonics are computed from an exact orbit."""


def orbit_guess(orbit: PeriodicOrbit) -> Guess:
    """Return the harmonics of an exact orbit with the drive's period, as an initial guess."""
    states = orbit.period_map.orbit(orbit.state, orbit.drive, SAMPLES).states[:SAMPLES]
    harmonics = np.arange(SAMPLES // SPECTRUM_SHARE)
    return Guess(harmonics, phasors_of(states[:, Y] - states[:, Z])[harmonics])
