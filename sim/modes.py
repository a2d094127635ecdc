"""The specimen without contact, solved exactly: state matrix, modes, transmissibility. SI units."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .parameters import VX, Table, Vector
from .specimen import Specimen

Complex = NDArray[np.complex128]


def state_matrix(specimen: Specimen) -> tuple[Table, Vector]:
    """Flight as d/dt s = A s + b f, with s = (x, y, z, vx, vy, vz) and f = k0 U + c0 dU/dt.

    Returns A, shape (6, 6), and b, shape (6,).
    """
    inverse = np.linalg.inv(specimen.mass_matrix)
    system = np.zeros((6, 6))
    system[:3, 3:] = np.eye(3)
    system[3:, :3] = -inverse @ specimen.stiffness_matrix
    system[3:, 3:] = -inverse @ specimen.damping_matrix
    entry = np.zeros(6)
    entry[VX] = inverse[0, 0]
    return system, entry


def base_transmissibility(specimen: Specimen, frequency_hz: ArrayLike) -> Complex:
    """Displacement of every mass, and of p, over the base displacement, without contact.

    (K - w^2 M + i w C)^-1 (k0 + i w c0, 0, 0); exact, for any damping.

    Parameters
    ----------
    specimen
        Its contact law and gap play no part.
    frequency_hz
        Shape (n,) [Hz]; zero and above.

    Returns
    -------
    Complex, shape (n, 4): x, y, z and p = y - z over U; time goes as exp(+i w t).

    """
    frequency = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if frequency.ndim != 1 or not bool(np.all(np.isfinite(frequency) & (frequency >= 0.0))):
        msg = "Frequencies must be one row of finite numbers, zero or positive, in Hz."
        raise ValueError(msg)
    omega = 2.0 * np.pi * frequency[:, None, None]
    dynamic = (
        specimen.stiffness_matrix - omega**2 * specimen.mass_matrix + 1j * omega * specimen.damping_matrix
    )
    forcing = np.zeros((len(frequency), 3, 1), dtype=np.complex128)
    forcing[:, 0, 0] = specimen.stiffnesses[0] + 1j * omega[:, 0, 0] * specimen.dampings[0]
    moved = np.linalg.solve(dynamic, forcing)[:, :, 0].astype(np.complex128)
    return np.column_stack([moved, moved[:, 1] - moved[:, 2]])
