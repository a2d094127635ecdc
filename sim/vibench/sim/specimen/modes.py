"""Exact solution of the specimen without contact: state matrix, modes, transmissibility. SI units."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .specimen import JOIN, VX, VZ, Complex, Floats, Specimen, X, Z, bound_matrices


def state_matrix(specimen: Specimen) -> tuple[Floats, Floats]:
    """Return A, shape (6, 6), and b, shape (6,), of the motion without contact, d/dt s = A s + b f.

    The state is s = (x, y, z, vx, vy, vz). The base force is f = k0 U + c0 dU/dt.
    """
    system = _first_order(specimen.mass_matrix, specimen.stiffness_matrix, specimen.damping_matrix)
    entry = np.zeros(6)
    entry[VX] = 1.0 / specimen.masses[0]
    return system, entry


def _first_order(mass: Floats, stiffness: Floats, damping: Floats) -> Floats:
    """Return the state matrix for displacements followed by velocities, shape (2n, 2n)."""
    inverse, size = np.linalg.inv(mass), len(mass)
    system = np.zeros((2 * size, 2 * size))
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -inverse @ stiffness
    system[size:, size:] = -inverse @ damping
    return system


def angular_frequencies(frequency_hz: ArrayLike) -> Floats:
    """Return 2 pi f for frequencies, shape (n,) [rad/s]; raise ValueError if negative or not finite."""
    frequency = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if frequency.ndim != 1 or not bool(np.all(np.isfinite(frequency) & (frequency >= 0.0))):
        raise ValueError("Frequencies must be one row of finite numbers, zero or positive, in Hz.")
    return 2.0 * np.pi * frequency


def base_transmissibility(specimen: Specimen, frequency_hz: ArrayLike) -> Complex:
    """Return the transmissibility without contact: ratios of x, y, z and p to the base displacement.

    For x, y, z the ratios are (K - w^2 M + i w C)^-1 (k0 + i w c0, 0, 0), exact for any damping. Raises
    ValueError when a frequency is negative or not finite.

    Parameters
    ----------
    specimen
        Specimen; contact law and gap are ignored.
    frequency_hz
        Frequencies, zero or positive, shape (n,) [Hz].

    Returns
    -------
    Complex, shape (n, 4): x, y, z and p = y - z, divided by U, for the time factor exp(+i w t).
    """
    omega = angular_frequencies(frequency_hz)
    (m0, m1, m2), squared = specimen.masses, omega**2
    springs, dampers = specimen.stiffnesses, specimen.dampings
    k0, k1, k2 = (k + 1j * omega * c for k, c in zip(springs, dampers, strict=True))
    # Differences of nearly equal stiffnesses would lose digits; eliminating m1 and m2 this way avoids them.
    pair = k1 * (k2 - squared * m2) - squared * m1 * (k1 + k2 - squared * m2)
    carried = (m1 + m2) * k1 - squared * m1 * m2
    per_force = k0 / ((k0 - squared * m0) * pair - k2 * squared * carried)
    y, p = per_force * k1 * k2, per_force * k2 * squared * m1
    return np.column_stack([per_force * pair, y, y - p, p])


class ModalForm(NamedTuple):
    """Free motion s(t) of d displacements and velocities: Re sum_j (rows_j . s0) shapes_j exp(rates_j t)."""

    rates: Complex
    """Eigenvalues: one of each conjugate pair, and all real ones; shape (n,), d <= n <= 2d [1/s]."""
    shapes: Complex
    """Right eigenvectors of the modes, shape (n, 2d)."""
    rows: Complex
    """Left eigenvectors, doubled for a conjugate pair, shape (n, 2d)."""


COINCIDENT = 1e7
"""Condition number of the eigenvectors above which two modes count as coincident (critical damping)."""
PROPORTIONAL = 1e-12
"""Largest ratio of off-diagonal to diagonal modal damping for which the modes count as uncoupled."""
CRITICAL = 1e-12
"""Value of abs(1 - damping ratio^2) below which a mode counts as critically damped."""
WIDEST = 1e10
"""Ratio of highest to lowest natural frequency above which double precision loses the lowest mode."""
REFUSAL = "Two modes coincide (critical damping): change a damping by 0.1 per cent."


@lru_cache(maxsize=64)
def modal_form(specimen: Specimen) -> ModalForm:
    """Return the modal form of the specimen without contact, for any damping; do not change the arrays.

    Raises ValueError in the same cases as `diagonal_form`.
    """
    return diagonal_form(specimen.mass_matrix, specimen.stiffness_matrix, specimen.damping_matrix)


def diagonal_form(mass: Floats, stiffness: Floats, damping: Floats) -> ModalForm:
    """Return the modal form of M s'' + C s' + K s = 0 with a diagonal M.

    The undamped modes solve a symmetric eigenproblem and are therefore orthogonal even if two frequencies
    nearly coincide. If the damping is zero or proportional to the stiffness, these are also the damped modes.

    Raises ValueError when two modes coincide (critical damping), so that modes do not span all states, or
    when the natural frequencies are too far apart.
    """
    root = np.sqrt(np.diag(mass))
    try:
        factor = np.linalg.cholesky(stiffness / np.outer(root, root))
    except np.linalg.LinAlgError:
        factor = np.zeros_like(stiffness)
    # Use singular values: the eigenvalues of K would lose twice as many digits of the lowest mode.
    modes, omega, _ = np.linalg.svd(factor)
    modes, omega = modes[:, ::-1], omega[::-1]
    if not WIDEST * omega[0] > omega[-1]:
        raise ValueError(
            f"Natural frequencies from {omega[0]:.3g} to {omega[-1]:.3g} rad/s are too far apart for "
            "double precision: give masses and stiffnesses closer to each other."
        )
    losses = modes.T @ (damping / np.outer(root, root)) @ modes
    shapes, rows = modes / root[:, None], (modes * root[:, None]).T
    diagonal = np.diag(losses)
    if np.max(np.abs(losses - np.diag(diagonal))) <= PROPORTIONAL * np.max(diagonal):
        return _undamped_shapes(omega, diagonal, shapes, rows)
    return _coupled_shapes(omega, losses, shapes, rows)


def _undamped_shapes(omega: Floats, damping: Floats, shapes: Floats, rows: Floats) -> ModalForm:
    """Return the modal form for uncoupled modes, q'' + damping q' + omega^2 q = 0."""
    parts = [part for mode in zip(omega, 0.5 * damping, shapes.T, rows, strict=True) for part in _mode(*mode)]
    rates, moved, read = zip(*parts, strict=True)
    return ModalForm(np.asarray(rates, np.complex128), np.array(moved), np.array(read))


