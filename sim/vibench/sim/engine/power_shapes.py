"""Sums over the Gauss points of a step under a power law, the same for every law and length.

In a step from 0 to 1 the force F is a polynomial through its values at eight points; what follows is linear
in them (docs/decisions/0026-power-laws.md).
"""

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Table = NDArray[np.float64]

GAUSS_POINTS = 8
"""In a step. With ten a step costs half as much again and is a tenth longer."""
ORDER = 32
"""Terms of the series: the next is 1e-20 of the largest in the longest step."""
QUADRATURE = 24
"""Points of the integrals behind the series: exact for all terms."""
COURSE_DEGREE = 5
"""The first guess of F in a step is a polynomial of this degree, fitted to the step before."""
END_WEIGHT = 3.0
"""... and to where it ended, which counts this often."""
POINTS_AT: Vector = 0.5 * (np.polynomial.legendre.leggauss(GAUSS_POINTS)[0] + 1.0)
"""Gauss's points c_i on [0, 1]."""
GAUSS_WEIGHTS: Vector = 0.5 * np.polynomial.legendre.leggauss(GAUSS_POINTS)[1]


def _cardinal(at: Table) -> Table:
    """Return the polynomials that are 1 at one of the points and 0 at the others; shape (..., POINTS)."""
    others = ~np.eye(GAUSS_POINTS, dtype=np.bool_)
    away = np.where(others, at[..., None, None] - POINTS_AT, 1.0)
    apart = np.where(others, POINTS_AT[:, None] - POINTS_AT, 1.0)
    return np.asarray(np.prod(away / apart, axis=-1))


AT_START: Vector = _cardinal(np.array(0.0))
AT_END: Vector = _cardinal(np.array(1.0))
"""The polynomial through the points, at a step's start and end."""


def _course() -> Table:
    """Coefficients of F's course in powers of (s - 1), from F at the points and the end of a step.

    Shape (POINTS + 1, POINTS); the places beyond the degree are zero.
    """
    weights = np.append(np.ones(GAUSS_POINTS), END_WEIGHT)
    known = np.vander(np.append(POINTS_AT, 1.0) - 1.0, COURSE_DEGREE + 1, increasing=True)
    fit = np.linalg.pinv(known * weights[:, None]) * weights
    return np.ascontiguousarray(np.pad(fit.T, ((0, 0), (0, GAUSS_POINTS - COURSE_DEGREE - 1))))


COURSE: Table = _course()


def _shares() -> Table:
    """Integrals of (c_i - s)^m times the cardinal polynomials, shape (ORDER, POINTS, POINTS + 1)."""
    places, weights = np.polynomial.legendre.leggauss(QUADRATURE)
    places, weights = 0.5 * (places + 1.0), 0.5 * weights
    ends = np.append(POINTS_AT, 1.0)
    left = ends[:, None] * (1.0 - places)
    basis = _cardinal(ends[:, None] * places) * (weights * ends[:, None])[:, :, None]
    whole = np.einsum("miq,iqk->mki", left ** np.arange(ORDER)[:, None, None], basis)
    return np.ascontiguousarray(whole)


POWER_SHARES: Table = _shares()
INSTANTS: Vector = np.concatenate([[0.0], POINTS_AT, [1.0]])
"""At which an observed step is known: its start, its points, its end."""


def _between(places: Vector) -> Table:
    """Distances of places, 1 from each to itself."""
    return np.asarray(places[:, None] - places + np.eye(len(places)))


POINT_WEIGHTS: Vector = 1.0 / np.prod(_between(POINTS_AT), axis=1)
INSTANT_WEIGHTS: Vector = 1.0 / np.prod(_between(INSTANTS), axis=1)
"""Barycentric weights: Berrut and Trefethen, SIAM Rev. 46 (2004) 501."""
INSTANT_SLOPES: Vector = np.sum(1.0 / _between(INSTANTS), axis=1) - 1.0
"""Slope at its own instant of the polynomial that is 1 there and 0 at the others."""
