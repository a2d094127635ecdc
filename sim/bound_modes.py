"""The specimen with m1 held on m2 by a rigid stop: two bodies, solved exactly. SI units.

While m1 sticks to a stop, m1 and m2 move as one: y = z + side * gap, and the spring and damper between them
are inside a rigid body. What is left is linear with two displacements, x and z, and one condition: the
stop can only push. `sim.stick` follows the motion and finds where that condition ends.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .modes import Complex, diagonal_form
from .parameters import VX, VZ, X, Z
from .specimen import Specimen

JOIN = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
"""(x, y, z) of a unit of x and of z; y without the gap, which is a constant."""
PLACES = [X, Z, VX, VZ]
"""Where the four unknowns of the bound motion stand in a state."""


class BoundTables(NamedTuple):
    """Bound motion, diagonalised, like `sim.flight.FlightTables`: n modes, and the drive as term n."""

    rates: Complex
    """Shape (n+1,) [1/s]; n is 2 to 4."""
    squares: NDArray[np.float64]
    shapes: Complex
    """Shape (n+1, 6): motion of a unit phasor, y without the gap."""
    rows: Complex
    """Shape (n, 6): they read x, z, vx, vz of a state and nothing else."""
    across: Complex
    """What a unit phasor adds to x, shape (n+1,)."""
    pull: Complex
    """What it adds to the force k2 (z - x) + c2 (vz - vx) that m0 puts on m2, downwards [N]."""
    still: Complex
    """What it adds to p: nothing."""
    grid: float
    """A stretch short enough for the Taylor series of detection [s]."""
    factors: Complex
    """exp(l_j grid)."""


def no_bound_tables() -> BoundTables:
    """Stand in where no stop is rigid: kernels need the shape of the tables, never their numbers."""
    none = np.zeros(1, dtype=np.complex128)
    table = np.zeros((1, 6), dtype=np.complex128)
    return BoundTables(none, np.zeros(1), table, table, none, none, none, 0.0, none)


def bound_tables(specimen: Specimen, omega: float, amplitude_m: float, turn: float) -> BoundTables:
    """Diagonalise the bound motion under U = amplitude sin(omega t).

    ``turn`` is the fastest rate times the grid step [rad]. Raises ValueError when two bound modes coincide.
    """
    mass = JOIN.T @ specimen.mass_matrix @ JOIN
    damping = JOIN.T @ specimen.damping_matrix @ JOIN
    stiffness = JOIN.T @ specimen.stiffness_matrix @ JOIN
    modes = diagonal_form(mass, stiffness, damping)
    dynamic = stiffness - omega**2 * mass + 1j * omega * damping
    base = -1j * amplitude_m * (specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0])
    displacement = np.linalg.solve(dynamic, np.array([base, 0.0]))
    motion = np.concatenate([displacement, 1j * omega * displacement])
    rates = np.append(modes.rates, 1j * omega)
    spread = np.zeros((4, 6))
    spread[:2, :3], spread[2:, 3:] = JOIN.T, JOIN.T
    shapes = np.ascontiguousarray(np.vstack([modes.shapes, motion]) @ spread, dtype=np.complex128)
    rows = np.zeros((len(modes.rates), 6), dtype=np.complex128)
    rows[:, PLACES] = modes.rows
    k2, c2 = specimen.stiffnesses[2], specimen.dampings[2]
    pull = k2 * (shapes[:, Z] - shapes[:, X]) + c2 * (shapes[:, VZ] - shapes[:, VX])
    grid = turn / float(np.max(np.abs(rates)))
    return BoundTables(
        rates=rates,
        squares=np.abs(rates) ** 2,
        shapes=shapes,
        rows=rows,
        across=np.ascontiguousarray(shapes[:, X]),
        pull=pull,
        still=np.zeros_like(pull),
        grid=grid,
        factors=np.exp(rates * grid),
    )
