"""Tables for a run of a chain: engine structures of the cells, and window lengths. SI units."""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..engine.library import Structure
from ..engine.run import Accuracy, native_engine
from ..engine.scene import fill_cell
from ..motion.integrate import sampled_motion
from ..specimen.drive import Drive, Harmonic, LinearSweep, LogarithmicSweep, Sampled
from ..specimen.specimen import Floats, Specimen
from ._chain import MASSES_PER_CELL, Chain

WINDOW_TURN = 0.2
"""Largest product of window length and fastest rate in chain and drive [rad]. The tenth integral of a force
is then 1.4e-12 of the first."""
COLLISION_TURN = 0.4
"""`WINDOW_TURN` for windows that contain whole collisions; the tenth integral is then 7e-10 of the first."""
WHOLE_COLLISIONS = 1e-7
"""Smallest tolerance at which a collision is computed in one piece, as in native/collision.hpp."""
MARKOV_TERMS = 11
"""Number of Taylor coefficients of the chain's response to a unit impulse in one cell."""
REACH = MARKOV_TERMS
"""Number of cells on each side of a unit impulse that the truncated Taylor response reaches."""
COLUMNS = 2 * REACH + 1
CROSS_SHARE = 1.0
"""Largest neglected effect of a contact force on the velocity of another cell in the same window, relative to
the tolerance."""
MOST_HALVINGS = 20
KEPT = 2
"""Number of window lengths that are tried before the shortest length."""


class ChainTables(NamedTuple):
    """Engine structures of the cells, and window lengths for a chain and a drive."""

    kinds: Structure
    """One `CellKind` of native/structures.hpp for each kind of cell."""
    kind_of: Floats
    """Index of the kind of each cell, shape (cells,)."""
    fastest: float
    """Largest rate of change of the modes of the chain and of the drive [1/s]."""
    windows: Floats
    """Window lengths, the longest first, shape (windows,) [s]."""
    clash: Floats
    """For each window length, distance [cells] within which only one cell may be in contact, (windows,)."""


@lru_cache(maxsize=8)
def chain_tables(chain: Chain, drive: Drive, accuracy: Accuracy) -> ChainTables:
    """Return the engine's tables for a chain, a drive and an accuracy level; runs only read the tables."""
    links = [(cell.stiffnesses[0], cell.dampings[0]) for cell in chain.cells]
    cells = list(zip(chain.cells, [*links[1:], (0.0, 0.0)], strict=True))
    places = {each: place for place, each in enumerate(dict.fromkeys(cells))}
    kinds = native_engine().rows("CellKind", len(places))
    for (cell, link), place in places.items():
        fill_cell(kinds[place], cell, *link)
    fastest = _fastest(chain, drive)
    whole = accuracy.tolerance >= WHOLE_COLLISIONS
    turns = (COLLISION_TURN, WINDOW_TURN) if whole else (WINDOW_TURN,)
    lengths = [turn / fastest for turn in turns]
    windows, clash = _windows(chain, lengths, CROSS_SHARE * accuracy.tolerance)
    return ChainTables(kinds, np.array([float(places[each]) for each in cells]), fastest, windows, clash)


def _fastest(chain: Chain, drive: Drive) -> float:
    """Return an upper bound on the rates of all modes and of a harmonic drive [1/s].

    The rate of an oscillating mode is at most the highest undamped angular frequency; the rate of an
    overdamped mode is at most the rate of the dampers alone.
    """
    root = np.sqrt(chain.masses)
    creeping = float(np.linalg.eigvalsh(chain.damping_matrix / np.outer(root, root))[-1])
    driven = drive.frequency_hz if isinstance(drive, Harmonic) else 0.0
    return max(2.0 * math.pi * max(float(chain.natural_frequencies_hz[-1]), driven), creeping)


