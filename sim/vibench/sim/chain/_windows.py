"""One window of a whole chain: who is busy in it, and how the phasors come to its end. SI units."""

import cmath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..flight import LARGEST_BOUND, SERIES_TERMS
from ..kernels import (
    Complex,
    Table,
    Vector,
    advance_clock,
    angle_at,
    inlined,
    kernel,
    kernel_without_refcount,
)
from ..model import MOST_TERMS
from ..slots import PowerTerms
from ._base_force import PIECE_TERMS, add_base_series, base_curvature, deposit_base
from ._cell_contact import SUMMARY_ONLY, cell_workspace
from ._cell_flow import CELL_SIZE, MEMORY, MOMENTS, POWER, SIDE, WIDTH, CellLaw
from ._cell_power import POINTS, ROWS
from ._cell_window import LOG_ROWS, MOST_TOUCHES
from ._tables import (
    CONTACT,
    HALVES,
    INVERSE_REFERENCE,
    KIND,
    LINEAR,
    LOSS,
    LOWER,
    OBSERVED,
    PATH,
    UPPER,
    ChainTables,
)

_INVERSES: NDArray[np.float64] = 1.0 / np.arange(1.0, SERIES_TERMS + 1.0)
"""1 / (k + 1)."""


class Workspace(NamedTuple):
    """Workspaces of one run."""

    start: Complex
    """Phasors at the beginning of what is watched, shape (n+1,)."""
    turned: Complex
    """Phasors at the window's end, shape (n+1,)."""
    terms: Complex
    weights: Vector
    """abs of the phasors, shape (n+1,)."""
    motion: Table
    """p and x of every cell at the window's start, shape (2, cells); at its end, without forces in it."""
    motion_end: Table
    reach: Table
    """Bounds of p and x of every cell from now on, while no force acts, shape (2, cells)."""
    curvature: Table
    """The same of their accelerations."""
    busy: NDArray[np.int64]
    """Cells that press or may touch in this window, ascending; shape (cells,)."""
    busy_count: NDArray[np.int64]
    """How many they are, shape (1,)."""
    series: NDArray[np.float64]
    """p of the busy cells without forces in the window, shape (cells, SERIES_TERMS)."""
    watched: Vector
    """The same of p or x of a cell that is looked at."""
    floor: Table
    """Between floor and ceiling at both ends of a window a motion calls for no closer look; (2, cells)."""
    ceiling: Table
    before: Table
    """Rows of all cells at the window's start."""
    later: Vector
    work: Table
    touches: Vector
    log: Table
    summary: Table
    """A log of one row."""
    no_log: Table
    power: Table
    """Memory of steps under a power law."""
    then: Vector
    """A clock that runs ahead."""
    force: Vector
    """Of the base on the first m0, in powers of the time since the window began, shape (PIECE_TERMS,)."""


@kernel
def workspace_for(tables: ChainTables) -> Workspace:
    """Allocate the workspaces."""
    terms, _, cells = tables.real.shape
    return Workspace(
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(terms),
        np.zeros((OBSERVED, cells)),
        np.zeros((OBSERVED, cells)),
        np.zeros((OBSERVED, cells)),
        np.zeros((OBSERVED, cells)),
        np.zeros(cells, np.int64),
        np.zeros(1, np.int64),
        np.zeros((cells, SERIES_TERMS)),
        np.zeros(SERIES_TERMS),
        np.zeros((OBSERVED, cells)),
        np.zeros((OBSERVED, cells)),
        np.zeros((cells, CELL_SIZE)),
        np.zeros(SERIES_TERMS),
        cell_workspace(),
        np.zeros(MOST_TOUCHES + 1),
        np.zeros((LOG_ROWS, WIDTH)),
        np.zeros((SUMMARY_ONLY, WIDTH)),
        np.zeros((0, WIDTH)),
        np.zeros((ROWS, POINTS)),
        np.zeros(2),
        np.zeros(PIECE_TERMS),
    )


