"""One periodic motion by harmonic balance: enough harmonics, and a verdict on the result. SI units."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..model.arrays import Complex
from ..model.stops import chosen
from .condensation import Harmonics, LinearStructure, condense
from .first_order_balance import first_order_states
from .frequency_time import force_harmonics, force_tail
from .harmonic_balance import (
    Balance,
    BalanceEnd,
    BalanceProblem,
    HarmonicSet,
    harmonics_up_to,
    newton,
    with_harmonics,
)
from .restoring_force import PowerSpring, RestoringForce

TAIL = 4
"""Left-out harmonics are judged up to this multiple of the highest one kept."""


@dataclass(frozen=True)
class BalanceOptions:
    """How many harmonics, and how exactly."""

    kept: HarmonicSet = HarmonicSet.ODD
    fewest: int = 15
    """Highest harmonic of the first attempt."""
    most: int = 511
    """Highest harmonic ever."""
    tolerance: float = 1e-4
    """Part of the fundamental of p that the harmonics left out may move it by."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "kept", chosen(HarmonicSet, self.kept))
        if not (1 <= self.fewest <= self.most and 0.0 < self.tolerance < math.inf):
            msg = (
                f"From {self.fewest} to {self.most} harmonics at tolerance {self.tolerance} is not allowed: "
                "at least 1, ascending, and positive."
            )
            raise ValueError(msg)


@dataclass(frozen=True, eq=False)
class Guess:
    """Where Newton's iteration begins: a motion of p in harmonics."""

    harmonics: Harmonics
    relative: Complex
    """P_k under U = A0 sin(w t), shape (m,) [m]."""


def linear_guess(structure: LinearStructure, frequency_hz: float, amplitude_m: float) -> Guess:
    """Start from the motion without the spring."""
    fundamental = np.array([1])
    seen = condense(structure, 2.0 * math.pi * frequency_hz, fundamental)
    return Guess(fundamental, np.array([-1j * amplitude_m * seen.linear]))


def first_guess(
    structure: LinearStructure, spring: RestoringForce, frequency_hz: float, amplitude_m: float
) -> Guess:
    """Start from the weakest first-order motion of a power law, else from the motion without the spring."""
    match spring:
        case PowerSpring():
            return first_order_guesses(structure, spring, frequency_hz, amplitude_m)[0]
        case _:
            return linear_guess(structure, frequency_hz, amplitude_m)


def first_order_guesses(
    structure: LinearStructure, spring: PowerSpring, frequency_hz: float, amplitude_m: float
) -> list[Guess]:
    """Start from each of the first-order motions of a power law."""
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
    """Find one periodic motion of the drive's period, with as many harmonics as it needs.

    The number of harmonics doubles until those left out would move p by less than the tolerance.

    Parameters
    ----------
    structure, spring
        The linear part, and the force along its direction.
    frequency_hz, amplitude_m
        Of U = amplitude sin(2 pi frequency t); positive.
    options
        Harmonics and tolerance.
    start
        Which of several motions is found depends on it; `first_guess` when None. Strong contact needs
        a near one, for instance a neighbour's or an integrated orbit's.

    Returns
    -------
    The motion; look at ``outcome`` first. After NO_SOLUTION its numbers are those of the best attempt.

    """
    if not (0.0 < frequency_hz < math.inf and 0.0 < amplitude_m < math.inf):
        msg = f"A drive of {frequency_hz} Hz and {amplitude_m} m is not allowed: both must be positive."
        raise ValueError(msg)
    if options.kept is HarmonicSet.ODD and not spring.is_odd:
        msg = "Odd harmonics alone cannot describe unequal stops: choose HarmonicSet.ALL."
        raise ValueError(msg)
    omega = 2.0 * math.pi * frequency_hz
    guess = first_guess(structure, spring, frequency_hz, amplitude_m) if start is None else start
    highest = options.fewest
    while True:
        harmonics = harmonics_up_to(highest, options.kept)
        problem = BalanceProblem(structure, spring, harmonics)
        seed = problem.packed(with_harmonics(guess.relative, guess.harmonics, harmonics))
        unknowns, is_solved = newton(problem, seed, omega, amplitude_m)
        found = described(problem, unknowns, frequency_hz, amplitude_m, options.tolerance)
        enough = is_solved and found.outcome is BalanceEnd.CONVERGED
        if enough or highest == options.most:
            return found if is_solved else replace(found, outcome=BalanceEnd.NO_SOLUTION)
        if is_solved:
            guess = Guess(harmonics, found.relative)
        highest = min(2 * highest + 1, options.most)


def described(
    problem: BalanceProblem, unknowns: np.ndarray, frequency_hz: float, amplitude_m: float, tolerance: float
) -> Balance:
    """Turn a solution of the equations into motions of every mass, and judge what was left out."""
    omega = 2.0 * math.pi * frequency_hz
    harmonics, phasors = problem.harmonics, problem.phasors(unknowns)
    seen = condense(problem.structure, omega, harmonics)
    force = force_harmonics(problem.spring, phasors, harmonics, omega).force
    drive = np.where(harmonics == 1, -1j * amplitude_m, 0.0)
    left_out = _left_out(problem, phasors, omega)
    return Balance(
        frequency_hz=frequency_hz,
        amplitude_m=amplitude_m,
        harmonics=harmonics,
        relative=phasors,
        displacements=drive[:, None] * seen.carried - seen.reach * force[:, None],
        left_out=left_out,
        outcome=BalanceEnd.CONVERGED if left_out <= tolerance else BalanceEnd.TOO_FEW_HARMONICS,
    )


def _left_out(problem: BalanceProblem, phasors: Complex, omega: float) -> float:
    highest = int(problem.harmonics[-1])
    lines = force_tail(problem.spring, phasors, problem.harmonics, omega)
    beyond = np.arange(highest + 1, min(TAIL * highest, len(lines) - 1) + 1)
    moved = condense(problem.structure, omega, beyond).compliance * lines[beyond]
    fundamental = abs(phasors[int(np.searchsorted(problem.harmonics, 1))])
    return float(np.sum(np.abs(moved)) / fundamental) if fundamental > 0.0 else math.inf
