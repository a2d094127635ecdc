"""A linear structure seen from its one nonlinear spring. SI units.

M q'' + C q' + K q + b F(p) = e_k U + e_c dU/dt with p = b.q. In harmonic k of the frequency omega the
structure answers linearly, so that only the scalar p is unknown (Krack and Gross, Harmonic Balance for
Nonlinear Vibration Problems, Springer 2019, section 2.5):

    P_k = linear_k U - compliance_k F_k,   compliance_k = b.Z_k^-1 b,   Z_k = K - (k w)^2 M + i k w C
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.arrays import Complex, Vector
from ..model.specimen import Specimen

Matrix = NDArray[np.float64]
Harmonics = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LinearStructure:
    """Masses, springs and dampers without the nonlinear spring, and where that and the drive act."""

    mass: Matrix
    """M, shape (n, n), regular [kg]."""
    damping: Matrix
    """C, shape (n, n) [N s/m]."""
    stiffness: Matrix
    """K, shape (n, n), regular [N/m]."""
    direction: Vector
    """b, shape (n,): p = b.q, and the spring pulls with -b F."""
    entry_stiffness: Vector
    """e_k, shape (n,) [N/m]: force per displacement of the drive."""
    entry_damping: Vector
    """e_c, shape (n,) [N s/m]: force per velocity of the drive."""

    def __post_init__(self) -> None:
        size = len(self.direction)
        square = all(table.shape == (size, size) for table in (self.mass, self.damping, self.stiffness))
        if not square or self.entry_stiffness.shape != (size,) or self.entry_damping.shape != (size,):
            msg = f"The matrices and entries of this structure do not fit its direction of {size} places."
            raise ValueError(msg)

    @property
    def size(self) -> int:
        """Degrees of freedom."""
        return len(self.direction)


def structure_of(specimen: Specimen) -> LinearStructure:
    """Take the stops away: displacements (x, y, z), p = y - z, driven at m0 through k0 and c0."""
    return LinearStructure(
        mass=specimen.mass_matrix,
        damping=specimen.damping_matrix,
        stiffness=specimen.stiffness_matrix,
        direction=np.array([0.0, 1.0, -1.0]),
        entry_stiffness=np.array([specimen.stiffnesses[0], 0.0, 0.0]),
        entry_damping=np.array([specimen.dampings[0], 0.0, 0.0]),
    )


class Condensed(NamedTuple):
    """A structure at one frequency, per harmonic; slopes are derivatives by omega."""

    compliance: Complex
    """b.Z_k^-1 b, shape (m,) [m/N]."""
    compliance_slope: Complex
    linear: complex
    """P_1 / U without the spring."""
    linear_slope: complex
    reach: Complex
    """Z_k^-1 b, shape (m, n): every displacement per force in the spring [m/N]."""
    carried: Complex
    """Z_1^-1 e, shape (n,): every displacement over U without the spring."""


def condense(structure: LinearStructure, omega: float, harmonics: Harmonics) -> Condensed:
    """Solve the linear part of the structure at the given multiples of ``omega``.

    Parameters
    ----------
    structure
        Its stiffness must be regular if harmonic 0 is asked for.
    omega
        Angular frequency of the drive, positive [rad/s].
    harmonics
        Shape (m,), zero and above.

    """
    turn = harmonics.astype(np.float64)[:, None, None]
    dynamic = _dynamic(structure, omega * turn)
    slope = -2.0 * omega * turn**2 * structure.mass + 1j * turn * structure.damping
    spring = np.broadcast_to(structure.direction[:, None], (len(harmonics), structure.size, 1))
    reach: Complex = np.linalg.solve(dynamic, spring).astype(np.complex128)
    # Z is symmetric (no gyroscopic terms), so that the slope of b.Z^-1 b is -(Z^-1 b).Z' (Z^-1 b).
    bent = (slope @ reach)[:, :, 0]
    first = _dynamic(structure, np.array(omega))
    first_slope = -2.0 * omega * structure.mass + 1j * structure.damping
    entry = structure.entry_stiffness + 1j * omega * structure.entry_damping
    carried: Complex = np.linalg.solve(first, entry).astype(np.complex128)
    moved = np.linalg.solve(first, 1j * structure.entry_damping - first_slope @ carried)
    return Condensed(
        compliance=reach[:, :, 0] @ structure.direction,
        compliance_slope=-np.sum(reach[:, :, 0] * bent, axis=1),
        linear=complex(structure.direction @ carried),
        linear_slope=complex(structure.direction @ moved),
        reach=reach[:, :, 0],
        carried=carried,
    )


def _dynamic(structure: LinearStructure, omega: NDArray[np.float64]) -> Complex:
    return structure.stiffness - omega**2 * structure.mass + 1j * omega * structure.damping
