"""What explicit methods of Runge and Kutta make of a motion when no event stops them. SI units.

Their steps fall on a contact wherever they happen to: what is wrong in it adds to or takes from the energy of
every impact, and to the exponent of chaos. Dormand and Prince's pair is controlled as `ode45` of MATLAB does
(Shampine and Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18, 1997), at its default tolerances.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import RK45

from vibench.sim import Harmonic, Specimen
from vibench.sim.accuracy_benchmark.plain_equations import Law, Place, law_of, numbers_of, rates
from vibench.sim.kernels.arrays import Floats
from vibench.sim.kernels.compile import kernel

APART_M = 1e-11
"""Distance of the neighbour that gives an exponent; far below any indentation, far above rounding."""
READING_S = 1e-3
"""Time between two readings of that distance."""
LOST_M = 1.0
"""A motion that is so far out has diverged."""
SLOWEST_PER_S = 1e-9
"""A state that does not move at first."""


class Tableau(NamedTuple):
    """Numbers of a method (Hairer, Norsett and Wanner, Solving ODEs I, sections II.1 and II.5)."""

    nodes: Floats
    stages: Floats
    """Shape (stages, stages), strictly lower."""
    result: Floats
    error: Floats
    """Zero where the method states none."""


@dataclass(frozen=True)
class TextbookMethod:
    """A method with its steps: of fixed length, or as long as a tolerance lets them be."""

    name: str
    tableau: Tableau
    longest_s: float
    """Every step, where no error is stated."""
    relative: float = math.inf
    absolute: float = 1.0
    """Allowed error of a component, in metres and in metres per second alike."""


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
    """Return the classical method of fourth order in steps of fixed length.

    Raises ValueError when the step is not positive and finite.
    """
    if not 0.0 < step_s < math.inf:
        msg = f"A step of {step_s} s is not allowed: it must be positive and finite."
        raise ValueError(msg)
    return TextbookMethod(f"Runge-Kutta, steps of {step_s:g} s", _RUNGE_KUTTA, step_s)


def ode45(relative: float = 1e-3, absolute: float = 1e-6, longest_s: float = 3.0) -> TextbookMethod:
    """Return Dormand and Prince's pair, controlled as MATLAB does; the defaults are MATLAB's for 30 s.

    Raises ValueError when a tolerance or the longest step is not positive and finite.
    """
    if not all(0.0 < each < math.inf for each in (relative, absolute, longest_s)):
        msg = (
            f"Tolerances of {relative} and {absolute} with steps up to {longest_s} s are not allowed: "
            "each must be positive and finite."
        )
        raise ValueError(msg)
    name = f"ode45, tolerances {relative:g} and {absolute:g}"
    return TextbookMethod(name, _DORMAND_PRINCE, longest_s, relative, absolute)


def textbook_state(
    specimen: Specimen, drive: Harmonic, method: TextbookMethod, duration_s: float, initial_state: ArrayLike
) -> Floats:
    """Follow a motion from time zero and return its state at the end, shape (6,); NaN when it is lost.

    ``initial_state`` is x, y, z, vx, vy, vz, absolute [m, m/s]. Raises ValueError for rigid stops.
    """
    states = np.array(initial_state, dtype=np.float64).reshape(1, 6)
    _marched(states, duration_s, duration_s, *_in_numbers(specimen, drive, method))
    return states.reshape(6)


def textbook_exponent(
    specimen: Specimen,
    drive: Harmonic,
    method: TextbookMethod,
    duration_s: float = 25.0,
    settle_s: float = 5.0,
) -> float:
    """Return the largest exponent of what a method makes of a motion from rest [1/s]; NaN when it is lost.

    The mean rate over ``duration_s``, after ``settle_s``, at which a neighbour parts that takes the very same
    steps. Regular motions have it to about 1 / ``duration_s``. Raises ValueError for rigid stops.
    """
    states = np.zeros((2, 6))
    states[1] = APART_M / math.sqrt(6.0) * _scales(drive)
    return _marched(states, settle_s + duration_s, settle_s, *_in_numbers(specimen, drive, method))


def _scales(drive: Harmonic) -> Floats:
    return np.repeat([1.0, 2.0 * np.pi * drive.frequency_hz], 3)


def _in_numbers(
    specimen: Specimen, drive: Harmonic, method: TextbookMethod
) -> tuple[Tableau, tuple[float, float, float], Floats, Law, Floats]:
    steps = (method.longest_s, method.relative, method.absolute)
    return method.tableau, steps, _scales(drive), law_of(specimen), numbers_of(specimen, drive)


@kernel
def _add(state: Floats, step_s: float, weights: Floats, slopes: Floats, count: int, sums: Floats) -> None:
    """Write state + step * (weights @ slopes) into sums; loops, for each array of a product takes memory."""
    for k in range(6):
        total = 0.0
        for number in range(count):
            total += weights[number] * slopes[number, k]
        sums[k] = state[k] + step_s * total


@kernel
def _slopes_of(
    state: Floats, time_s: float, step_s: float, tableau: Tableau, law: Law, numbers: Floats, slopes: Floats
) -> None:
    at = np.empty(6)
    for number in range(len(tableau.nodes)):
        _add(state, step_s, tableau.stages[number], slopes, number, at)
        slopes[number] = rates(time_s + tableau.nodes[number] * step_s, at, Place.ANYWHERE, law, numbers)


@kernel
def _largest(change: Floats, one: Floats, other: Floats, floor: float) -> float:
    """Size of a change beside the larger of two states, component by component."""
    found = 0.0
    for k in range(6):
        found = max(found, abs(change[k]) / max(abs(one[k]), abs(other[k]), floor))
    return found


@kernel
def _next_step(step_s: float, error: float, failures: int, steps: tuple[float, float, float]) -> float:
    """Give the length to try after a step, as `ode45` does, after so many that failed one after the other."""
    longest_s, relative, _ = steps
    if relative == np.inf:
        return longest_s
    if not error <= relative:
        return step_s * (0.5 if failures > 0 else max(0.1, 0.8 * (relative / error) ** 0.2))
    if failures > 0:
        return step_s
    wanted = 1.25 * (error / relative) ** 0.2
    return min(longest_s, step_s / wanted if wanted > 0.2 else 5.0 * step_s)


@kernel
def _read(states: Floats, scale: Floats) -> float:
    """Give the logarithm of how far the neighbour has parted, and bring it back to where it began."""
    apart: float = np.sqrt((((states[1] - states[0]) / scale) ** 2).sum()) / APART_M
    states[1] = states[0] + (states[1] - states[0]) / apart
    return float(np.log(apart))


@kernel
def _marched(
    states: Floats,
    until_s: float,
    settle_s: float,
    tableau: Tableau,
    steps: tuple[float, float, float],
    scale: Floats,
    law: Law,
    numbers: Floats,
) -> float:
    """Take a state to a time, and its neighbour if there is one; give the mean rate at which they part."""
    longest_s, relative, absolute = steps
    count, has_neighbour, failures = len(tableau.nodes), len(states) > 1, 0
    slopes, after, change, nothing = np.zeros((count, 6)), np.zeros(6), np.zeros(6), np.zeros(6)
    floor = absolute / relative if relative < np.inf else 1.0
    time_s, read_s, growth, since_s = 0.0, 0.0, 0.0, until_s if settle_s > 0.0 else 0.0
    first = rates(0.0, states[0], Place.ANYWHERE, law, numbers)
    fastest = _largest(first, states[0], states[0], floor)
    step_s = min(longest_s, 0.8 * relative**0.2 / max(fastest, SLOWEST_PER_S))
    while time_s < until_s:
        step_s = min(step_s, until_s - time_s)
        _slopes_of(states[0], time_s, step_s, tableau, law, numbers, slopes)
        _add(states[0], step_s, tableau.result, slopes, count, after)
        _add(nothing, step_s, tableau.error, slopes, count, change)
        error = _largest(change, states[0], after, floor)
        is_good = error <= relative
        if time_s + step_s == time_s or (is_good and not abs(after[1]) < LOST_M):
            states[:] = np.nan
            return np.nan
        if is_good:
            if has_neighbour:
                _slopes_of(states[1], time_s, step_s, tableau, law, numbers, slopes)
                _add(states[1], step_s, tableau.result, slopes, count, states[1])
            states[0] = after
            time_s += step_s
        step_s = _next_step(step_s, error, failures, steps)
        failures = 0 if is_good else failures + 1
        if is_good and has_neighbour and time_s >= read_s + READING_S:
            growth += _read(states, scale) * (read_s >= settle_s)
            since_s = min(since_s, time_s) if time_s >= settle_s else since_s
            read_s = time_s
    return growth / (read_s - since_s)
