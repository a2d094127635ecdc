"""Motion with m1 on a stop that holds it or is a spring: exact, until the stop would have to pull. SI.

A rigid stop makes two bodies of three (`vibench.sim.model`), a spring a stiffer specimen about another place
of rest. The stop lets go where the acceleration that presses m1 on it (`vibench.sim.rigid.press_on`), or the
indentation, falls to zero: found like a touch, by the same proof, with it in the gap's place.
"""

import math
from dataclasses import replace
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
    flight_tables,
    place_on_series,
    propagate_phasors,
)
from ..kernels import (
    Complex,
    Table,
    Vector,
    fill_series,
    inlined,
    kernel_without_refcount,
    march,
    series_rows,
    steps_ahead,
    sum_now,
)
from ..model import (
    PULL,
    RATE,
    ROW,
    SHAPE,
    VX,
    VY,
    VZ,
    Harmonic,
    LinearGap,
    NoContact,
    Specimen,
    X,
    Y,
    Z,
)
from ..slots import LINE_P_IM, LINE_P_RE, MODE, PEAKS_AND_LINES, SIDE, Parameters

LETS_GO = TOUCHES
"""How a hold ends when it does not last: the place of a touch in a flight."""


class HeldTables(NamedTuple):
    """How the specimen moves while m1 is on a stop that holds it, or that is a spring."""

    flight: FlightTables
    """Modes of that motion in the place of the free ones; the part of p that is constant is left out."""
    pulls: Complex
    """What unit phasors add to what the stop at positive p must pull, for m1 to stay."""
    let_go: float
    """What it pushes at rest over the gap, in the same measure."""
    rests: float
    """The constant part of abs(p), over the gap."""


def held_tables(tables: FlightTables, bound: Complex, specimen: Specimen) -> HeldTables:
    """Make them for a rigid stop, from the free motion and `vibench.sim.model.bound_motion`."""
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
    pulls = bound[:, PULL] / specimen.masses[2]
    return HeldTables(flight, pulls, specimen.stiffnesses[1] / tables.par.reduced_mass, 1.0)


def pressed_tables(specimen: Specimen, drive: Harmonic) -> HeldTables | None:
    """Make them for a stop that is a spring beside that of m1: exact too, with modes of its own.

    None for other laws, and where two of these modes coincide.
    """
    match specimen.contact:
        case LinearGap(stiffness=stop):
            k0, k1, k2 = specimen.stiffnesses
        case _:
            return None
    stiff = replace(specimen, stiffnesses=(k0, k1 + stop, k2), contact=NoContact())
    try:
        flight = flight_tables(stiff, drive)
    except ValueError:
        return None
    return HeldTables(flight, flight.path, k1 / (k1 + stop), stop / (k1 + stop))


@inlined
def hold(
    side: float,
    level: float,
    phasors: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    longest: float,
    held: HeldTables,
) -> tuple[int, float]:
    """Find how long m1 stays on a stop: until it lets go, or ``longest`` [s]; see `flight.fly`.

    ``level`` is what the stop pushes at rest, as `HeldTables.let_go` measures it.
    """
    flight, elapsed = held.flight, 0.0
    grid = flight.grid
    while elapsed < longest:
        propagate_phasors(now, phasors, elapsed, clock, flight)
        reach, bound = level, 0.0
        for j in range(len(now)):
            terms[j] = -side * now[j] * held.pulls[j]
            reach += abs(terms[j])
            bound += abs(terms[j]) * flight.squares[j]
        if not bound < LARGEST_BOUND:
            return OUT_OF_RANGE, elapsed
        steps = min(RUN_OF_STEPS, int((longest - elapsed) / grid))
        high = -level - bound * grid * grid / 8.0
        if steps > 0 and sum_now(terms) < high:
            made = march(terms, flight.ahead, steps, -math.inf, high)
            elapsed += made * grid
            if made == steps:
                continue
        length = min(grid, longest - elapsed)
        fill_series(series, terms, flight.series)
        series[0] += level
        free = first_contact(series, length, math.inf, 0.0, bound, reach)
        if free != NEVER:
            return LETS_GO, elapsed + free
        elapsed = longest if length < grid else elapsed + length
    return CLEAR, longest


@kernel_without_refcount
def observe_rest(observations: Vector, p: float, clock: Vector, length: float, flight: FlightTables) -> None:
    """Add what the constant part of p does to its line; `observe_flight` does the rest."""
    if observations[MODE] == PEAKS_AND_LINES:
        # The integral of exp(-i (omega t + phase)): its middle value times sin(q)/q, q half the turn.
        half = 0.5 * flight.omega * length
        line = p * length * math.sin(half) / half * drive_phasor(clock, 0.5 * length, flight).conjugate()
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
