"""The force of a moving base on the first m0, k0 U + c0 dU/dt, as polynomials on equal pieces. SI units.

Harmonic drives need none of it: the engine knows them. Of others the force is one more known force
(docs/decisions/0011-chains.md).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.arrays import Table
from ..model.drive import Drive, Harmonic, LinearSweep, LogarithmicSweep, Sampled
from ..model.specimen import Specimen
from ..motion.base_motion import sampled_motion
from ._tables import WINDOW_TURN, ChainTables

PIECE_TERMS = 8
"""Through eight Chebyshev points of a piece of `WINDOW_TURN` a sine is off by 1e-14."""
ALMOST = 1e-9
"""Part of a piece that is rounding."""
_NODES: NDArray[np.float64] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(PIECE_TERMS) + 0.5) / PIECE_TERMS)

BATCH = 1 << 16
"""Pieces of a sweep that are cut at a time: bounds the memory of a long sweep."""
BaseDrive = Sampled | LinearSweep | LogarithmicSweep
"""What is cut into pieces."""


class Pieces(NamedTuple):
    """Consecutive polynomials."""

    terms: Table
    """Of the force on every piece, in powers of the time since it began, shape (pieces, PIECE_TERMS)."""
    start_s: float
    """When the first of them begins."""
    length_s: float
    """Of each."""


def pieces_between(
    tables: ChainTables, first: Specimen, drive: BaseDrive, start_s: float, end_s: float
) -> Iterator[tuple[Pieces, float]]:
    """Give the drive's pieces, a batch at a time, and when each batch ends [s]."""
    interval, count = _grid(tables, drive)
    begin = min(int(start_s / interval * (1.0 + ALMOST)), count - 1)
    while True:
        stop = count if isinstance(drive, Sampled) else min(begin + BATCH, count)
        until = end_s if stop == count else min(end_s, stop * interval)
        yield Pieces(_cut(drive, first, interval, begin, stop), begin * interval, interval), until
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
