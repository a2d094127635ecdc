"""Flight under a harmonic drive: exact, as a sum of turning phasors, up to the first touch. SI units.

Between contacts every displacement is Re sum e_j V_j exp(l_j t): the specimen's modes, and the drive as
one more term with l = i omega. March on a grid with one complex product a term, tracking only p; look
closely (`sim.engine.detection`) where the bound sum |e_j P_j| |l_j|^2 on |d2p/dt2| cannot exclude a touch.
"""

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import inlined
from ..contact_law import PowerLaw, RigidStops
from ..drive import Harmonic
from ..modes import Complex, harmonic_motion, modal_form
from ..specimen import Specimen
from .bound_modes import bound_motion
from .clock import angle_at
from .contact_flow import FORCE_TERMS
from .detection import LARGEST_BOUND, LONGEST_TURN, NEVER, SERIES_TERMS, first_contact
from .parameters import VX, VY, VZ, Parameters, PowerTerms, Vector, X, Y, Z, parameters, power_terms
from .power_tables import PowerTables, power_tables
from .row import copy_row

GRID_TURN = LONGEST_TURN
"""Grid step as the fastest rate times its length [rad]: half as long is slower by a seventh."""
INVERSES: NDArray[np.float64] = 1.0 / np.arange(1.0, SERIES_TERMS + 1.0)
"""1 / (k + 1)."""
RUN_OF_STEPS = 512
"""Grid steps between two fresh exponentials: keeps the products' rounding below 1e-13."""


CLEAR, TOUCHES, OUT_OF_RANGE, DEPARTS = range(4)
"""How a flight ends; the last: it has surely left the rigid stop on which m1 stood, and goes on."""


class FlightTables(NamedTuple):
    """Specimen and drive, diagonalised. Terms 0..n-1 are modes, term n is the drive."""

    par: Parameters
    power: PowerTerms | None
    """Of a power law; None, by its type, keeps all that concerns one out of a kernel."""
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
    factors: Complex
    """exp(l_j grid), shape (n+1,)."""
    steps: PowerTables | None
    """Of long steps under a power law; None, as above, for other laws."""
    bound: Complex | None
    """The motion with m1 held by a rigid stop (`sim.engine.bound_modes`); None, as above, for other laws."""


def flight_tables(specimen: Specimen, drive: Harmonic) -> FlightTables:
    """Prepare flight for a specimen and a harmonic drive."""
    modes = modal_form(specimen)
    omega = 2.0 * math.pi * drive.frequency_hz
    motion, force = harmonic_motion(specimen, omega, drive.amplitude_m)
    rates = np.append(modes.rates, 1j * omega)
    shapes = np.vstack([modes.shapes, motion])
    grid = GRID_TURN / float(np.max(np.abs(rates)))
    is_rigid = isinstance(specimen.contact, RigidStops)
    is_power = isinstance(specimen.contact, PowerLaw)
    return FlightTables(
        par=parameters(specimen),
        power=power_terms(specimen),
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
        factors=np.exp(rates * grid),
        steps=power_tables(specimen, omega, force, np.abs(modes.rates)) if is_power else None,
        bound=bound_motion(specimen, omega, drive.amplitude_m) if is_rigid else None,
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
def take_off(phasors: Complex, state: Vector, clock: Vector, tables: FlightTables) -> None:
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
def turn_phasors(
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
def fill_series(series: Vector, terms: Complex, rates: Complex) -> None:
    """Taylor coefficients of Re sum terms_j exp(rates_j t), shape (SERIES_TERMS,)."""
    # In real numbers, and without a division: the products of one term wait for each other, those of
    # different terms need not.
    for k in range(SERIES_TERMS):
        series[k] = 0.0
    for j in range(len(terms)):
        real, imag = terms[j].real, terms[j].imag
        grow, turn = rates[j].real, rates[j].imag
        for k in range(SERIES_TERMS):
            series[k] += real
            part = INVERSES[k]
            real, imag = (real * grow - imag * turn) * part, (real * turn + imag * grow) * part


@inlined
def _march(terms: Complex, factors: Complex, steps: int, low: float, high: float) -> int:
    """Turn the terms of p in place, step by step, while low < p < high; gives the steps that were."""
    for made in range(steps):
        p = 0.0
        for j in range(len(terms)):
            terms[j] *= factors[j]
            p += terms[j].real
        if not low < p < high:
            return made
    return steps


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
        Workspaces of shapes (n+1,), (n+1,), (SERIES_TERMS,).
    clock, longest, tables
        As elsewhere.

    Returns
    -------
    CLEAR, TOUCHES or OUT_OF_RANGE (too large for any statement), and its length [s].

    """
    par, h = tables.par, tables.grid
    elapsed, nearer = 0.0, min(par.lower, par.upper)
    while elapsed < longest:
        if elapsed > 0.0:
            turn_phasors(now, phasors, elapsed, clock, tables)
        else:
            copy_row(now, phasors)
        p, reach, bound = 0.0, 0.0, 0.0
        for j in range(len(now)):
            terms[j] = now[j] * tables.path[j]
            size = abs(terms[j])
            p += terms[j].real
            reach += size
            bound += size * tables.squares[j]
        if reach < nearer:
            # The free phasors can only shrink: no touch, ever.
            return CLEAR, longest
        if not bound < LARGEST_BOUND:
            return OUT_OF_RANGE, elapsed
        margin = bound * h * h / 8.0
        steps = min(RUN_OF_STEPS, int((longest - elapsed) / h))
        if margin - par.lower < p < par.upper - margin and steps > 0:
            made = _march(terms, tables.factors, steps, margin - par.lower, par.upper - margin)
            if made > 0:
                elapsed += made * h
                continue
            for j in range(len(now)):
                terms[j] = now[j] * tables.path[j]
        length = min(h, longest - elapsed)
        fill_series(series, terms, tables.rates)
        touch = first_contact(series, length, par.lower, par.upper, bound, reach)
        if touch != NEVER:
            return TOUCHES, elapsed + touch
        elapsed = longest if length < h else elapsed + length
    return CLEAR, longest
