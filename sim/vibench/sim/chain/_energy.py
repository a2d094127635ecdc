"""Energy in the cells of a chain: motion, springs and stops. SI units."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..exponents.blocking import blocked_mean
from ..model.arrays import Floats
from ..model.power_law import PowerLaw
from ..model.specimen import Specimen
from ._chain import MASSES_PER_CELL, Chain


def chain_energies(chain: Chain, states: ArrayLike, base_m: ArrayLike = 0.0) -> Floats:
    """Energy of every cell: of its masses, its springs with the link to the cell before, and its stops.

    Parameters
    ----------
    chain
        The cells.
    states
        x, y, z, vx, vy, vz of every cell [m, m/s], absolute, shape (..., cells, 6).
    base_m
        Displacement of the base at the same instants [m], shape (...).

    Returns
    -------
    Shape (..., cells) [J]. Without damping and with the base at rest their sum stays as it is. The energy
    that a Hunt and Crossley contact stores is that of its Hertz spring.

    """
    motion = np.asarray(states, dtype=np.float64)
    x, y, z = (motion[..., k] for k in range(MASSES_PER_CELL))
    base = np.broadcast_to(np.asarray(base_m, dtype=np.float64)[..., None], (*x.shape[:-1], 1))
    before = np.concatenate([base, x[..., :-1]], axis=-1)
    masses = np.array([cell.masses for cell in chain.cells])
    springs = np.array([cell.stiffnesses for cell in chain.cells])
    stretched = np.stack([x - before, y - z, z - x], axis=-1)
    smooth = np.sum(masses * motion[..., MASSES_PER_CELL:] ** 2 + springs * stretched**2, axis=-1)
    stops = [_in_stops(cell, (y - z)[..., place]) for place, cell in enumerate(chain.cells)]
    return np.asarray(0.5 * smooth + np.stack(stops, axis=-1), dtype=np.float64)


class MeanEnergies(NamedTuple):
    """Energy of every cell over a run; shapes (cells,)."""

    mean_j: Floats
    standard_error_j: Floats
    """Of the mean, by blocks long enough to be independent."""


def mean_energies(chain: Chain, states: ArrayLike, base_m: ArrayLike = 0.0) -> MeanEnergies:
    """Average `chain_energies` over evenly spaced instants, states of shape (n, cells, 6).

    Parameters
    ----------
    chain
        What moved.
    states
        Shape (n, cells, 6) [m, m/s].
    base_m
        Displacement of the base, shape (n,) or one number [m].

    """
    found = [blocked_mean(row) for row in chain_energies(chain, states, base_m).T]
    return MeanEnergies(
        np.array([each.mean for each in found]), np.array([each.standard_error for each in found])
    )


def _in_stops(cell: Specimen, p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integral of a cell's contact force over p from 0 on [J]."""
    match cell.contact:
        case PowerLaw(reference=reference, terms=terms):
            part = p / reference
            parts = [force * reference / (n + 1.0) * part ** (n + 1) for n, force in terms]
            return np.asarray(np.sum(parts, axis=0))
        case law:
            lower, upper = cell.gaps_m
            depth = np.maximum(np.maximum(p - upper, -p - lower), 0.0)
            hertz = law.stops.contact_stiffness * depth**2.5 / 2.5
            return np.asarray(0.5 * law.stops.linear_stiffness * depth**2 + hertz)
