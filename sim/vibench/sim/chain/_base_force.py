"""The force of a moving base on the first m0, k0 U + c0 dU/dt, as polynomials on equal pieces. SI units.

Harmonic drives need none of it: they are one more turning term of the chain. Of others the force is one more
force with known integrals: what it does to every cell follows from them as from a contact's
(docs/decisions/0011-chains.md).
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..flight import SERIES_TERMS
from ..kernels import Complex, Table, Vector, inlined, kernel_without_refcount, time_until
from ..model import Drive, Harmonic, LinearSweep, LogarithmicSweep, Sampled, Specimen
from ..motion import sampled_motion
from ._cell_flow import MOMENTS, WINDOW_TURN
from ._tables import PATH, ChainTables

PIECE_TERMS = 8
"""Through eight Chebyshev points of a piece of `WINDOW_TURN` a sine is off by 1e-14."""
ALMOST = 1e-9
"""Part of a piece that is rounding."""
_NODES: NDArray[np.float64] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(PIECE_TERMS) + 0.5) / PIECE_TERMS)
_SHARES: NDArray[np.float64] = np.array(
    [[math.factorial(m) / math.factorial(m + k + 1) for k in range(SERIES_TERMS)] for m in range(PIECE_TERMS)]
)
"""The (k+1)-fold integral of t^m is this times t^(m+k+1); shape (m, k)."""

BATCH = 1 << 16
"""Pieces of a sweep that are cut at a time: bounds the memory of a long sweep."""
BaseDrive = Sampled | LinearSweep | LogarithmicSweep
"""What is cut into pieces."""


def with_pieces(
    tables: ChainTables, first: Specimen, drive: BaseDrive, start_s: float, end_s: float
) -> Iterator[tuple[ChainTables, float]]:
    """Give the tables of a chain with the drive's pieces, a batch at a time, and when each batch ends [s]."""
    interval, count = _grid(tables, drive)
    begin = min(int(start_s / interval * (1.0 + ALMOST)), count - 1)
    while True:
        stop = count if isinstance(drive, Sampled) else min(begin + BATCH, count)
        pieces = _cut(drive, first, interval, begin, stop)
        until = end_s if stop == count else min(end_s, stop * interval)
        yield tables._replace(pieces=pieces, piece_start=begin * interval, piece_s=interval), until
        if until >= end_s:
            return
        begin = stop


def longest_window_s(tables: ChainTables, drive: Drive) -> float:
    """Give the most time that a window may take: none reaches beyond a piece of the drive."""
    window = float(tables.windows[0])
    match drive:
        case Harmonic():
            return window
        case _:
            return min(window, _grid(tables, drive)[0])


def _grid(tables: ChainTables, drive: BaseDrive) -> tuple[float, int]:
    """Length and number of pieces."""
    match drive:
        case Sampled():
            return 1.0 / drive.sample_rate_hz, len(drive.displacement_m) - 1
        case _:
            longest = min(float(tables.windows[0]), WINDOW_TURN / (2.0 * math.pi * drive.highest_hz))
            count = math.ceil(drive.duration_s / longest)
            return drive.duration_s / count, count


def _cut(drive: BaseDrive, first: Specimen, interval: float, begin: int, stop: int) -> Table:
    """Coefficients of the force on every piece, in powers of the time since it began, shape (pieces, 8)."""
    spring, damper = first.stiffnesses[0], first.dampings[0]
    match drive:
        case Sampled():
            cubic = sampled_motion(drive).pieces[begin:stop]
            pieces = np.zeros((stop - begin, PIECE_TERMS))
            pieces[:, :4] = spring * cubic
            pieces[:, :3] += damper * cubic[:, 1:] * [1.0, 2.0, 3.0]
            return pieces
        case _:
            time_s = (np.arange(begin, stop)[:, None] + _NODES) * interval
            turns = drive.turns(time_s)
            angle = 2.0 * np.pi * (turns - np.floor(turns))
            rate = 2.0 * np.pi * drive.frequency_hz(time_s)
            force = drive.amplitude_m * (spring * np.sin(angle) + damper * rate * np.cos(angle))
            powers = np.linalg.inv(np.vander(_NODES, increasing=True)).T
            return np.ascontiguousarray(force @ powers / interval ** np.arange(PIECE_TERMS))


@kernel_without_refcount
def place_force(force: Vector, clock: Vector, tables: ChainTables) -> float:
    """Write the force as a polynomial in the time from now on; gives how long it holds [s]."""
    pieces, length = tables.pieces, tables.piece_s
    now = -time_until(clock, tables.piece_start)
    index = min(max(int(now / length), 0), len(pieces) - 1)
    left = time_until(clock, tables.piece_start + (index + 1) * length)
    if left <= ALMOST * length and index + 1 < len(pieces):
        index += 1
        left += length
    at = length - left
    for k in range(PIECE_TERMS):
        force[k] = pieces[index, k]
    for low in range(PIECE_TERMS - 1):
        for k in range(PIECE_TERMS - 2, low - 1, -1):
            force[k] += at * force[k + 1]
    return left if index + 1 < len(pieces) else np.inf


@kernel_without_refcount
def deposit_base(turned: Complex, force: Vector, length: float, tables: ChainTables) -> None:
    """Add to the phasors what the base's force did by ``length`` after the window began."""
    if len(tables.pieces) == 0:
        return
    for j in range(len(turned) - 1):
        rate, total = tables.rates[j], complex(0.0, 0.0)
        for k in range(MOMENTS - 1, -1, -1):
            moment = 0.0
            for m in range(PIECE_TERMS - 1, -1, -1):
                moment = moment * length + _SHARES[m, k] * force[m]
            total = total * rate * length + moment
        turned[j] += tables.base_push[j] * total * length


@kernel_without_refcount
def add_base_series(series: Vector, force: Vector, cell: int, what: int, tables: ChainTables) -> None:
    """Add what the base's force makes of p or x of a cell to its polynomial."""
    if len(tables.pieces) == 0:
        return
    answer = tables.base_markov[cell, what]
    for n in range(1, SERIES_TERMS):
        for m in range(min(n, PIECE_TERMS)):
            series[n] += _SHARES[m, n - 1 - m] * force[m] * answer[n - 1 - m]


@inlined
def base_curvature(force: Vector, cell: int, length: float, tables: ChainTables) -> float:
    """Bound of the second derivative of a cell's p that the base's force makes within ``length``."""
    bound, answer = 0.0, tables.base_markov[cell, PATH]
    for n in range(SERIES_TERMS - 1, 1, -1):
        term = 0.0
        for m in range(min(n, PIECE_TERMS)):
            term += abs(_SHARES[m, n - 1 - m] * force[m] * answer[n - 1 - m])
        bound = bound * length + n * (n - 1.0) * term
    return bound
