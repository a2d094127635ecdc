"""A mode from a few points of its transmissibility: one resonance beside whatever else is near."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

_UNKNOWNS = 8
"""Real numbers that are fitted: frequency, damping, and a complex polynomial of degree two."""
_SURE = 2.0
"""Standard uncertainties by which a damping differs from none."""


@dataclass(frozen=True)
class Mode:
    """A damped mode."""

    frequency_hz: float
    """Undamped natural frequency [Hz]."""
    frequency_u_hz: float
    """Standard uncertainty, from what the points leave [Hz]."""
    damping_ratio: float


def fitted_mode(frequency_hz: NDArray[np.float64], transmissibility: NDArray[np.complex128]) -> Mode | None:
    """Fit T (s^2 + a1 s + a2) = b0 + b1 s + b2 s^2 with real a and complex b; None where points tell no mode.

    They are too few, or what they tell is damped no more than they scatter, or lies beside them all.

    The polynomial on the right holds the mode's residue, the motion of the base itself and the flanks
    of other modes; a constant error of all phases only turns it. Levy's linear least squares, weighted
    once more by the denominator that it found.

    Parameters
    ----------
    frequency_hz, transmissibility
        Shape (points,), around the resonance.

    """
    if 2 * len(frequency_hz) <= _UNKNOWNS:
        return None
    middle_hz = float(np.mean(frequency_hz))
    s = np.asarray(1j * frequency_hz / middle_hz, dtype=np.complex128)
    weight = np.ones(len(s))
    solution, covariance = np.zeros(_UNKNOWNS), np.zeros((_UNKNOWNS, _UNKNOWNS))
    for _ in range(3):
        solution, covariance = _solved(s, transmissibility, weight)
        weight = 1 / np.abs(s**2 + solution[0] * s + solution[1])
    if solution[1] <= 0 or solution[0] <= _SURE * sqrt(max(0.0, float(covariance[0, 0]))):
        return None
    natural = sqrt(float(solution[1]))
    if not min(frequency_hz) <= middle_hz * natural <= max(frequency_hz):
        return None
    return Mode(
        frequency_hz=middle_hz * natural,
        frequency_u_hz=middle_hz * sqrt(max(0.0, float(covariance[1, 1]))) / (2 * natural),
        damping_ratio=float(solution[0]) / (2 * natural),
    )


def _solved(
    s: NDArray[np.complex128], answer: NDArray[np.complex128], weight: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # a1 s T + a2 T - (b0 + b1 s + b2 s^2) = -s^2 T, real and imaginary parts apart.
    powers = np.stack([np.ones_like(s), s, s**2], axis=1)
    columns = np.concatenate([(s * answer)[:, None], answer[:, None], -powers, -1j * powers], axis=1)
    weighted = weight[:, None] * columns
    right = -weight * s**2 * answer
    matrix = np.concatenate([weighted.real, weighted.imag])
    target = np.concatenate([right.real, right.imag])
    solution = np.linalg.lstsq(matrix, target)[0]
    left = target - matrix @ solution
    variance = float(left @ left) / max(1, len(target) - _UNKNOWNS)
    return solution, variance * np.linalg.pinv(matrix.T @ matrix)
