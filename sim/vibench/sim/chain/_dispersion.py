"""Waves in an infinite chain without contact: bands, band gaps, attenuation per unit. SI units.

The chain repeats a unit of one or several cells. In each cell, m1 and m2 act on m0 as a dynamic stiffness
S(w). With the link K = k0 + i w c0 to the previous cell, the displacement x of m0 and the force f in the link
change from cell to cell by

    x' = x + f / K,    f' = f + (S - w^2 m0) x'

From unit to unit a wave is multiplied by exp(i mu), an eigenvalue of the product of these transfer matrices,
whose determinant is 1 (Brillouin, Wave Propagation in Periodic Structures, 2nd ed. 1953, chapters IV, V, X).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..specimen.modes import angular_frequencies
from ..specimen.specimen import Complex, Specimen
from ._chain import MASSES_PER_CELL, Chain

TOUCHING = 1e-9
"""Relative width below which a band gap is only a rounding error, as occurs in units of equal cells."""


def bloch_factor(unit: Chain, frequency_hz: ArrayLike) -> Complex:
    """Return the ratio of the motions of successive units, for the outgoing or decaying wave.

    Raises ValueError when a frequency is not positive.

    Parameters
    ----------
    unit
        Cells of the unit; contact laws and gaps are ignored.
    frequency_hz
        Positive frequencies, shape (n,) [Hz].

    Returns
    -------
    exp(i mu), shape (n,). Its magnitude is 1 in a band without damping, and below 1 in a gap or with damping.
    """
    omega = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if not bool(np.all(np.isfinite(omega) & (omega > 0.0))):
        raise ValueError("Frequencies must be finite and positive, in Hz.")
    across = np.tile(np.eye(2, dtype=np.complex128), (len(omega), 1, 1))
    for cell in unit.cells:
        outer, pushed, _, _ = reduce_to_m0(cell, omega)
        one = np.ones_like(outer)
        across = np.moveaxis(np.array([[one, 1.0 / outer], [pushed, one + pushed / outer]]), -1, 0) @ across
    cosine = 0.5 * (across[:, 0, 0] + across[:, 1, 1])
    # The product of the roots of q^2 - 2 cosine q + 1 is 1. Only the larger root has no cancellation.
    root = np.sqrt(cosine**2 - 1.0 + 0j)
    larger = np.where(np.abs(cosine + root) >= np.abs(cosine - root), cosine + root, cosine - root)
    return np.asarray(1.0 / larger, dtype=np.complex128)


class CellResponse(NamedTuple):
    """Response of a cell to harmonic motion of its m0; each field has shape (n,)."""

    link: Complex
    """Stiffness of the link to the previous cell, K = k0 + i w c0 [N/m]."""
    stiffness: Complex
    """Ratio of force to displacement at m0 if the link is removed, S(w) - w^2 m0 [N/m]."""
    inner: Complex
    """Ratio y / x of the displacements of m1 and m0."""
    middle: Complex
    """Ratio z / x of the displacements of m2 and m0."""


def reduce_to_m0(cell: Specimen, omega: NDArray[np.float64]) -> CellResponse:
    """Return the response of a cell to a motion of its m0, without contact; finite even if m1 resonates."""
    m0, m1, m2 = cell.masses
    outer, inner, middle = (
        stiffness + 1j * omega * damping
        for stiffness, damping in zip(cell.stiffnesses, cell.dampings, strict=True)
    )
    square = omega**2
    held = inner - square * m1
    hung = -square * (m2 * held + m1 * inner)
    whole = middle * held + hung
    seen = outer, middle * hung / whole - square * m0, middle * inner / whole, middle * held / whole
    return CellResponse(*(np.asarray(each, dtype=np.complex128) for each in seen))


def band_frequencies_hz(unit: Chain, wave_number: ArrayLike) -> NDArray[np.float64]:
    """Return the frequencies of undamped waves at given wave numbers, ascending, shape (n, 3 cells) [Hz].

    ``wave_number`` is the phase difference from unit to unit, shape (n,) [rad].

    Raises ValueError when a wave number is not finite.
    """
    phase = np.atleast_1d(np.asarray(wave_number, dtype=np.float64))
    if not np.all(np.isfinite(phase)):
        raise ValueError("A wave number that is not finite is not allowed: give radians per unit.")
    root = np.sqrt(unit.masses)
    first, last, link = 0, MASSES_PER_CELL * (unit.size - 1), unit.cells[0].stiffnesses[0]
    # The first cell is coupled to the previous unit's last cell; the previous unit lags by the phase.
    stiffness = np.tile(unit.stiffness_matrix.astype(np.complex128), (len(phase), 1, 1))
    stiffness[:, last, last] += link
    stiffness[:, first, last] -= link * np.exp(-1j * phase)
    stiffness[:, last, first] -= link * np.exp(1j * phase)
    squares = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), dtype=np.float64)


class BandGap(NamedTuple):
    """Frequency range in which no wave propagates [Hz]; the upper end of the last gap is infinite."""

    lower_hz: float
    upper_hz: float


def band_gaps(unit: Chain) -> tuple[BandGap, ...]:
    """Return the band gaps of the infinite chain without damping and contact.

    Units are coupled by one displacement only; in a band, frequency is therefore monotone in mu from 0 to pi.
    """
    ends = band_frequencies_hz(unit, [0.0, np.pi])
    lowest, highest = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
    return tuple(
        BandGap(below, above)
        for below, above in zip(highest, [*lowest[1:], float("inf")], strict=True)
        if below < above * (1.0 - TOUCHING) or above == float("inf")
    )


def chain_transmissibility(chain: Chain, frequency_hz: ArrayLike) -> Complex:
    """Return the transmissibility without contact: ratios of x, y, z and p to the base motion.

    Raises ValueError when a frequency is negative.

    Parameters
    ----------
    chain
        Chain; contact laws and gaps are ignored.
    frequency_hz
        Frequencies, zero or positive, shape (n,) [Hz].

    Returns
    -------
    Complex, shape (n, cells, 4): x, y, z and p = y - z of each cell, divided by U, for exp(+i w t).
    """
    omega = angular_frequencies(frequency_hz)
    cells = [reduce_to_m0(cell, omega) for cell in chain.cells]
    # Start at the free end. Reduce each cell and all cells behind it to a dynamic stiffness at its m0.
    seen = [cells[-1].stiffness]
    for cell, after in zip(reversed(cells[:-1]), reversed(cells[1:]), strict=True):
        seen.append(cell.stiffness + after.link * seen[-1] / (after.link + seen[-1]))
    moved = np.zeros((len(omega), chain.size, 4), dtype=np.complex128)
    x = np.ones(len(omega), dtype=np.complex128)
    for place, (cell, stiffness) in enumerate(zip(cells, reversed(seen), strict=True)):
        x = x * cell.link / (cell.link + stiffness)
        moved[:, place, :MASSES_PER_CELL] = np.column_stack([x, x * cell.inner, x * cell.middle])
    moved[:, :, MASSES_PER_CELL] = moved[:, :, 1] - moved[:, :, 2]
    return moved
