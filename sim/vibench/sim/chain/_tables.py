"""What the kernels need to know of a chain and its drive: modes, windows, answers to forces. SI units."""

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..collision import (
    LEAST_TOLERANCE,
    Collision,
    CollisionTables,
    collisions_in_a_course,
    new_collision,
)
from ..engine import TERMS
from ..flight import SERIES_TERMS, P
from ..kernels import Complex, Table, Vector
from ..model import MOST_TERMS, Accuracy, Harmonic, Specimen
from ..slots import parameters, power_terms
from ._cell_flow import MARKOV_TERMS, POWER, WINDOW_TURN, YIELDING
from ._chain import MASSES_PER_CELL, Chain
from ._modes import chain_impulses, chain_modal_form, chain_state_matrix, chain_transmissibility

PATH, ACROSS = range(2)
"""What is observed of a cell: p, x."""
OBSERVED = 2

KIND, LOWER, UPPER, LINEAR, CONTACT, LOSS, INVERSE_REFERENCE, HALVES = range(8)
"""Places of a cell's law; from HALVES on the power terms' halves, then their forces."""
LAW_SIZE = HALVES + 2 * MOST_TERMS

CROSS_SHARE = 1.0
"""Part of the tolerance that one cell's force may change another's rate within a window, unseen."""
MOST_HALVINGS = 20
KEPT = 2
"""Windows that are tried before the shortest."""
COLLISION_TURN = 0.4
"""Longest window where collisions are whole: nine moments then hold a force to 7e-10."""
MOST_CUT = 8
"""Cells of a chain whose windows end at touches: beyond, a window costs more than steps."""


class ChainTables(NamedTuple):
    """Chain and drive, diagonalised. Terms 0..n-1 are modes, term n is the drive."""

    frequency: float
    omega: float
    phase: complex
    """exp(i phase) of the drive at time zero."""
    rates: Complex
    """l_j, shape (n+1,) [1/s]; one of each conjugate pair."""
    shapes: Complex
    """V_j, shape (n+1, 6 cells): motion of a unit phasor."""
    observed: Complex
    """Shape (cells, 2, n+1): what a unit phasor adds to p and x of a cell."""
    real: Table
    """The same, real and imaginary part and magnitude, shape (n+1, 2, cells): rows to take at once."""
    imaginary: Table
    reaches: Table
    curvatures: Table
    """reaches times abs(l_j)^2: bounds on accelerations."""
    rows: Complex
    """Left rows, shape (n, 6 cells), with the weight 2 of a pair: a state's phasors."""
    push: Complex
    """Shape (cells, n): what a unit impulse in a cell, along its p, adds to the phasors."""
    markov: Table
    """g_k of `vibench.sim.chain` for p and x of the cell itself, shape (cells, 2, MARKOV_TERMS)."""
    laws: Table
    """Shape (cells, LAW_SIZE)."""
    windows: Vector
    """Lengths of windows, long to short [s]."""
    factors: Complex
    """exp(l_j window), shape (windows, n+1)."""
    clash: NDArray[np.int64]
    """In such a window, cells at most so far apart may not both be busy; shape (windows,)."""
    collision: Collision
    """Memory of a run's collisions."""
    collisions: CollisionTables
    """Of Hertz's stops; what is struck, cell by cell:"""
    struck: Table
    """Shape (cells, TERMS, P + 1)."""
    cuts: int
    """1 where windows end at touches, so that collisions are whole; 0 where windows cost more than that."""
    base_push: Complex
    """Shape (n,): what a unit impulse on the first m0 adds to the phasors."""
    base_markov: Table
    """Taylor coefficients of p and x of every cell after it, shape (cells, 2, SERIES_TERMS)."""
    pieces: Table
    """Of a drive that is not harmonic: the force on the first m0, cut into polynomials; else none."""
    piece_start: float
    """When the first of them begins [s]."""
    piece_s: float
    """Length of each [s]."""