def markov_between(chain: Chain) -> Floats:
    """Return the Taylor coefficients of p(t) in every cell after a unit impulse in a nearby cell.

    Shape (MARKOV_TERMS, 2 REACH + 1, cells). The second axis is the distance from the cell with the impulse.
    """
    path, places = _answers(chain, np.ones((chain.size, COLUMNS))), np.arange(chain.size)
    answers = np.zeros((MARKOV_TERMS, COLUMNS, chain.size))
    for offset in range(-REACH, REACH + 1):
        heard = places[(places >= offset) & (places < chain.size + offset)]
        answers[:, offset + REACH, heard] = path[:, heard, (heard - offset) % COLUMNS]
    return answers


def _answers(chain: Chain, moves: Floats) -> Floats:
    """Return the Taylor coefficients of p(t) after unit impulses, shape (MARKOV_TERMS, cells, COLUMNS).

    Impulses too far apart to affect the same cell share a column. ``moves`` is 0 for fixed cells, else 1.
    """
    places, masses = np.arange(chain.size), chain.masses.reshape(chain.size, MASSES_PER_CELL)
    rates = np.zeros((MASSES_PER_CELL, chain.size, COLUMNS))
    rates[1, places, places % COLUMNS] = 1.0 / masses[:, 1]
    rates[2, places, places % COLUMNS] = -1.0 / masses[:, 2]
    displacements, path = np.zeros_like(rates), []
    for _ in range(MARKOV_TERMS):
        path.append(displacements[1] - displacements[2])
        displacements, rates = rates, moves * _accelerations(chain, displacements, rates)
    return np.array(path)


def _accelerations(chain: Chain, displacements: Floats, rates: Floats) -> Floats:
    """Return the accelerations without contact and drive, shape (masses of a cell, cells, columns)."""
    masses = chain.masses.reshape(chain.size, MASSES_PER_CELL)
    springs, dampers = (
        np.array(values).T[..., None]
        for values in zip(*((cell.stiffnesses, cell.dampings) for cell in chain.cells), strict=True)
    )
    outer, inner, middle = (
        spring * _stretches(displacements)[link] + damper * _stretches(rates)[link]
        for link, (spring, damper) in enumerate(zip(springs, dampers, strict=True))
    )
    behind = np.concatenate([outer[1:], np.zeros_like(outer[:1])])
    return np.stack([middle - outer + behind, -inner, inner - middle]) / masses.T[..., None]


def _stretches(motion: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the elongations of the three springs of every cell, from the displacements."""
    x, y, z = motion
    return np.diff(x, axis=0, prepend=0.0), y - z, z - x


def cross_answers(between: Floats, window: float) -> Floats:
    """Return bounds on dp/dt of other cells, relative to the struck cell's, in a window after an impulse.

    Shape (REACH + 1,): entry d is the bound for cells at distance d; entry 0 is not used.
    """
    own = between[1, REACH]
    relative = np.max(_answer_within(between, window) / own, axis=1)
    return np.asarray(np.maximum(relative[REACH:], relative[REACH::-1]))


def _answer_within(coefficients: Floats, window: float) -> Floats:
    """Return a bound on the derivative of Taylor series within ``window`` [s]; first axis: coefficients."""
    orders = range(1, MARKOV_TERMS)
    return np.asarray(
        sum(np.abs(coefficients[k]) * window ** (k - 1) / math.factorial(k - 1) for k in orders)
    )


def _back_action(chain: Chain, between: Floats, window: float) -> float:
    """Return a bound on the velocity that a cell's motion causes in the cell itself via its neighbours."""
    places = np.arange(chain.size)
    only_itself = places[:, None] % COLUMNS == np.arange(COLUMNS)
    alone = _answers(chain, only_itself * 1.0)[:, places, places % COLUMNS]
    own = between[:, REACH]
    return float(np.max(_answer_within(own - alone, window) / own[1]))


def _windows(chain: Chain, lengths: list[float], allowed: float) -> tuple[Floats, Floats]:
    """Return window lengths, and for each length the distance within which only one cell may be in contact.

    In the shortest window, even neighbours may both be in contact. In every window a cell in contact is
    integrated as if its neighbours did not react; windows are shortened until this error is negligible.
    """
    between = markov_between(chain)
    shortened = 1.0
    for _ in range(MOST_HALVINGS):
        if _back_action(chain, between, shortened * lengths[0]) <= allowed:
            break
        shortened *= 0.5
    lengths = [shortened * length for length in lengths]
    clash = [_clash(cross_answers(between, length), allowed) for length in lengths]
    for _ in range(MOST_HALVINGS):
        if clash[-1] == 0:
            break
        lengths.append(0.5 * lengths[-1])
        clash.append(_clash(cross_answers(between, lengths[-1]), allowed))
    kept = [k for k in range(len(lengths)) if k + 1 == len(lengths) or k < KEPT]
    return np.array([lengths[k] for k in kept]), np.array([float(clash[k]) for k in kept])


def _clash(answers: Floats, allowed: float) -> int:
    return max((d for d in range(1, len(answers)) if answers[d] > allowed), default=0)


# Force of the base on the first m0, k0 U + c0 dU/dt, as polynomials on equal intervals (pieces). SI units.
#
# The engine treats harmonic drives exactly. Other drives act as an additional known force
# (docs/decisions/0011-chains.md).

PIECE_TERMS = 8
"""Number of polynomial terms per piece of drive; eight terms fit a sine to 1e-14 over `WINDOW_TURN` rad."""
ALMOST = 1e-9
"""Tolerance for rounding errors of time, relative to the length of a piece of the drive."""
_NODES: NDArray[np.float64] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(PIECE_TERMS) + 0.5) / PIECE_TERMS)

