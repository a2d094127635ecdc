"""A chain without contact, solved exactly: modes, transmissibility, steady motion. SI units.

A state is (displacements, velocities), shape (6 cells,), in the order of `vibench.sim.chain`.
"""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels import Complex, Table, Vector
from ..model import COINCIDENT, ModalForm
from ._chain import MASSES_PER_CELL, Chain
from ._dispersion import seen_from_outside

PROPORTIONAL = 1e-12
"""Modal damping off the diagonal below this part of the largest is rounding: the undamped modes are modes."""
CRITICAL = 1e-12
"""abs(1 - damping ratio^2) below which a mode has no pair of distinct rates."""
REFUSAL = "Two modes of this chain coincide (critical damping): change a damping by 0.1 per cent."


def chain_state_matrix(chain: Chain) -> tuple[Table, Vector]:
    """Flight as d/dt s = A s + b f, with f = k0 U + c0 dU/dt of the first cell.

    Returns A, shape (6 cells, 6 cells), and b, shape (6 cells,).
    """
    size = MASSES_PER_CELL * chain.size
    system = np.zeros((2 * size, 2 * size))
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -chain.stiffness_matrix / chain.masses[:, None]
    system[size:, size:] = -chain.damping_matrix / chain.masses[:, None]
    entry = np.zeros(2 * size)
    entry[size] = 1.0 / chain.masses[0]
    return system, entry


def chain_impulses(chain: Chain) -> Table:
    """State just after a unit impulse in each cell, shape (6 cells, cells): m1 and m2 part."""
    entry = np.zeros((2 * MASSES_PER_CELL * chain.size, chain.size))
    velocities = MASSES_PER_CELL * chain.size
    for place, cell in enumerate(chain.cells):
        first = velocities + MASSES_PER_CELL * place
        _, m1, m2 = cell.masses
        entry[first + 1, place], entry[first + 2, place] = 1.0 / m1, -1.0 / m2
    return entry


def chain_modal_form(chain: Chain) -> ModalForm:
    """Diagonalise the state matrix, for any damping.

    Where the undamped modes stay modes (damping proportional to the springs, or none) they come from a
    symmetric problem, whose vectors are orthogonal however near two frequencies are.

    Raises ValueError when two modes coincide (critical damping): then no full set of modes exists.
    """
    root = np.sqrt(chain.masses)
    values, vectors = np.linalg.eigh(chain.stiffness_matrix / np.outer(root, root))
    damping = vectors.T @ (chain.damping_matrix / np.outer(root, root)) @ vectors
    diagonal = np.diag(damping)
    if np.max(np.abs(damping - np.diag(diagonal))) <= PROPORTIONAL * np.max(diagonal):
        return _undamped_shapes(values, diagonal, vectors / root[:, None], (vectors * root[:, None]).T)
    return _general(chain)


def _undamped_shapes(squares: Vector, damping: Vector, shapes: Table, rows: Table) -> ModalForm:
    """Rates, shapes and rows of q'' + damping q' + squares q = 0 in every mode."""
    parts = [
        part
        for square, loss, shape, row in zip(squares, damping, shapes.T, rows, strict=True)
        for part in _mode(square, 0.5 * loss, shape, row)
    ]
    rates, moved, read = zip(*parts, strict=True)
    return ModalForm(np.asarray(rates, np.complex128), _table(moved), _table(read))


def _mode(square: float, decay: float, shape: Vector, row: Vector) -> list[tuple[complex, Complex, Complex]]:
    """Split one mode q = row.displacement into its terms: one of a pair, or two that do not oscillate."""
    turn = square - decay * decay
    if abs(turn) <= CRITICAL * square:
        raise ValueError(REFUSAL)
    if turn > 0.0:
        omega = math.sqrt(turn)
        rate = complex(-decay, omega)
        # q = Re(e exp(rate t)) with e = q0 - i (q0' + decay q0) / omega.
        return [
            (rate, _state(shape, rate * shape), _state((1.0 - 1j * decay / omega) * row, -1j / omega * row))
        ]
    slow = -square / (decay + math.sqrt(-turn))
    fast = -decay - math.sqrt(-turn)
    return [
        (rate, _state(shape, rate * shape), _state(-other * row, row) / (rate - other))
        for rate, other in ((slow, fast), (fast, slow))
    ]


def _state(displacement: NDArray[np.generic], velocity: NDArray[np.generic]) -> Complex:
    return np.concatenate([displacement, velocity]).astype(np.complex128)


def _table(rows: Iterable[Complex]) -> Complex:
    return np.ascontiguousarray(np.vstack(list(rows)))


def _general(chain: Chain) -> ModalForm:
    """Diagonalise the state matrix as it is, in units that balance it."""
    system, _ = chain_state_matrix(chain)
    speed = 2.0 * np.pi * float(chain.natural_frequencies_hz[-1])
    root = np.sqrt(chain.masses)
    units = np.concatenate([1.0 / root, speed / root])
    values, vectors = np.linalg.eig(system / units[:, None] * units[None, :] / speed)
    if np.linalg.cond(vectors) > COINCIDENT:
        raise ValueError(REFUSAL)
    left = np.linalg.inv(vectors) / units[None, :]
    kept = values.imag >= 0.0
    weights = np.where(values.imag[kept] > 0.0, 2.0, 1.0)
    # A passive structure does not grow: a positive real part is rounding.
    rates = (np.minimum(values.real[kept], 0.0) + 1j * values.imag[kept]) * speed
    return ModalForm(
        rates=rates.astype(np.complex128),
        shapes=_table((vectors * units[:, None]).T[kept]),
        rows=_table(left[kept] * weights[:, None]),
    )


def chain_transmissibility(chain: Chain, frequency_hz: ArrayLike) -> Complex:
    """Displacement of every mass, and of every p, over the base displacement, without contact.

    Parameters
    ----------
    chain
        Its contact laws and gaps play no part.
    frequency_hz
        Shape (n,) [Hz]; zero and above.

    Returns
    -------
    Complex, shape (n, cells, 4): x, y, z and p = y - z of each cell over U; time goes as exp(+i w t).

    Raises
    ------
    ValueError
        When a frequency is negative.

    """
    frequency = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if frequency.ndim != 1 or not bool(np.all(np.isfinite(frequency) & (frequency >= 0.0))):
        msg = "Frequencies must be one row of finite numbers, zero or positive, in Hz."
        raise ValueError(msg)
    cells = [seen_from_outside(cell, 2.0 * np.pi * frequency) for cell in chain.cells]
    # From the free end: what a cell is, and what hangs on it, as one stiffness at its m0.
    seen = [cells[-1].stiffness]
    for cell, after in zip(reversed(cells[:-1]), reversed(cells[1:]), strict=True):
        seen.append(cell.stiffness + after.link * seen[-1] / (after.link + seen[-1]))
    moved = np.zeros((len(frequency), chain.size, 4), dtype=np.complex128)
    x = np.ones(len(frequency), dtype=np.complex128)
    for place, (cell, stiffness) in enumerate(zip(cells, reversed(seen), strict=True)):
        x = x * cell.link / (cell.link + stiffness)
        moved[:, place, :MASSES_PER_CELL] = np.column_stack([x, x * cell.inner, x * cell.middle])
    moved[:, :, MASSES_PER_CELL] = moved[:, :, 1] - moved[:, :, 2]
    return moved
