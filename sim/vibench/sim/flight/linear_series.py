"""The linear specimen under a harmonic drive, as one Taylor series of its matrix exponential. SI units.

Eight numbers, (p, x, z, dp/dt, vx, vz, cos, sin), the last two of the drive's phase, obey du/dt = A u + b F:
all that is not linear is the force F between m1 and m2. The series of exp(A t) needs no modes and loses
nothing where t is short.
"""

import math
from typing import NamedTuple

import numpy as np

from ..kernels.arrays import Table, Vector
from ..model.specimen import Specimen

WIDE = 8
"""Numbers of the motion."""
P, AT_X, AT_Z, P_RATE, X_RATE, Z_RATE, COSINE, SINE = range(WIDE)


class LinearSeries(NamedTuple):
    """Terms of the series; time counts in units of 1 / fastest."""

    fastest: float
    """Largest rate of the modes and the drive [1/s]."""
    powers: Table
    """Shape (order, j, i): what the j-th number of the motion adds to the i-th, (A / fastest)^m / m!."""
    struck: Table
    """Shape (order, i): the same of a unit of F [1/(N s) and so on]."""


def linear_series(
    specimen: Specimen, omega: float, force: complex, rates: Vector, order: int
) -> LinearSeries:
    """Sum up a specimen and a drive of base force Re(force exp(i omega t)); modes turn at ``rates``."""
    fastest = max(float(np.max(rates)), omega)
    units = np.ones(WIDE)
    units[P_RATE : Z_RATE + 1] = fastest
    matrix = _rates(specimen, omega, force) * units / units[:, None] / fastest
    m1, m2 = specimen.masses[1:]
    kick = np.zeros(WIDE)
    kick[P_RATE], kick[Z_RATE] = -(1.0 / m1 + 1.0 / m2), 1.0 / m2
    powers, struck, term = [], [], np.eye(WIDE)
    for m in range(order):
        whole = term * units[:, None] / units / math.factorial(m)
        powers.append(whole.T)
        struck.append(whole @ kick)
        term = matrix @ term
    return LinearSeries(fastest, np.ascontiguousarray(powers), np.ascontiguousarray(struck))


def _rates(specimen: Specimen, omega: float, force: complex) -> Table:
    """Give the matrix A of du/dt = A u, with F left out, shape (WIDE, WIDE)."""
    (m0, m1, m2), (k0, k1, k2), (c0, c1, c2) = specimen.masses, specimen.stiffnesses, specimen.dampings
    pull, press, base = np.zeros(WIDE), np.zeros(WIDE), np.zeros(WIDE)
    pull[AT_Z], pull[AT_X], pull[Z_RATE], pull[X_RATE] = k2, -k2, c2, -c2
    press[P], press[P_RATE] = k1, c1
    base[AT_X], base[X_RATE], base[COSINE], base[SINE] = -k0, -c0, force.real, -force.imag
    rates = np.zeros((WIDE, WIDE))
    rates[P, P_RATE] = rates[AT_X, X_RATE] = rates[AT_Z, Z_RATE] = 1.0
    rates[P_RATE] = pull / m2 - press * (1.0 / m1 + 1.0 / m2)
    rates[X_RATE] = (pull + base) / m0
    rates[Z_RATE] = (press - pull) / m2
    rates[COSINE, SINE], rates[SINE, COSINE] = -omega, omega
    return rates