@inlined
def law_of(row: Vector) -> CellLaw:
    """Read a cell's law from its row of numbers."""
    h, f = HALVES, HALVES + MOST_TERMS
    halves = (
        int(row[h]),
        int(row[h + 1]),
        int(row[h + 2]),
        int(row[h + 3]),
        int(row[h + 4]),
        int(row[h + 5]),
    )
    forces = (row[f], row[f + 1], row[f + 2], row[f + 3], row[f + 4], row[f + 5])
    power = PowerTerms(row[INVERSE_REFERENCE], halves, forces)
    return CellLaw(int(row[KIND]), row[LOWER], row[UPPER], row[LINEAR], row[CONTACT], row[LOSS], power)


@inlined
def drive_term(clock: Vector, later: float, tables: ChainTables) -> complex:
    """exp(i (omega t + phase)) at clock time plus ``later``."""
    return cmath.exp(complex(0.0, angle_at(clock, later, tables.frequency))) * tables.phase


@inlined
def place_observed(motion: Table, phasors: Complex, observed: int, tables: ChainTables) -> None:
    """Write the first ``observed`` of p and x of every cell."""
    for what in range(observed):
        for i in range(motion.shape[1]):
            motion[what, i] = 0.0
    for j in range(len(phasors)):
        real, imaginary = phasors[j].real, phasors[j].imag
        for what in range(observed):
            for i in range(motion.shape[1]):
                motion[what, i] += real * tables.real[j, what, i] - imaginary * tables.imaginary[j, what, i]


@inlined
def copy_terms(to: Complex, source: Complex) -> None:
    """Copy phasors; a loop, because a slice costs the compiler more than all the rest."""
    for j in range(len(to)):
        to[j] = source[j]


@inlined
def copy_motion(to: Table, source: Table, observed: int) -> None:
    """Copy the first ``observed`` rows."""
    for what in range(observed):
        for i in range(to.shape[1]):
            to[what, i] = source[what, i]


@inlined
def is_bounded(workspace: Workspace) -> int:
    """Say (1 or 0) whether the motion is small enough for statements about touches."""
    for i in range(workspace.curvature.shape[1]):
        if not workspace.curvature[PATH, i] < LARGEST_BOUND:
            return 0
    return 1


@inlined
def weigh(workspace: Workspace, phasors: Complex, observed: int, tables: ChainTables) -> None:
    """Bound the motion and acceleration of the first ``observed`` of p and x, until a force acts."""
    for what in range(observed):
        for i in range(workspace.reach.shape[1]):
            workspace.reach[what, i] = workspace.curvature[what, i] = 0.0
    for j in range(len(phasors)):
        weight = abs(phasors[j])
        workspace.weights[j] = weight
        for what in range(observed):
            for i in range(workspace.reach.shape[1]):
                workspace.reach[what, i] += weight * tables.reaches[j, what, i]
                workspace.curvature[what, i] += weight * tables.curvatures[j, what, i]


@inlined
def propagate_window(
    workspace: Workspace, phasors: Complex, clock: Vector, length: float, level: int, tables: ChainTables
) -> None:
    """Write the phasors at the window's end, as if no force acted in it."""
    modes = len(phasors) - 1
    if length == tables.windows[level]:
        for j in range(modes):
            workspace.turned[j] = phasors[j] * tables.factors[level, j]
    else:
        for j in range(modes):
            workspace.turned[j] = phasors[j] * cmath.exp(tables.rates[j] * length)
    workspace.turned[modes] = drive_term(clock, length, tables)
    deposit_base(workspace.turned, workspace.force, length, tables)


@inlined
def set_ceilings(
    workspace: Workspace, peaks: Table, observed: int, length: float, tables: ChainTables
) -> None:
    """Work out between which values at the ends of windows of ``length`` nothing can happen within them.

    Nothing is: no touch, and no motion larger than the largest so far, if that is observed.
    """
    for what in range(observed):
        for i in range(peaks.shape[1]):
            margin = workspace.curvature[what, i] * length * length / 8.0
            workspace.ceiling[what, i] = np.inf if observed == 1 else peaks[what, i] - margin
            workspace.floor[what, i] = -workspace.ceiling[what, i]
            if what == PATH:
                law = tables.laws[i]
                workspace.ceiling[what, i] = min(workspace.ceiling[what, i], law[UPPER] - margin)
                workspace.floor[what, i] = max(workspace.floor[what, i], margin - law[LOWER])