def chain_tables(chain: Chain, drive: Harmonic, accuracy: Accuracy) -> ChainTables:
    """Prepare flight and contact for a chain and a harmonic drive."""
    modes = chain_modal_form(chain)
    omega = 2.0 * math.pi * drive.frequency_hz
    moved = chain_transmissibility(chain, drive.frequency_hz)[0, :, :MASSES_PER_CELL].ravel()
    motion = -1j * drive.amplitude_m * np.concatenate([moved, 1j * omega * moved])
    rates = np.append(modes.rates, 1j * omega)
    shapes = np.vstack([modes.shapes, motion])
    displacement = shapes[:, : MASSES_PER_CELL * chain.size].reshape(len(rates), chain.size, MASSES_PER_CELL)
    path = displacement[:, :, 1] - displacement[:, :, 2]
    observed = np.stack([path, displacement[:, :, 0]], axis=2)
    reaches = np.ascontiguousarray(np.abs(observed).transpose(0, 2, 1))
    between = markov_between(chain)
    fastest = float(np.max(np.abs(rates)))
    turns = (COLLISION_TURN, WINDOW_TURN) if accuracy.tolerance >= LEAST_TOLERANCE else (WINDOW_TURN,)
    windows, clash = _windows(between, [turn / fastest for turn in turns], CROSS_SHARE * accuracy.tolerance)
    markov = _own_markov(between)
    return ChainTables(
        frequency=drive.frequency_hz,
        omega=omega,
        phase=cmath.exp(1j * drive.phase_rad),
        rates=rates,
        shapes=shapes,
        observed=np.ascontiguousarray(observed.transpose(1, 2, 0)),
        real=np.ascontiguousarray(observed.real.transpose(0, 2, 1)),
        imaginary=np.ascontiguousarray(observed.imag.transpose(0, 2, 1)),
        reaches=reaches,
        curvatures=reaches * (np.abs(rates) ** 2)[:, None, None],
        rows=modes.rows,
        push=np.ascontiguousarray((modes.rows @ chain_impulses(chain)).T),
        markov=markov,
        laws=np.vstack([_law_row(cell) for cell in chain.cells]),
        windows=windows,
        factors=np.exp(windows[:, None] * rates[None, :]),
        clash=clash,
        collision=new_collision(),
        collisions=collisions_in_a_course(fastest),
        struck=_struck(markov[:, PATH], fastest),
        cuts=int(chain.size <= MOST_CUT),
        base_push=modes.rows @ chain_state_matrix(chain)[1],
        base_markov=_base_markov(chain),
        pieces=np.zeros((0, 0)),
        piece_start=0.0,
        piece_s=0.0,
    )


def markov_between(chain: Chain) -> Table:
    """Taylor coefficients of p and x of every cell after a unit impulse in every cell.

    Shape (MARKOV_TERMS, 2, answering cells, struck cells).
    """
    return _answers(chain, chain_impulses(chain), MARKOV_TERMS)


def _answers(chain: Chain, impulses: Table, terms: int) -> Table:
    """Taylor coefficients after impulses, shape (terms, 2, cells, impulses)."""
    system, _ = chain_state_matrix(chain)
    answer, moved_by = impulses, np.zeros((terms, OBSERVED, chain.size, impulses.shape[1]))
    for k in range(terms):
        moved = answer[: MASSES_PER_CELL * chain.size].reshape(chain.size, MASSES_PER_CELL, -1)
        moved_by[k, PATH], moved_by[k, ACROSS] = moved[:, 1] - moved[:, 2], moved[:, 0]
        answer = system @ answer
    return moved_by


def _base_markov(chain: Chain) -> Table:
    _, entry = chain_state_matrix(chain)
    return np.ascontiguousarray(_answers(chain, entry[:, None], SERIES_TERMS)[..., 0].transpose(2, 1, 0))


def _own_markov(between: Table) -> Table:
    """Of every cell after an impulse in itself, shape (cells, 2, MARKOV_TERMS)."""
    return np.ascontiguousarray(np.diagonal(between, axis1=2, axis2=3).transpose(2, 1, 0))


def cross_answers(between: Table, window: float) -> Vector:
    """Bound how an impulse in one cell changes dp/dt of another within a window, over its own; by distance.

    Shape (cells,): entry d is the largest among cells d apart; entry 0 is not used.
    """
    cells = between.shape[2]
    path = np.abs(between[:, PATH])
    answer = sum(path[k] * window ** (k - 1) / math.factorial(k - 1) for k in range(1, MARKOV_TERMS))
    relative = answer / np.diagonal(path[1])[:, None]
    distance = np.abs(np.subtract.outer(np.arange(cells), np.arange(cells)))
    return np.asarray([np.max(relative[distance == d]) for d in range(cells)])


def _windows(between: Table, lengths: list[float], allowed: float) -> tuple[Vector, NDArray[np.int64]]:
    """Choose the windows and who may not be busy together in them.

    In the last even neighbours may.
    """
    lengths = list(lengths)
    clash = [_clash(cross_answers(between, length), allowed) for length in lengths]
    for _ in range(MOST_HALVINGS):
        if clash[-1] == 0:
            break
        lengths.append(0.5 * lengths[-1])
        clash.append(_clash(cross_answers(between, lengths[-1]), allowed))
    kept = [k for k in range(len(lengths)) if k + 1 == len(lengths) or k < KEPT]
    return np.array([lengths[k] for k in kept]), np.array([clash[k] for k in kept], dtype=np.int64)


def _struck(markov: Table, fastest: float) -> Table:
    """Give what an impulse on p in a cell makes of its p, by powers of fastest * t."""
    struck = np.zeros((len(markov), TERMS, P + 1))
    for m in range(TERMS):
        struck[:, m, P] = -markov[:, m] / (math.factorial(m) * fastest**m)
    return struck


def _clash(answers: Vector, allowed: float) -> int:
    return max((d for d in range(1, len(answers)) if answers[d] > allowed), default=0)


def _law_row(cell: Specimen) -> Vector:
    par, power = parameters(cell), power_terms(cell)
    row = np.zeros(LAW_SIZE)
    row[:HALVES] = (
        YIELDING if power is None else POWER,
        par.lower,
        par.upper,
        par.linear_stiffness,
        par.contact_stiffness,
        par.loss,
        0.0 if power is None else power.inverse_reference,
    )
    if power is not None:
        row[HALVES : HALVES + MOST_TERMS] = power.halves
        row[HALVES + MOST_TERMS :] = power.forces
    return row
