"""Explicit Runge-Kutta methods without detection of contacts, for comparison. SI units.

Their steps cross a contact at arbitrary points; the error changes the energy of every impact, and the
exponent of chaos. Dormand and Prince's pair is controlled like MATLAB's `ode45` (Shampine and Reichelt, The
MATLAB ODE Suite, SIAM J. Sci. Comput. 18, 1997), with its default tolerances.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import RK45

from vibench.sim import Harmonic, Specimen
from vibench.sim.accuracy_benchmark.equations import Place, law_of, numbers_of, rates

from .responses import Reals

APART_M = 1e-11
"""Distance of the neighbour for an exponent; far below any indentation, far above rounding errors."""
READING_S = 1e-3
"""Interval between measurements of that distance."""
LOST_M = 1.0
"""Displacement beyond which a motion has diverged."""
SLOWEST_PER_S = 1e-9
"""Reference speed of a state initially at rest."""


class Tableau(NamedTuple):
    """Coefficients of a method (Hairer, Norsett and Wanner, Solving ODEs I, sections II.1 and II.5)."""

    nodes: Reals
    stages: Reals
    """Shape (stages, stages), strictly lower."""
    result: Reals
    error: Reals
    """Error coefficients; zero for a method without error estimate."""


@dataclass(frozen=True)
class TextbookMethod:
    """A method with fixed steps or with steps controlled by tolerances."""

    name: str
    tableau: Tableau
    longest_s: float
    relative: float = math.inf
    absolute: float = 1.0
    """Absolute tolerance, both in metres and in metres per second."""


_RUNGE_KUTTA = Tableau(
    np.array([0.0, 0.5, 0.5, 1.0]),
    np.diag([0.5, 0.5, 1.0], -1),
    np.array([1.0, 2.0, 2.0, 1.0]) / 6.0,
    np.zeros(4),
)
_FIFTH = np.append(RK45.B, 0.0)
_DORMAND_PRINCE = Tableau(
    np.append(RK45.C, 1.0), np.vstack([np.pad(RK45.A, ((0, 0), (0, 2))), _FIFTH]), _FIFTH, RK45.E
)


def runge_kutta(step_s: float) -> TextbookMethod:
    """Return the classical fourth-order method with fixed steps.

    Raises ValueError when the step is not positive and finite.
    """
    if not 0.0 < step_s < math.inf:
        raise ValueError(f"A step of {step_s} s is not allowed: it must be positive and finite.")
    return TextbookMethod(f"Runge-Kutta, steps of {step_s:g} s", _RUNGE_KUTTA, step_s)


def ode45(relative: float = 1e-3, absolute: float = 1e-6, longest_s: float = 3.0) -> TextbookMethod:
    """Return Dormand and Prince's pair, controlled as in MATLAB; the defaults are MATLAB's for 30 s.

    Raises ValueError when a tolerance or the longest step is not positive and finite.
    """
    if not all(0.0 < each < math.inf for each in (relative, absolute, longest_s)):
        raise ValueError(
            f"Tolerances of {relative} and {absolute} with steps up to {longest_s} s are not allowed: "
            "each must be positive and finite."
        )
    name = f"ode45, tolerances {relative:g} and {absolute:g}"
    return TextbookMethod(name, _DORMAND_PRINCE, longest_s, relative, absolute)


def textbook_states(
    specimen: Specimen, drive: Harmonic, method: TextbookMethod, duration_s: float, initial_states: ArrayLike
) -> Reals:
    """Integrate motions from time zero and return their final states, shape (n, 6); NaN after divergence.

    ``initial_states`` has shape (n, 6): x, y, z, vx, vy, vz, absolute [m, m/s]. Raises ValueError for rigid
    stops.
    """
    states = np.array(initial_states, dtype=np.float64).T
    drives = [drive] * states.shape[1]
    ends, _ = _march(states[:, np.newaxis], duration_s, duration_s, specimen, drives, method)
    return ends[:, 0].T


def textbook_exponents(
    specimen: Specimen,
    drives: Sequence[Harmonic],
    method: TextbookMethod,
    duration_s: float = 25.0,
    settle_s: float = 5.0,
) -> Reals:
    """Return the largest Lyapunov exponents of a method for motions from rest [1/s]; NaN after divergence.

    Mean divergence rate of a neighbour with the same steps, over ``duration_s`` after ``settle_s``. The
    resolution for regular motions is about 1 / ``duration_s``. Shape (n,), one per drive; all motions are
    integrated together.
    Raises ValueError for rigid stops.
    """
    states = np.zeros((6, 2, len(drives)))
    states[:, 1] = APART_M / math.sqrt(6.0) * _scales(drives)
    return _march(states, settle_s + duration_s, settle_s, specimen, drives, method)[1]


def _scales(drives: Sequence[Harmonic]) -> Reals:
    speeds = [2.0 * math.pi * drive.frequency_hz for drive in drives]
    return np.repeat([np.ones(len(drives)), speeds], 3, axis=0)


def _largest(change: Reals, one: Reals, other: Reals, floor: float) -> Reals:
    """Return the largest change of any component, relative to the larger of two states."""
    beside = np.maximum(np.maximum(np.abs(one), np.abs(other)), floor)
    return np.asarray(np.max(np.abs(change) / beside, axis=0))


def _next_steps(step_s: Reals, error: Reals, failures: Reals, method: TextbookMethod) -> Reals:
    """Return the next step lengths as `ode45` does; ``failures`` is the number of consecutive failures."""
    if method.relative == math.inf:
        return np.full_like(step_s, method.longest_s)
    # A step without error grows by the largest factor; after a non-finite error the next step is a tenth.
    part = 1.25 * (error / method.relative) ** 0.2
    shorter = np.where(failures > 0, 0.5, np.fmax(0.1, 1.0 / np.maximum(part, 0.2)))
    longer = np.where(failures > 0, step_s, np.minimum(method.longest_s, step_s / np.maximum(part, 0.2)))
    return np.where(error <= method.relative, longer, shorter * step_s)


def _march(
    states: Reals,
    until_s: float,
    settle_s: float,
    specimen: Specimen,
    drives: Sequence[Harmonic],
    method: TextbookMethod,
) -> tuple[Reals, Reals]:
    """Integrate states, and optional neighbours, to a time; return them and the divergence rates.

    ``states`` has shape (6, 1 or 2, motions); the second entry is the neighbour.
    """
    tableau, law, scales = method.tableau, law_of(specimen), _scales(drives)
    numbers = np.array([numbers_of(specimen, drive) for drive in drives]).reshape(-1, 12).T
    has_neighbour, count = states.shape[1] > 1, len(drives)
    floor = method.absolute / method.relative if method.relative < math.inf else 1.0
    slopes = np.zeros((len(tableau.nodes), *states.shape))
    rows = slopes.reshape(len(slopes), -1)
    time_s, read_s, growth, failures = np.zeros((4, count))
    since_s = np.full(count, until_s if settle_s > 0.0 else 0.0)
    first = rates(time_s, states[:, 0], Place.ANYWHERE, law, numbers)
    fastest = np.maximum(_largest(first, states[:, 0], states[:, 0], floor), SLOWEST_PER_S)
    step_s = np.minimum(method.longest_s, 0.8 * method.relative**0.2 / fastest)
    while np.any(running := time_s < until_s):
        step_s = np.minimum(step_s, np.where(running, until_s - time_s, 0.0))
        for number, node in enumerate(tableau.nodes):
            at = states + step_s * (tableau.stages[number, :number] @ rows[:number]).reshape(states.shape)
            slopes[number] = rates(time_s + node * step_s, at, Place.ANYWHERE, law, numbers)
        after = states + step_s * (tableau.result @ rows).reshape(states.shape)
        change = step_s * (tableau.error @ rows).reshape(states.shape)[:, 0]
        error = _largest(change, states[:, 0], after[:, 0], floor)
        is_good = error <= method.relative
        is_lost = running & ((time_s + step_s == time_s) | (is_good & ~(np.abs(after[1, 0]) < LOST_M)))
        states = np.where(is_lost, np.nan, np.where(is_good, after, states))
        time_s = np.where(is_lost, until_s, np.where(is_good, time_s + step_s, time_s))
        step_s = _next_steps(step_s, error, failures, method)
        failures = np.where(is_good, 0.0, failures + 1.0)
        is_read = running & is_good & ~is_lost & (time_s >= read_s + READING_S)
        if has_neighbour and np.any(is_read):
            parted = (states[:, 1] - states[:, 0]) / scales
            apart = np.where(is_read, np.sqrt((parted**2).sum(axis=0)) / APART_M, 1.0)
            growth += np.log(apart) * (read_s >= settle_s)
            states[:, 1] = states[:, 0] + scales * parted / apart
            since_s = np.where(is_read & (time_s >= settle_s), np.minimum(since_s, time_s), since_s)
            read_s = np.where(is_read, time_s, read_s)
    lasted = np.where(np.isnan(states[0, 0]), np.nan, read_s - since_s)
    with np.errstate(divide="ignore", invalid="ignore"):
        return states, growth / lasted
