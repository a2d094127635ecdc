"""The specimen without contact, solved exactly: state matrix, modes, transmissibility. SI units."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Complex, Table, Vector
from ._specimen import Specimen
from ._state import VX


def state_matrix(specimen: Specimen) -> tuple[Table, Vector]:
    """Flight as d/dt s = A s + b f, with s = (x, y, z, vx, vy, vz) and f = k0 U + c0 dU/dt.

    Returns A, shape (6, 6), and b, shape (6,).
    """
    system = _first_order(specimen.mass_matrix, specimen.stiffness_matrix, specimen.damping_matrix)
    entry = np.zeros(6)
    entry[VX] = 1.0 / specimen.masses[0]
    return system, entry


def _first_order(mass: Table, stiffness: Table, damping: Table) -> Table:
    """Displacements above velocities: the matrix of their rates, shape (2n, 2n)."""
    inverse, size = np.linalg.inv(mass), len(mass)
    system = np.zeros((2 * size, 2 * size))
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -inverse @ stiffness
    system[size:, size:] = -inverse @ damping
    return system


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

    Raises
    ------
    ValueError
        When a frequency is negative or not finite.

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
    # In mass-normalised coordinates: a light mass beside a heavy one keeps all its digits.
    root = np.sqrt(np.asarray(specimen.masses))
    scaled = np.linalg.solve(dynamic / np.outer(root, root), forcing / root[:, None])
    moved = (scaled[:, :, 0] / root).astype(np.complex128)
    return np.column_stack([moved, moved[:, 1] - moved[:, 2]])


class ModalForm(NamedTuple):
    """Free motion of d displacements as s(t) = Re sum_j (rows_j . s0) shapes_j exp(rates_j t)."""

    rates: Complex
    """Shape (n,) [1/s]: one of each conjugate pair, and every real one; d <= n <= 2d."""
    shapes: Complex
    """Shape (n, 2d)."""
    rows: Complex
    """Shape (n, 2d): left eigenvectors, doubled for a pair."""


COINCIDENT = 1e7
"""Condition of the eigenvectors beyond which two modes count as one (critical damping to 14 digits)."""


@lru_cache(maxsize=64)
def modal_form(specimen: Specimen) -> ModalForm:
    """Diagonalise the specimen without contact, for any damping; its arrays are not to be written to.

    Raises ValueError when two modes coincide (critical damping): then no full set of modes exists.
    """
    return diagonal_form(specimen.mass_matrix, specimen.stiffness_matrix, specimen.damping_matrix)


def diagonal_form(mass: Table, stiffness: Table, damping: Table) -> ModalForm:
    """Diagonalise M s'' + C s' + K s = 0 with a diagonal M; as `modal_form`."""
    system = _first_order(mass, stiffness, damping)
    # Mass-normalised and in units of the fastest mode: a balanced matrix, so that every digit counts.
    root = np.sqrt(np.diag(mass))
    speed = math.sqrt(float(np.linalg.eigvalsh(stiffness / np.outer(root, root))[-1]))
    units = np.concatenate([1.0 / root, speed / root])
    values, vectors = np.linalg.eig(system / units[:, None] * units[None, :] / speed)
    if np.linalg.cond(vectors) > COINCIDENT:
        msg = "Two modes of this specimen coincide (critical damping): change a damping by 0.1 per cent."
        raise ValueError(msg)
    left = np.linalg.inv(vectors) / units[None, :]
    kept = values.imag >= 0.0
    weights = np.where(values.imag[kept] > 0.0, 2.0, 1.0)
    # A passive structure does not grow: a positive real part is rounding.
    rates = (np.minimum(values.real[kept], 0.0) + 1j * values.imag[kept]) * speed
    return ModalForm(
        rates=rates.astype(np.complex128),
        shapes=np.ascontiguousarray((vectors * units[:, None]).T[kept], dtype=np.complex128),
        rows=np.ascontiguousarray(left[kept] * weights[:, None], dtype=np.complex128),
    )


def harmonic_motion(specimen: Specimen, omega: float, amplitude_m: float) -> tuple[Complex, complex]:
    """Phasors of the steady motion without contact under U = amplitude sin(omega t).

    Returns the motion S, shape (6,), s(t) = Re(S exp(i omega t)), and the base force, likewise [N].
    """
    base = -1j * amplitude_m
    displacement = base_transmissibility(specimen, omega / (2.0 * np.pi))[0, :3] * base
    force = (specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0]) * base
    return np.concatenate([displacement, 1j * omega * displacement]), force
