"""The specimen with m1 held on m2 by a rigid stop: two bodies, solved exactly. SI units.

While m1 sticks to a stop, m1 and m2 move as one: y = z + side * gap, and the spring and damper between them
are inside a rigid body. What is left is linear with two displacements, x and z, and one condition: the
stop can only push. The native engine follows the motion and finds where that condition ends.

The motion is one table (kernels copy every array they are handed): a term a row, modes first, the drive last.
"""

import numpy as np

from ..kernels.arrays import Complex
from .modes import diagonal_form
from .specimen import JOIN, Specimen, bound_matrices
from .state import VX, VZ, X, Z

RATE = 0
"""Column of l_j [1/s]."""
SHAPE = slice(1, 7)
"""Columns of the motion of a unit phasor in x, y, z, vx, vy, vz; y without the gap, which is a constant."""
ROW = slice(7, 13)
"""Columns of the left row, which reads x, z, vx, vz of a state and nothing else; zero for the drive."""
PULL = 13
"""Column of what a unit phasor adds to the force k2 (z - x) + c2 (vz - vx) by which m2 pulls at m0 [N]."""
COLUMNS = 14

PLACES = [X, Z, VX, VZ]
"""Where the four unknowns of the bound motion stand in a state."""


def bound_motion(specimen: Specimen, omega: float, amplitude_m: float) -> Complex:
    """Diagonalise the bound motion under U = amplitude sin(omega t): shape (n+1, COLUMNS), n is 2 to 4.

    Raises ValueError when two bound modes coincide.
    """
    mass, damping, stiffness = bound_matrices(specimen)
    modes = diagonal_form(mass, stiffness, damping)
    dynamic = stiffness - omega**2 * mass + 1j * omega * damping
    base = -1j * amplitude_m * (specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0])
    displacement = np.linalg.solve(dynamic, np.array([base, 0.0]))
    spread = np.zeros((4, 6))
    spread[:2, :3], spread[2:, 3:] = JOIN.T, JOIN.T
    table = np.zeros((len(modes.rates) + 1, COLUMNS), dtype=np.complex128)
    table[:, RATE] = np.append(modes.rates, 1j * omega)
    table[:, SHAPE] = np.vstack([modes.shapes, [*displacement, *(1j * omega * displacement)]]) @ spread
    table[:-1, ROW][:, PLACES] = modes.rows
    x, z, vx, vz = table[:, SHAPE][:, PLACES].T
    table[:, PULL] = specimen.stiffnesses[2] * (z - x) + specimen.dampings[2] * (vz - vx)
    return table
