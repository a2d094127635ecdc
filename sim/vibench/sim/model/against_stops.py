"""How a specimen answers its base when p is free, and when the stops decide p: closed forms. SI units.

The stops push m1 and m2 apart with equal and opposite forces, so x follows from the base U and from p
alone: x = stuck U + lever p, with ``stuck`` the answer while m1 sticks to m2 and ``lever`` that of x to a p
forced by the stops. While collisions hold abs(p) at about the gap, abs(x) is at most abs(stuck U) +
abs(lever) gap, as far as the fundamental carries the motion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.arrays import Complex
from .modes import base_transmissibility
from .specimen import Specimen


@dataclass(frozen=True, eq=False)
class BaseResponse:
    """Phasors per unit of base displacement, each of shape (n,); time goes as exp(+i w t)."""

    free_p: Complex
    """p without contact, over U."""
    free_x: Complex
    """x without contact, over U."""
    stuck_x: Complex
    """x while m1 sticks to m2, over U."""
    lever: Complex
    """x over a p that the stops bring about while the base rests."""


def base_response(specimen: Specimen, frequency_hz: ArrayLike) -> BaseResponse:
    """Answer of x and p at each of the frequencies, shape (n,) [Hz]; zero and above."""
    free = base_transmissibility(specimen, frequency_hz)
    omega = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    dynamic = (
        specimen.stiffness_matrix
        - omega[:, None, None] ** 2 * specimen.mass_matrix
        + 1j * omega[:, None, None] * specimen.damping_matrix
    )
    apart = np.linalg.solve(dynamic, np.array([[0.0], [1.0], [-1.0]]))[:, :, 0]
    lever = apart[:, 0] / (apart[:, 1] - apart[:, 2])
    return BaseResponse(free[:, 3], free[:, 0], free[:, 0] - lever * free[:, 3], lever)
