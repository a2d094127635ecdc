"""A chain without contact, solved exactly: its transmissibility. SI units."""

import numpy as np
from numpy.typing import ArrayLike

from ..model.arrays import Complex
from ._chain import MASSES_PER_CELL, Chain
from ._dispersion import seen_from_outside


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