BATCH = 1 << 16
"""Number of pieces of a sweep computed at once, limited to save memory in long sweeps."""
BaseDrive = Sampled | LinearSweep | LogarithmicSweep
"""Drives that are divided into polynomial pieces."""


class Pieces(NamedTuple):
    """Force of the base on the first m0, as a piecewise polynomial of time."""

    terms: Floats
    """Coefficients of the force, in powers of the time since the start of each piece, shape (pieces,
    PIECE_TERMS)."""
    start_s: float
    """Start time of the first piece [s]."""
    length_s: float
    """Duration of each piece [s]."""


def pieces_between(
    tables: ChainTables, first: Specimen, drive: BaseDrive, start_s: float, end_s: float
) -> Iterator[tuple[Pieces, float]]:
    """Yield the polynomial pieces of the drive in batches, with the end time of each batch [s]."""
    interval, count = _grid(tables, drive)
    begin = min(int(start_s / interval * (1.0 + ALMOST)), count - 1)
    while True:
        stop = count if isinstance(drive, Sampled) else min(begin + BATCH, count)
        until = end_s if stop == count else min(end_s, stop * interval)
        yield Pieces(_force_table(drive, first, interval, begin, stop), begin * interval, interval), until
        if until >= end_s:
            return
        begin = stop


def longest_window_s(tables: ChainTables, drive: Drive) -> float:
    """Return the length of the longest window [s], which is at most one piece of the drive."""
    window = float(tables.windows[0])
    return window if isinstance(drive, Harmonic) else min(window, _grid(tables, drive)[0])


def _grid(tables: ChainTables, drive: BaseDrive) -> tuple[float, int]:
    """Return the length [s] and the number of the pieces into which the drive is divided."""
    match drive:
        case Sampled():
            return 1.0 / drive.sample_rate_hz, len(drive.displacement_m) - 1
        case _:
            longest = min(float(tables.windows[0]), WINDOW_TURN / (2.0 * math.pi * drive.highest_hz))
            count = math.ceil(drive.duration_s / longest)
            return drive.duration_s / count, count


def _force_table(drive: BaseDrive, first: Specimen, interval: float, begin: int, stop: int) -> Floats:
    """Return the coefficients of the force on every piece, as in `Pieces.terms`, shape (pieces, 8)."""
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
