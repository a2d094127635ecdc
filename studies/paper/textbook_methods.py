"""The paper's equations and explicit Runge-Kutta methods in textbook form, for comparison. SI units.

The equations share nothing with the engine: no modes, no special unknowns in contact, and no polynomial in
place of a sine. The methods do not detect contacts. Their steps cross the start of a contact at arbitrary
points; the error changes the energy of every impact and, in chaos, the exponents. Dormand and Prince's pair
is controlled like MATLAB's `ode45` (Shampine and Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18,
1997), with its default tolerances.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.integrate import RK45

from vibench.sim import Harmonic, RestoringForce, Specimen, spring_of

from .responses import Reals

APART_M = 1e-11
"""Distance of the neighbouring motion, for exponents [m]; far below indentations, above rounding errors."""
READING_S = 1e-3
"""Interval at which the distance of the neighbouring motion is measured and reset [s]."""
LOST_M = 1.0
"""Displacement beyond which a motion has diverged [m]."""
SLOWEST_PER_S = 1e-9
"""Smallest relative rate of change assumed for the first step, needed for a state at rest [1/s]."""


def numbers_of(specimen: Specimen, drive: Harmonic) -> Reals:
    """Return masses, stiffnesses, dampings, and drive amplitude, angular frequency and phase, shape (12,)."""
    of_drive = (drive.amplitude_m, 2.0 * np.pi * drive.frequency_hz, drive.phase_rad)
    return np.array([*specimen.masses, *specimen.stiffnesses, *specimen.dampings, *of_drive])


def rates(time_s: float | Reals, state: Reals, spring: RestoringForce, numbers: Reals) -> Reals:
    """Return d/dt of x, y, z, vx, vy, vz, with ``spring`` between m1 and m2.

    ``state`` has shape (6,), or (6, ..., n) for n motions, each with its time and its column of ``numbers``.
    """
    m0, m1, m2, k0, k1, k2, c0, c1, c2, amplitude, omega, phase = numbers
    x, y, z, vx, vy, vz = state
    angle = omega * time_s + phase
    base, base_rate = amplitude * np.sin(angle), amplitude * omega * np.cos(angle)
    p, rate = y - z, vy - vz
    # Trial steps of an implicit method may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        inner = k1 * p + c1 * rate + spring.force(p, rate)
        outer = k2 * (z - x) + c2 * (vz - vx)
        ahead = (outer + k0 * (base - x) + c0 * (base_rate - vx)) / m0
        return np.array([vx, vy, vz, ahead, -inner / m1, (inner - outer) / m2])


class Tableau(NamedTuple):
    """Coefficients of a method (Hairer, Norsett and Wanner, Solving ODEs I, sections II.1 and II.5)."""

    nodes: Reals
    stages: Reals
    """Coefficients of the stages, strictly lower triangular, shape (stages, stages)."""
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


_FIFTH = np.append(RK45.B, 0.0)
_DORMAND_PRINCE = Tableau(
    np.append(RK45.C, 1.0), np.vstack([np.pad(RK45.A, ((0, 0), (0, 2))), _FIFTH]), _FIFTH, RK45.E
)


def ode45(relative: float = 1e-3, absolute: float = 1e-6, longest_s: float = 3.0) -> TextbookMethod:
    """Return Dormand and Prince's pair, controlled as in MATLAB; the defaults are MATLAB's for a run of 30 s.

    Raises ValueError when a tolerance or the longest step is not positive and finite.
    """
    if not all(0.0 < each < math.inf for each in (relative, absolute, longest_s)):
        raise ValueError(
            f"Tolerances of {relative} and {absolute} with steps up to {longest_s} s are not allowed: "
            "each must be positive and finite."
        )
    name = f"ode45, tolerances {relative:g} and {absolute:g}"
    return TextbookMethod(name, _DORMAND_PRINCE, longest_s, relative, absolute)


def textbook_exponents(
    specimen: Specimen,
    drives: Sequence[Harmonic],
    method: TextbookMethod,
    duration_s: float = 25.0,
    settle_s: float = 5.0,
) -> Reals:
    """Return the largest Lyapunov exponents for motions from rest, by one method [1/s]; NaN if divergent.

    An exponent is the mean divergence rate, over ``duration_s`` after ``settle_s``, of a neighbour that takes
    the same steps. The resolution for regular motions is about 1 / ``duration_s``. Shape (n,), one per drive;
    all motions are integrated together. Raises ValueError for rigid stops.
    """
    states = np.zeros((6, 2, len(drives)))
    states[:, 1] = APART_M / math.sqrt(6.0) * _scales(drives)
    return march(states, settle_s + duration_s, settle_s, specimen, drives, method)[1]


def _scales(drives: Sequence[Harmonic]) -> Reals:
    speeds = [2.0 * math.pi * drive.frequency_hz for drive in drives]
    return np.repeat([np.ones(len(drives)), speeds], 3, axis=0)


def _largest(change: Reals, one: Reals, other: Reals, floor: float) -> Reals:
    """Return the largest change of any component, relative to the larger of the component's two values."""
    beside = np.maximum(np.maximum(np.abs(one), np.abs(other)), floor)
    return np.asarray(np.max(np.abs(change) / beside, axis=0))


def _next_steps(step_s: Reals, error: Reals, failures: Reals, method: TextbookMethod) -> Reals:
    """Return the next step lengths as `ode45` does; ``failures`` counts consecutive failed steps."""
    if method.relative == math.inf:
        return np.full_like(step_s, method.longest_s)
    # If the error is 0, the step grows by the largest factor; if not finite, it falls to a tenth.
    part = 1.25 * (error / method.relative) ** 0.2
    shorter = np.where(failures > 0, 0.5, np.fmax(0.1, 1.0 / np.maximum(part, 0.2)))
    longer = np.where(failures > 0, step_s, np.minimum(method.longest_s, step_s / np.maximum(part, 0.2)))
    return np.where(error <= method.relative, longer, shorter * step_s)


def march(
    states: Reals,
    until_s: float,
    settle_s: float,
    specimen: Specimen,
    drives: Sequence[Harmonic],
    method: TextbookMethod,
) -> tuple[Reals, Reals]:
    """Integrate motions to a time, optionally with neighbours; return states and divergence rates [1/s].

    ``states`` has shape (6, 1 or 2, motions); a second entry is a neighbouring state of the first.
    """
    tableau, spring, scales = method.tableau, spring_of(specimen), _scales(drives)
    numbers = np.array([numbers_of(specimen, drive) for drive in drives]).reshape(-1, 12).T
    has_neighbour, count = states.shape[1] > 1, len(drives)
    floor = method.absolute / method.relative if method.relative < math.inf else 1.0
    slopes = np.zeros((len(tableau.nodes), *states.shape))
    rows = slopes.reshape(len(slopes), -1)
    time_s, read_s, growth, failures = np.zeros((4, count))
    since_s = np.full(count, until_s if settle_s > 0.0 else 0.0)
    first = rates(time_s, states[:, 0], spring, numbers)
    fastest = np.maximum(_largest(first, states[:, 0], states[:, 0], floor), SLOWEST_PER_S)
    step_s = np.minimum(method.longest_s, 0.8 * method.relative**0.2 / fastest)
    while np.any(running := time_s < until_s):
        step_s = np.minimum(step_s, np.where(running, until_s - time_s, 0.0))
        for number, node in enumerate(tableau.nodes):
            at = states + step_s * (tableau.stages[number, :number] @ rows[:number]).reshape(states.shape)
            slopes[number] = rates(time_s + node * step_s, at, spring, numbers)
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