def _mode(omega: float, decay: float, shape: Floats, row: Floats) -> list[tuple[complex, Complex, Complex]]:
    """Return the terms (rate, shape, row) of one mode: one term if the mode oscillates, two if overdamped."""
    turn = (omega - decay) * (omega + decay)
    if abs(turn) <= CRITICAL * omega**2:
        raise ValueError(REFUSAL)
    if turn > 0.0:
        damped = math.sqrt(turn)
        rate = complex(-decay, damped)
        # q = Re(e exp(rate t)) with e = q0 - i (q0' + decay q0) / damped.
        read = _state((1.0 - 1j * decay / damped) * row, -1j / damped * row)
        return [(rate, _state(shape, rate * shape), read)]
    fast = -decay - math.sqrt(-turn)
    slow = omega**2 / fast
    return [
        (rate, _state(shape, rate * shape), _state(-other * row, row) / (rate - other))
        for rate, other in ((slow, fast), (fast, slow))
    ]


def _state(displacement: NDArray[np.generic], velocity: NDArray[np.generic]) -> Complex:
    return np.concatenate([displacement, velocity]).astype(np.complex128)


def _coupled_shapes(omega: Floats, losses: Floats, shapes: Floats, rows: Floats) -> ModalForm:
    """Return the modal form for undamped modes that are coupled by damping."""
    # With the coordinates q and q' / omega, very slow and fast modes do not raise the condition number.
    values, vectors = np.linalg.eig(
        np.block(
            [
                [np.zeros_like(losses), np.diag(omega)],
                [-np.diag(omega), -losses * omega[None, :] / omega[:, None]],
            ]
        )
    )
    if np.linalg.cond(vectors) > COINCIDENT:
        raise ValueError(REFUSAL)
    left = np.linalg.inv(vectors)
    kept = values.imag >= 0.0
    weights = np.where(values.imag[kept] > 0.0, 2.0, 1.0)[:, None]
    size = len(omega)
    moved = np.hstack([vectors.T[:, :size] @ shapes.T, vectors.T[:, size:] @ (shapes * omega).T])
    read = np.hstack([left[:, :size] @ rows, left[:, size:] @ (rows / omega[:, None])])
    # The free motion of a passive structure cannot grow, so a positive real part is a rounding error.
    rates = np.minimum(values.real[kept], 0.0) + 1j * values.imag[kept]
    return ModalForm(
        rates=rates.astype(np.complex128),
        shapes=np.ascontiguousarray(moved[kept], dtype=np.complex128),
        rows=np.ascontiguousarray(read[kept] * weights, dtype=np.complex128),
    )


