"""Matrices of a chain without contact; a state is (displacements, velocities), shape (6 cells,)."""

import numpy as np

MASSES_PER_CELL = 3


def chain_state_matrix(chain):
    """Return the state equation without contact, d/dt s = A s + b f, f = k0 U + c0 dU/dt of cell 1.

    A has the shape (6 cells, 6 cells), b the shape (6 cells,).
    """
    size = MASSES_PER_CELL * chain.size
    system = np.zeros((2 * size, 2 * size))
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -chain.stiffness_matrix / chain.masses[:, None]
    system[size:, size:] = -chain.damping_matrix / chain.masses[:, None]
    entry = np.zeros(2 * size)
    entry[size] = 1.0 / chain.masses[0]
    return system, entry


def chain_impulses(chain):
    """Return the state after a unit impulse between m1 and m2 of each cell, shape (6 cells, cells)."""
    entry = np.zeros((2 * MASSES_PER_CELL * chain.size, chain.size))
    velocities = MASSES_PER_CELL * chain.size
    for place, cell in enumerate(chain.cells):
        first = velocities + MASSES_PER_CELL * place
        _, m1, m2 = cell.masses
        entry[first + 1, place], entry[first + 2, place] = 1.0 / m1, -1.0 / m2
    return entry
