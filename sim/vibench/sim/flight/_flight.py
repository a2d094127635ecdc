"""Flight under a harmonic drive: exact, as a sum of turning phasors, up to the first touch. SI units.

Between contacts every displacement is Re sum e_j V_j exp(l_j t): the specimen's modes, and the drive as
one more term with l = i omega. March on a grid with one complex product a term, tracking only p; look
closely (`vibench.sim.flight`) where the bound sum |e_j P_j| |l_j|^2 on |d2p/dt2| cannot exclude a
touch.
"""

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels import (
    Complex,
    Table,
    Vector,
    angle_at,
    copy_row,
    fill_series,
    inlined,
    march,
    propagate_by,
    series_rows,
    steps_ahead,
    sum_now,
)
from ..model import VX, VY, VZ, Harmonic, Specimen, X, Y, Z, harmonic_motion, modal_form
from ..slots import Parameters, parameters
from ._base_force import FORCE_TERMS
from ._detection import LARGEST_BOUND, LONGEST_TURN, NEVER, first_touch

GRID_TURN = LONGEST_TURN
"""Grid step as the fastest rate times its length [rad]: half as long is slower by a seventh."""
RUN_OF_STEPS = 512
"""Grid steps between two fresh exponentials: keeps the products' rounding below 1e-13."""
CLEAR, TOUCHES, OUT_OF_RANGE, LIFTS_OFF = range(4)
"""How a flight ends; the last: it has surely left the rigid stop on which m1 stood, and goes on."""


class FlightTables(NamedTuple):
    """Specimen and drive, diagonalised. Terms 0..n-1 are modes, term n is the drive."""

    par: Parameters
    frequency: float
    omega: float
    phase: complex
    """exp(i phase) of the drive at time zero."""
    force: complex
    """Base force k0 U + c0 dU/dt = Re(force * exp(i omega t)) [N]."""
    rates: Complex
    """l_j, shape (n+1,) [1/s]; one of each conjugate pair."""
    squares: NDArray[np.float64]
    """abs(l_j)^2."""
    shapes: Complex
    """V_j, shape (n+1, 6): motion of a unit phasor."""
    path: Complex
    """V_jy - V_jz, shape (n+1,): what a unit phasor adds to p."""
    across: Complex
    """V_jx, shape (n+1,): what a unit phasor adds to x."""
    rows: Complex
    """Left rows, shape (n, 6), with the weight 2 of a pair: a state's phasors."""
    grid: float
    """Grid step [s]."""
    ahead: Table
    """exp(l_j grid) and its powers (`vibench.sim.kernels`), shape (n+1, 2, AHEAD)."""
    series: Table
    """Taylor coefficients of exp(l_j t), likewise."""


def flight_tables(specimen: Specimen, drive: Harmonic) -> FlightTables:
    """Prepare flight for a specimen and a harmonic drive."""
    modes = modal_form(specimen)
    omega = 2.0 * math.pi * drive.frequency_hz
    motion, force = harmonic_motion(specimen, omega, drive.amplitude_m)
    rates = np.append(modes.rates, 1j * omega)
    shapes = np.vstack([modes.shapes, motion])
    grid = GRID_TURN / float(np.max(np.abs(rates)))
    return FlightTables(
        par=parameters(specimen),
        frequency=float(drive.frequency_hz),
        omega=omega,
        phase=cmath.exp(1j * drive.phase_rad),
        force=force,
        rates=rates,
        squares=np.abs(rates) ** 2,
        shapes=shapes,
        path=shapes[:, Y] - shapes[:, Z],
        across=np.ascontiguousarray(shapes[:, X]),
        rows=modes.rows,
        grid=grid,
        ahead=steps_ahead(rates, grid),
        series=series_rows(rates),
    )


@inlined
def drive_phasor(clock: Vector, later: float, tables: FlightTables) -> complex:
    """exp(i (omega t + phase)) at clock time plus ``later``."""
    angle = angle_at(clock, later, tables.frequency)
    return complex(math.cos(angle), math.sin(angle)) * tables.phase


@inlined
def fill_base_force(force: Vector, clock: Vector, middle: float, tables: FlightTables) -> None:
    """Taylor coefficients of the base force about clock time plus ``middle``."""
    term = tables.force * drive_phasor(clock, middle, tables)
    for k in range(FORCE_TERMS):
        force[k] = term.real
        term *= complex(0.0, tables.omega / (k + 1.0))