@kernel_without_refcount
def march(
    workspace: Workspace, phasors: Complex, clock: Vector, observed: int, steps: int, tables: ChainTables
) -> int:
    """Advance over long windows in which nothing can happen, at most ``steps``; gives how many there were."""
    window, factors, drive = tables.windows[0], tables.factors[0], len(phasors) - 1
    real, imaginary, turned = tables.real, tables.imaginary, workspace.turned
    motion, floor, ceiling = workspace.motion_end, workspace.floor, workspace.ceiling
    for made in range(steps):
        for what in range(observed):
            for i in range(motion.shape[1]):
                motion[what, i] = 0.0
        for j in range(len(phasors)):
            term = phasors[j] * factors[j] if j < drive else drive_term(clock, window, tables)
            turned[j] = term
            for what in range(observed):
                for i in range(motion.shape[1]):
                    motion[what, i] += term.real * real[j, what, i] - term.imag * imaginary[j, what, i]
        for what in range(observed):
            for i in range(motion.shape[1]):
                if not floor[what, i] < motion[what, i] < ceiling[what, i]:
                    return made
        copy_terms(phasors, turned)
        copy_motion(workspace.motion, motion, observed)
        advance_clock(clock, window)
    return steps


@inlined
def find_busy(workspace: Workspace, cells: Table, length: float, tables: ChainTables) -> int:
    """List the cells that press, or whose touch within the window is not excluded; gives how many."""
    count = 0
    for i in range(len(cells)):
        law = tables.laws[i]
        bound = workspace.curvature[PATH, i]
        if len(tables.pieces) > 0:
            bound += base_curvature(workspace.force, i, length, tables)
        margin = bound * length * length / 8.0
        low, high = margin - law[LOWER], law[UPPER] - margin
        is_clear = low < workspace.motion[PATH, i] < high and low < workspace.motion_end[PATH, i] < high
        if cells[i, SIDE] != 0.0 or law[KIND] == POWER or not is_clear:
            workspace.busy[count] = i
            count += 1
    workspace.busy_count[0] = count
    return count


@inlined
def neighbours_clash(busy: NDArray[np.int64], count: int, distance: int) -> int:
    """Say (1 or 0) whether two busy cells are at most so far apart."""
    for k in range(1, count):
        if busy[k] - busy[k - 1] <= distance:
            return 1
    return 0


@inlined
def fill_observed(
    series: Vector,
    phasors: Complex,
    cell: int,
    what: int,
    terms: Complex,
    force: Vector,
    tables: ChainTables,
) -> None:
    """Write p or x of a cell as a polynomial in the time since the window began."""
    for j in range(len(phasors)):
        terms[j] = phasors[j] * tables.observed[cell, what, j]
    _fill_series(series, terms, tables.rates)
    add_base_series(series, force, cell, what, tables)


@inlined
def _fill_series(series: Vector, terms: Complex, rates: Complex) -> None:
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
            part = _INVERSES[k]
            real, imag = (real * grow - imag * turn) * part, (real * turn + imag * grow) * part


@inlined
def deposit(turned: Complex, cell: Vector, place: int, tables: ChainTables) -> None:
    """Add to the phasors at the window's end what the force of a cell did: its moments."""
    for j in range(len(turned) - 1):
        rate, total = tables.rates[j], complex(0.0, 0.0)
        for k in range(MOMENTS - 1, -1, -1):
            total = total * rate + cell[MEMORY + k]
        turned[j] -= tables.push[place, j] * total


@kernel_without_refcount
def place_motion(motion: Vector, phasors: Complex, tables: ChainTables) -> None:
    """Write displacements and velocities, shape (6 cells,)."""
    for i in range(len(motion)):
        motion[i] = 0.0
    for j in range(len(phasors)):
        real, imaginary = phasors[j].real, phasors[j].imag
        for i in range(len(motion)):
            motion[i] += real * tables.shapes[j, i].real - imaginary * tables.shapes[j, i].imag
