"""Sticking, m1 held by a rigid stop: exact motion of two bodies, until the stop would have to pull. SI.

`vibench.sim.model` says what moves. The stop lets go where the acceleration that presses m1 on it
(`vibench.sim.rigid.press_on`) falls to zero: found like a touch, by the same proof, with it in the gap's
place.
"""

import math
from typing import NamedTuple

import numpy as np

from ..contact import gap_of
from ..flight import (
    CLEAR,
    GRID_TURN,
    LARGEST_BOUND,
    NEVER,
    OUT_OF_RANGE,
    RUN_OF_STEPS,
    SERIES_TERMS,
    TOUCHES,
    Cubic,
    FlightTables,
    derivative_bound,
    drive_phasor,
    first_contact,
    place_on_phasors,
    place_on_series,
    propagate_phasors,
)
from ..kernels import (
    Complex,
    Table,
    Vector,
    fill_series,
    kernel_without_refcount,
    march,
    series_rows,
    steps_ahead,
    sum_now,
)
from ..model import PULL, RATE, ROW, SHAPE, VX, VY, VZ, X, Y, Z
from ..slots import LINE_P_IM, LINE_P_RE, MODE, NOTHING, PEAK_P, PEAKS_AND_LINES, SIDE, Parameters

LETS_GO = TOUCHES
"""How a hold ends when it does not last: the place of a touch in a flight."""


class HeldTables(NamedTuple):
    """How m1 and m2 move while a rigid stop holds m1."""

    flight: FlightTables
    """The bound modes in the place of the free ones; p, being constant, is left out."""
    pulls: Complex
    """What unit phasors add to the force by which m2 pulls at m0 [N]."""


def held_tables(tables: FlightTables, bound: Complex) -> HeldTables:
    """Make them of a specimen's free motion and its `vibench.sim.model`."""
    rates = bound[:, RATE].copy()
    grid = GRID_TURN / float(np.abs(rates).max())
    flight = tables._replace(
        rates=rates,
        squares=np.abs(rates) ** 2,
        shapes=bound[:, SHAPE].copy(),
        path=np.zeros_like(rates),
        across=bound[:, SHAPE][:, X].copy(),
        rows=bound[:-1, ROW].copy(),
        grid=grid,
        ahead=steps_ahead(rates, grid),
        series=series_rows(rates),
    )
    return HeldTables(flight, bound[:, PULL].copy())


@kernel_without_refcount
def hold(
    side: float,
    phasors: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    longest: float,
    held: FlightTables,
    pulls: Complex,
) -> tuple[int, float]:
    """Find how long a stop holds m1: until it lets go, or ``longest`` [s]; see `flight.fly`."""
    par, elapsed = held.par, 0.0
    weight, spring = -side / par.mass2, par.k1 * gap_of(side, par.lower, par.upper) / par.reduced_mass
    while elapsed < longest:
        propagate_phasors(now, phasors, elapsed, clock, held)
        reach, bound = spring, 0.0
        for j in range(len(now)):
            terms[j] = weight * now[j] * pulls[j]
            reach += abs(terms[j])
            bound += abs(terms[j]) * held.squares[j]
        if not bound < LARGEST_BOUND:
            return OUT_OF_RANGE, elapsed
        steps = min(RUN_OF_STEPS, int((longest - elapsed) / held.grid))
        high = -spring - bound * held.grid**2 / 8.0
        made = march(terms, held.ahead, steps, -math.inf, high) if sum_now(terms) < high else 0
        if made > 0:
            elapsed += made * held.grid
            continue
        length = min(held.grid, longest - elapsed)
        fill_series(series, terms, held.series)
        series[0] += spring
        free = first_contact(series, length, math.inf, 0.0, bound, reach)
        if free != NEVER:
            return LETS_GO, elapsed + free
        elapsed = longest if length < held.grid else elapsed + length
    return CLEAR, longest


@kernel_without_refcount
def place_held(state: Vector, side: float, phasors: Complex, held: FlightTables) -> None:
    """Write the motion of the phasors to ``state``, m1 on its stop."""
    place_on_phasors(state, phasors, held)
    state[Y] = state[Z] + side * gap_of(side, held.par.lower, held.par.upper)


@kernel_without_refcount
def observe_held(observations: Vector, side: float, clock: Vector, length: float, held: FlightTables) -> None:
    """Add what the constant p does to its peak and line; `observe_flight` does the rest."""
    if observations[MODE] == NOTHING:
        return
    gap = gap_of(side, held.par.lower, held.par.upper)
    observations[PEAK_P] = max(observations[PEAK_P], gap)
    if observations[MODE] == PEAKS_AND_LINES:
        # The integral of exp(-i (omega t + phase)): its middle value times sin(q)/q, q half the turn.
        half = 0.5 * held.omega * length
        line = (
            side * gap * length * math.sin(half) / half * drive_phasor(clock, 0.5 * length, held).conjugate()
        )
        observations[LINE_P_RE] += line.real
        observations[LINE_P_IM] += line.imag


@kernel_without_refcount
def hold_on_series(
    series: Table, path: Vector, state: Vector, force: Cubic, length: float, par: Parameters
) -> float:
    """Advance a held motion under a cubic base force to where the stop lets go, or by ``length`` [s].

    Returns the time at which it lets go, or NEVER. Workspaces as in `vibench.sim.flight`.
    """
    side = state[SIDE]
    spring = par.k1 * gap_of(side, par.lower, par.upper) / par.reduced_mass
    _fill_held_series(series, path, state, force, par)
    reach = spring
    for k in range(2):
        reach += abs(path[k]) * length**k
    path[0] += spring
    bound = derivative_bound(path, length, 2)
    free = first_contact(path, length, math.inf, 0.0, bound, reach)
    place_on_series(state, series, length if free == NEVER else free)
    state[Y] = state[Z] + side * gap_of(side, par.lower, par.upper)
    return free


@kernel_without_refcount
def _fill_held_series(series: Table, path: Vector, state: Vector, force: Cubic, par: Parameters) -> None:
    """Taylor coefficients of the bound motion, and of minus the pull that presses m1 on its stop [m/s^2]."""
    for i in range(6):
        series[0, i] = state[i]
    weight, pair = -state[SIDE] / par.mass2, par.mass1 + par.mass2
    for k in range(SERIES_TERMS):
        x, z, vx, vz = series[k, X], series[k, Z], series[k, VX], series[k, VZ]
        pull = par.k2 * (z - x) + par.c2 * (vz - vx)
        path[k] = weight * pull
        if k + 1 < SERIES_TERMS:
            push = force[k] if k < 4 else 0.0
            share = 1.0 / (k + 1)
            series[k + 1, X] = share * vx
            series[k + 1, Y] = series[k + 1, Z] = share * vz
            series[k + 1, VX] = share * (pull + push - par.k0 * x - par.c0 * vx) / par.mass0
            series[k + 1, VY] = series[k + 1, VZ] = share * -pull / pair
