"""Independent solution of any run, by a general method of high order. SI units.

scipy's DOP853 (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, section
II.10) integrates the paper's equations. It restarts at every instant at which m1 touches or leaves a stop,
so that no step crosses a kink. It shares no code with the engine, is accurate to some 1e-12 of (100 um, 0.1
m/s), and takes seconds per second of motion.
"""

from collections.abc import Callable
from dataclasses import replace
from enum import IntEnum
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import DOP853
from scipy.optimize import brentq

from vibench.cli.paper.textbook_methods import numbers_of, rates
from vibench.sim import Harmonic, NoContact, Specimen, spring_of
from vibench.sim.specimen.specimen import Floats

Rates = Callable[[float, Floats], Floats]
"""Function from time and state to d state / dt, for general solvers."""
Y, Z, VY, VZ = 1, 2, 4, 5


class Place(IntEnum):
    """Position of m1 relative to the stops."""

    ON_LOWER = -1
    FLIGHT = 0
    ON_UPPER = 1
    ANYWHERE = 2
    """The force is smooth in p."""


def rates_at(place: Place, specimen: Specimen, drive: Harmonic) -> Rates:
    """Return the rates of the state while m1 stays at one place."""
    shown = replace(specimen, contact=NoContact()) if place is Place.FLIGHT else specimen
    spring, numbers = spring_of(shown), numbers_of(specimen, drive)
    return lambda time_s, state: rates(time_s, state, spring, numbers)


def place_of(state: Floats, specimen: Specimen) -> Place:
    """Return whether m1 is in flight or at which stop."""
    if not spring_of(specimen).kinks:
        return Place.ANYWHERE
    below, above = _depths(state, specimen)
    if above > 0.0:
        return Place.ON_UPPER
    return Place.ON_LOWER if below > 0.0 else Place.FLIGHT


def clearances_at(place: Place, state: Floats, specimen: Specimen) -> tuple[float, ...]:
    """Return the distance to each possible end of a phase; positive during the phase."""
    below, above = _depths(state, specimen)
    match place:
        case Place.FLIGHT:
            return -below, -above
        case Place.ON_LOWER:
            return (below,)
        case Place.ON_UPPER:
            return (above,)
        case Place.ANYWHERE:
            return ()


def _depths(state: Floats, specimen: Specimen) -> tuple[float, float]:
    lower, upper = specimen.gaps_m
    p = float(state[Y] - state[Z])
    return -p - lower, p - upper


TOLERANCE = 1e-13
"""Relative error of a step; scipy accepts 2.2e-14 at least."""
STATE_UNITS = np.repeat([1e-4, 0.1], 3)
"""Units of errors of a state: 100 um and 0.1 m/s, typical for gaps and impact velocities."""
SMALLEST_PART = 1e-2
"""Smallest scale of the error of a component, relative to its unit; it matters near zero crossings."""
LONGEST_STEP_S = 2e-4
"""Longest step [s]: a tenth of the shortest natural period of the specimen without contact."""
MOST_PHASES_PER_S = 100_000
"""Largest number of flights and contacts per second."""


def state_error(state: ArrayLike, truth: ArrayLike) -> float:
    """Return the largest difference of two states in units of 100 um and 0.1 m/s."""
    return float(np.max(np.abs(np.asarray(state) - np.asarray(truth)) / STATE_UNITS))


def independent_state(
    specimen: Specimen,
    drive: Harmonic,
    duration_s: float,
    initial_state: ArrayLike,
    tolerance: float = TOLERANCE,
) -> Floats:
    """Integrate a motion from time zero and return its final state, shape (6,).

    Raises ValueError for rigid stops, and ArithmeticError when the solver fails.

    Parameters
    ----------
    specimen, drive
        Any contact law with a finite force.
    duration_s
        [s].
    initial_state
        x, y, z, vx, vy, vz, absolute [m, m/s], shape (6,).
    tolerance
        Relative error of a step; compare two tolerances to estimate the error of the result.
    """
    time_s, state = 0.0, np.array(initial_state, dtype=np.float64)
    place = place_of(state, specimen)
    for _ in range(1 + round(MOST_PHASES_PER_S * duration_s)):
        rates = rates_at(place, specimen, drive)
        time_s, state, end = _phase(rates, place, specimen, time_s, state, duration_s, tolerance)
        if end is None:
            return state
        place = Place.FLIGHT if place is not Place.FLIGHT else (Place.ON_LOWER, Place.ON_UPPER)[end]
    msg = f"The independent solution gave up at {time_s} s: over {MOST_PHASES_PER_S} contacts a second."
    raise ArithmeticError(msg)


def _phase(
    rates: Rates,
    place: Place,
    specimen: Specimen,
    time_s: float,
    state: Floats,
    until_s: float,
    tolerance: float,
) -> tuple[float, Floats, int | None]:
    """Integrate until a phase ends; return time, state, and which end it is (None at the end of the run)."""
    solver = _solver(rates, time_s, state, until_s, tolerance)
    while solver.status == "running":
        before_s, before = solver.t, solver.y
        failure = solver.step()
        if failure is not None:
            msg = f"The independent solution gave up at {before_s} s: {failure}"
            raise ArithmeticError(msg)
        found = _first_end(solver, before_s, before, lambda state: clearances_at(place, state, specimen))
        if found is not None:
            end_s, which = found
            return end_s, _state_at(rates, before_s, before, end_s, tolerance), which
    return until_s, solver.y, None


def _solver(
    rates: Rates, time_s: float, state: Floats, until_s: float, tolerance: float, first_s: float | None = None
) -> DOP853:
    return DOP853(
        rates,
        time_s,
        state,
        until_s,
        max_step=LONGEST_STEP_S,
        rtol=tolerance,
        atol=tolerance * SMALLEST_PART * STATE_UNITS,
        first_step=first_s,
    )


def _state_at(rates: Rates, before_s: float, before: Floats, end_s: float, tolerance: float) -> Floats:
    """Repeat the last step to its exact end, because the interpolant is less accurate."""
    if end_s <= before_s:
        return before
    solver = _solver(rates, before_s, before, end_s, tolerance, end_s - before_s)
    while solver.status == "running":
        solver.step()
    return np.asarray(solver.y)


def _first_end(
    solver: DOP853, before_s: float, before: Floats, clearances: Callable[[Floats], tuple[float, ...]]
) -> tuple[float, int] | None:
    """Return the first instant of the last step at which the phase ends, and which end it is."""
    turns = (before[VY] - before[VZ]) * (solver.y[VY] - solver.y[VZ]) < 0.0
    if not turns and all(left > 0.0 for left in clearances(solver.y)):
        return None
    inside = solver.dense_output()
    turn = [_root(lambda t: inside(t)[VY] - inside(t)[VZ], before_s, solver.t)] if turns else []
    found = []
    for which in range(len(clearances(before))):

        def clearance(time_s: float, which: int = which) -> float:
            return clearances(inside(time_s))[which]

        for low, high in pairwise([before_s, *turn, solver.t]):
            if clearance(high) <= 0.0:
                # Just after the start or end of a contact, rounding may leave no clearance.
                found.append((_root(clearance, low, high) if clearance(low) > 0.0 else low, which))
                break
    return min(found, default=None)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-300, rtol=4.0 * np.finfo(np.float64).eps))
