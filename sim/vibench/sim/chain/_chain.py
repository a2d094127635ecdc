"""Chain of vibro-impact cells, coupled at their outer masses. SI units.

Cell i is a `Specimen` whose (k0, c0) couple its m0 to the m0 of the previous cell; the first cell is coupled
to the base. The far end is free. Displacements have the order x1, y1, z1, x2, y2, z2, ...
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..specimen.specimen import Floats, Specimen, Triple, links_matrix
from ..specimen.stops import Strict

MASSES_PER_CELL = 3
"""Number of masses of a cell: m0, m1, m2 with displacements x, y, z."""
MOST_CELLS = 1000
"""Largest number of cells; the modal matrices of a longer chain do not fit into ordinary memory."""


@dataclass(frozen=True)
class Chain(Strict):
    """Chain of cells; each cell may have different parameters."""

    cells: tuple[Specimen, ...]
    """Cells from the base to the free end; (k0, c0) couple cell 0 to the base, and cell i to cell i - 1."""

    def __post_init__(self) -> None:
        if not 1 <= len(self.cells) <= MOST_CELLS:
            raise ValueError(f"A chain of {len(self.cells)} cells is not allowed: give 1 to {MOST_CELLS}.")
        for place, cell in enumerate(self.cells, start=1):
            if cell.contact.stops.restitution is not None:
                raise ValueError(
                    f"Cell {place} has rigid stops, which a chain cannot simulate: give compliant stops, "
                    "such as hunt_crossley:0.5."
                )

    @property
    def size(self) -> int:
        """Number of cells of the chain."""
        return len(self.cells)

    @property
    def masses(self) -> NDArray[np.float64]:
        """Masses m0, m1, m2 of every cell, shape (3 cells,) [kg]."""
        return np.asarray([mass for cell in self.cells for mass in cell.masses])

    @property
    def stiffness_matrix(self) -> Floats:
        """Stiffness matrix K of the chain without contact, shape (3 cells, 3 cells) [N/m]."""
        return _assemble([cell.stiffnesses for cell in self.cells])

    @property
    def damping_matrix(self) -> Floats:
        """Damping matrix C of the chain without contact, shape (3 cells, 3 cells) [N s/m]."""
        return _assemble([cell.dampings for cell in self.cells])

    @cached_property
    def natural_frequencies_hz(self) -> NDArray[np.float64]:
        """Undamped natural frequencies of the chain without contact, ascending, shape (3 cells,) [Hz]."""
        root = np.sqrt(self.masses)
        values = np.linalg.eigvalsh(self.stiffness_matrix / np.outer(root, root))
        return np.asarray(np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), dtype=np.float64)


def chain_of(specimen: Specimen, cells: int) -> Chain:
    """Return a chain of equal cells.

    Raises ValueError when the number of cells is not allowed.

    Parameters
    ----------
    specimen
        One cell; its k0 and c0 are the coupling to the base and between cells.
    cells
        Number of cells, from 1 to `MOST_CELLS`; a single cell is the specimen itself.
    """
    if not 1 <= cells <= MOST_CELLS:
        raise ValueError(f"A chain of {cells} cells is not allowed: give 1 to {MOST_CELLS}.")
    return Chain((specimen,) * cells)


def _assemble(links: list[Triple]) -> Floats:
    """Return the stiffness or damping matrix of a chain from k_i or c_i, i = 0, 1, 2, of every cell."""
    size = MASSES_PER_CELL * len(links)
    matrix = np.zeros((size, size))
    for x, link in zip(range(0, size, MASSES_PER_CELL), links, strict=True):
        own = slice(x, x + MASSES_PER_CELL)
        matrix[own, own] += links_matrix(link)
        if x > 0:
            before = x - MASSES_PER_CELL
            matrix[before, before] += link[0]
            matrix[before, x] = matrix[x, before] = -link[0]
    return matrix