@inlined
def start_flight(phasors: Complex, state: Vector, clock: Vector, tables: FlightTables) -> None:
    """Write the phasors of the flight that starts from ``state`` now, shape (n+1,)."""
    modes = len(tables.rows)
    drive = drive_phasor(clock, 0.0, tables)
    phasors[modes] = drive
    re, im = drive.real, drive.imag
    shapes, rows = tables.shapes, tables.rows
    # What is free of the motion beside the steady one.
    x = state[X] - (re * shapes[modes, X].real - im * shapes[modes, X].imag)
    y = state[Y] - (re * shapes[modes, Y].real - im * shapes[modes, Y].imag)
    z = state[Z] - (re * shapes[modes, Z].real - im * shapes[modes, Z].imag)
    vx = state[VX] - (re * shapes[modes, VX].real - im * shapes[modes, VX].imag)
    vy = state[VY] - (re * shapes[modes, VY].real - im * shapes[modes, VY].imag)
    vz = state[VZ] - (re * shapes[modes, VZ].real - im * shapes[modes, VZ].imag)
    for j in range(modes):
        places = rows[j, X].real * x + rows[j, Y].real * y + rows[j, Z].real * z
        speeds = rows[j, VX].real * vx + rows[j, VY].real * vy + rows[j, VZ].real * vz
        across = rows[j, X].imag * x + rows[j, Y].imag * y + rows[j, Z].imag * z
        fast = rows[j, VX].imag * vx + rows[j, VY].imag * vy + rows[j, VZ].imag * vz
        phasors[j] = complex(places + speeds, across + fast)


@inlined
def propagate_phasors(
    turned: Complex, phasors: Complex, later: float, clock: Vector, tables: FlightTables
) -> None:
    """Write the phasors ``later`` seconds after take-off, by fresh exponentials."""
    modes = len(tables.rows)
    for j in range(modes):
        turned[j] = phasors[j] * cmath.exp(tables.rates[j] * later)
    turned[modes] = drive_phasor(clock, later, tables)


@inlined
def place_on_phasors(motion: Vector, phasors: Complex, tables: FlightTables) -> None:
    """Write (x, y, z, vx, vy, vz) of the phasors to the first six places of ``motion``."""
    for i in range(6):
        value = 0.0
        for j in range(len(phasors)):
            phasor, shape = phasors[j], tables.shapes[j, i]
            value += phasor.real * shape.real - phasor.imag * shape.imag
        motion[i] = value


@inlined
def fly(
    phasors: Complex,
    now: Complex,
    terms: Complex,
    series: Vector,
    clock: Vector,
    longest: float,
    tables: FlightTables,
) -> tuple[int, float]:
    """Find how long a flight lasts: to the first touch, or ``longest`` [s].

    Parameters
    ----------
    phasors
        At take-off, which is clock time.
    now, terms, series
        Workspaces of shapes (n+1,), (n+1,), (AHEAD,).
    clock, longest, tables
        As elsewhere.

    Returns
    -------
    CLEAR, TOUCHES or OUT_OF_RANGE (too large for any statement), and its length [s].

    """
    par, h = tables.par, tables.grid
    elapsed = 0.0
    while elapsed < longest:
        if elapsed > 0.0:
            propagate_phasors(now, phasors, elapsed, clock, tables)
        else:
            copy_row(now, phasors)
        reach, bound = begin_terms(terms, now, tables.path, tables)
        if reach < min(par.lower, par.upper):
            # The free phasors can only shrink: no touch, ever.
            return CLEAR, longest
        if not bound < LARGEST_BOUND:
            return OUT_OF_RANGE, elapsed
        margin, begun, made = bound * h * h / 8.0, elapsed, 0
        low, high = margin - par.lower, par.upper - margin
        while made < RUN_OF_STEPS and elapsed < longest:
            if low < sum_now(terms) < high:
                steps = min(RUN_OF_STEPS - made, int((longest - elapsed) / h))
                ran = march(terms, tables.ahead, steps, low, high)
                made += ran
                elapsed = begun + made * h
                if ran == steps > 0:
                    continue
            length = min(h, longest - elapsed)
            fill_series(series, terms, tables.series)
            touch = first_touch(series, length, par.lower, par.upper, bound, reach)
            if touch != NEVER:
                return TOUCHES, elapsed + touch
            if length < h:
                return CLEAR, longest
            propagate_by(terms, tables.ahead, 1)
            made += 1
            elapsed = begun + made * h
    return CLEAR, longest


@inlined
def begin_terms(terms: Complex, now: Complex, shape: Complex, tables: FlightTables) -> tuple[float, float]:
    """Write what phasors are of a displacement; gives bounds of it and of its acceleration, from now on."""
    reach, bound = 0.0, 0.0
    for j in range(len(now)):
        terms[j] = now[j] * shape[j]
        size = math.sqrt(terms[j].real * terms[j].real + terms[j].imag * terms[j].imag)
        reach += size
        bound += size * tables.squares[j]
    return reach, bound
