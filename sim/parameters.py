"""What the kernels need to know of a specimen: plain numbers, ready to multiply. SI units.

Also the layout of the one state vector that every kernel advances in place.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .contact_law import Hertz, NoContact
from .specimen import Specimen

Vector = NDArray[np.float64]
Table = NDArray[np.float64]

X, Y, Z, VX, VY, VZ = range(6)
"""Absolute displacements and velocities: always valid, in flight and in contact."""
SIDE = 6
"""0 in flight; +1 or -1 while m1 presses on the stop at p = +gap or -gap."""
ROOT, RATE = 7, 8
"""In contact: w, the square root of the penetration [m^0.5], and its rate r = d|p|/dt [m/s]."""
STEP = 9
"""In contact: the next step that the step control proposes, in s with dt = w ds [s/m^0.5]."""
ROOT_SCALE, RATE_SCALE = 10, 11
"""In contact: how large w and r will become, the measure of their errors."""
STATE_SIZE = 12


class Parameters(NamedTuple):
    """The specimen as numbers. The contact force is stiffness * w^3 (Hertz)."""

    mass0: float
    mass1: float
    mass2: float
    k0: float
    k1: float
    k2: float
    c0: float
    c1: float
    c2: float
    gap: float
    """Infinite when there is no contact."""
    contact_stiffness: float
    reduced_mass: float
    """m1 m2 / (m1 + m2): the mass that a collision of the two feels."""


def parameters(specimen: Specimen) -> Parameters:
    """Turn a specimen into the numbers of the kernels."""
    gap, stiffness = _stop(specimen)
    m0, m1, m2 = specimen.masses
    k0, k1, k2 = specimen.stiffnesses
    c0, c1, c2 = specimen.dampings
    return Parameters(m0, m1, m2, k0, k1, k2, c0, c1, c2, gap, stiffness, m1 * m2 / (m1 + m2))


def _stop(specimen: Specimen) -> tuple[float, float]:
    match specimen.contact:
        case Hertz(stiffness=stiffness):
            return specimen.gap_m, stiffness
        case NoContact():
            return math.inf, 0.0