def harmonic_motion(specimen: Specimen, omega: float, amplitude_m: float) -> tuple[Complex, complex]:
    """Return the phasors of the steady motion without contact, and the phasor of the base force [N].

    The drive is U = amplitude sin(omega t). The motion S has shape (6,), with s(t) = Re(S exp(i omega t)).
    """
    base = -1j * amplitude_m
    displacement = base_transmissibility(specimen, omega / (2.0 * np.pi))[0, :3] * base
    force = (specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0]) * base
    return np.concatenate([displacement, 1j * omega * displacement]), force


# Closed-form response of a specimen to its base, with p free or imposed by the stops. SI units.
#
# The stops exert equal and opposite forces on m1 and m2. Therefore the base U and p determine x:
# x = stuck U + lever p. Here ``stuck`` is x / U while m1 sticks to m2, and ``lever`` is x / p with the base
# at rest. Collisions limit abs(p) to about the gap. If the fundamental dominates, abs(x) is therefore at
# most abs(stuck U) + abs(lever) gap.


@dataclass(frozen=True, eq=False)
class BaseResponse:
    """Response of x and p = y - z to the base motion U, for exp(+i w t); each field has shape (n,)."""

    free_p: Complex
    """Ratio p / U of relative motion to base motion, without contact."""
    free_x: Complex
    """Ratio x / U of m0 motion to base motion, without contact."""
    stuck_x: Complex
    """Ratio x / U while m1 sticks to m2."""
    lever: Complex
    """Ratio x / p if the stops impose p and the base is at rest."""


def base_response(specimen: Specimen, frequency_hz: ArrayLike) -> BaseResponse:
    """Return the response of x and p to the base motion at frequencies of shape (n,), not negative [Hz]."""
    free = base_transmissibility(specimen, frequency_hz)
    omega = angular_frequencies(frequency_hz)
    dynamic = (
        specimen.stiffness_matrix
        - omega[:, None, None] ** 2 * specimen.mass_matrix
        + 1j * omega[:, None, None] * specimen.damping_matrix
    )
    apart = np.linalg.solve(dynamic, np.array([[0.0], [1.0], [-1.0]]))[:, :, 0]
    lever = apart[:, 0] / (apart[:, 1] - apart[:, 2])
    return BaseResponse(free[:, 3], free[:, 0], free[:, 0] - lever * free[:, 3], lever)


# Exact solution of the specimen while m1 sticks to a rigid stop on m2: a system of two bodies. SI units.
#
# While m1 sticks to a stop, m1 and m2 are one rigid body with y = z + side * gap, and the spring and damper
# between them have no effect. As long as the stop force is compressive, the motion of x and z is linear. The
# native engine computes this motion, and the time at which the force would become tensile.

PLACES = [X, Z, VX, VZ]
"""Indices, in the six-element state, of the four unknowns while m1 sticks to m2."""


class BoundMotion(NamedTuple):
    """Motion while m1 sticks to m2: n modes (2 to 4) and the steady part; y excludes the constant gap."""

    modes: ModalForm
    """Modal form for x, y, z, vx, vy, vz; left eigenvectors are nonzero only at x, z, vx, vz."""
    steady: Complex
    """Phasors of the steady motion, shape (6,)."""
    pulls: Complex
    """Force k2 (z - x) + c2 (vz - vx) of m2 on m0, for a unit phasor of each mode and for the steady motion,
    shape (n + 1,) [N]."""


def bound_motion(specimen: Specimen, omega: float, amplitude_m: float) -> BoundMotion:
    """Return the modes and the steady motion while m1 sticks to m2, driven by U = amplitude sin(omega t).

    Raises ValueError when two bound modes coincide.
    """
    mass, damping, stiffness = bound_matrices(specimen)
    modes = diagonal_form(mass, stiffness, damping)
    dynamic = stiffness - omega**2 * mass + 1j * omega * damping
    base = -1j * amplitude_m * (specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0])
    displacement = np.linalg.solve(dynamic, np.array([base, 0.0]))
    spread = np.zeros((4, 6), dtype=np.complex128)
    spread[:2, :3], spread[2:, 3:] = JOIN.T, JOIN.T
    shapes = np.vstack([modes.shapes, [*displacement, *(1j * omega * displacement)]]) @ spread
    rows = np.zeros((len(modes.rates), 6), dtype=np.complex128)
    rows[:, PLACES] = modes.rows
    x, z, vx, vz = shapes[:, PLACES].T
    pulls = specimen.stiffnesses[2] * (z - x) + specimen.dampings[2] * (vz - vx)
    return BoundMotion(ModalForm(modes.rates, shapes[:-1], rows), shapes[-1], pulls)
