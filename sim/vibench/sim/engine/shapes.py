"""Tables that are the same for every specimen: Hertz collisions, and time steps under power laws.

Let t = T (1 - cos phi) / 2 during a collision of duration T. Near both ends the depth is a function of square
roots of t, but smooth in phi. Sixteen Gauss points in phi therefore describe a whole collision. In units of
the depth and time of a free collision at the same speed, collisions differ only by the press: the
acceleration due to the other springs. Collisions and their derivatives are tabulated over the press
(docs/decisions/0008-speed-of-contacts.md).
"""

import math
from functools import lru_cache

import numpy as np

from ..specimen.specimen import Floats

POINTS = 16
"""Number of Gauss points in phi, for a duration error of 1e-8 and only rounding errors in the speed."""
TERMS = 8
"""Number of terms of the series for spring forces that vary slowly compared with a collision."""
SOFTEST, HARDEST, SHAPES = -0.3, 0.5, 41
"""First and last tabulated press, and number of tabulated values. The press is the acceleration due to all
other springs, divided by speed^2 / depth."""
SPACING = (HARDEST - SOFTEST) / (SHAPES - 1)
QUADRATURE = 60
NEWTON_STEPS = 60
HALF_FORCE = 1.25
"""Ratio k / m in units of free depth and speed, from m v^2 / 2 = 2 k d^(5/2) / 5."""
TO_DURATION, ONTO_DURATION, DEPTHS, BY_PRESS, BY_JERK, BY_DAMPER, BY_SPRING = range(16, 23)
"""Rows of a tabulated collision after the first sixteen, which are d/d(depth residuals). In order:
d/d(residual at the end); d(duration)/d(residuals); depths at the points; derivatives of the depths with
respect to press, rate of press, and forces through dampers and through springs."""
SHAPE_ROWS = 23
DURATION, END_ONTO_DURATION, DEEPER, LASTS_BY = range(4)
"""Columns of the scalars of a tabulated collision. DEEPER is the ratio of the largest depth to the maximum of
the polynomial through the points, whose error is 1e-5 in the middle and 1e-8 at the end. Columns from
LASTS_BY on are derivatives of the duration, in the same order as the derivatives of the depths."""
PHI: Floats = 0.5 * math.pi * (np.polynomial.legendre.leggauss(POINTS)[0] + 1.0)
HEIGHTS: Floats = 0.5 * (1.0 - np.cos(PHI))


def _cardinal(at: Floats, points: Floats) -> Floats:
    """Return the Lagrange polynomials of ``points`` at the arguments ``at``, shape (..., points)."""
    others = ~np.eye(len(points), dtype=np.bool_)
    away = np.where(others, at[..., None, None] - points, 1.0)
    apart = np.where(others, points[:, None] - points, 1.0)
    return np.asarray(np.prod(away / apart, axis=-1))


def _about_middle() -> Floats:
    """Return the matrix that maps depths at the Gauss points to Taylor coefficients about mid-phi."""
    cardinal = np.linalg.inv((PHI[:, None] - 0.5 * math.pi) ** np.arange(POINTS))
    return np.ascontiguousarray(cardinal[:TERMS].T)


ABOUT_MIDDLE: Floats = _about_middle()
NEWTON_TO_TOP = 4
FARTHEST_TOP = 0.5
"""Largest distance of the maximum from mid-phi [rad]. At this distance, eight terms have an error of 1e-7; at
a tenth of this distance, only rounding errors."""


def _top_of(terms: Floats) -> float:
    """Return the maximum of a Taylor polynomial near the centre of expansion."""
    polynomial = np.polynomial.Polynomial(terms)
    slope, bend = polynomial.deriv(), polynomial.deriv(2)
    at = 0.0
    for _ in range(NEWTON_TO_TOP):
        at = min(FARTHEST_TOP, max(-FARTHEST_TOP, at - float(slope(at) / bend(at))))
    return float(polynomial(at))


def _shares() -> Floats:
    """Return the integrals of (t_i - t)^m times Lagrange polynomials, shape (TERMS, POINTS, POINTS + 1)."""
    places, weights = np.polynomial.legendre.leggauss(QUADRATURE)
    ends = np.append(PHI, math.pi)
    phi = 0.5 * (places + 1.0) * ends[:, None]
    weights = 0.25 * weights * ends[:, None] * np.sin(phi)
    left = 0.5 * (np.cos(phi) - np.cos(ends)[:, None])
    powers = left ** np.arange(TERMS)[:, None, None]
    return np.asarray(np.einsum("miq,iq,iqk->mki", powers, weights, _cardinal(phi, PHI), optimize=True))


SHARES: Floats = _shares()


def _misfits(depths: Floats, duration: float, press: float) -> tuple[Floats, Floats]:
    """Return residual and Jacobian of the collision equations, in units of free depth and speed."""
    times = np.append(HEIGHTS, 1.0)
    root = np.sqrt(np.maximum(depths, 0.0))
    pushed = HALF_FORCE * (depths * root) @ SHARES[1]
    free = duration * times + 0.5 * press * (duration * times) ** 2
    found = free - duration**2 * pushed - np.append(depths, 0.0)
    slopes = np.zeros((POINTS + 1, POINTS + 1))
    slopes[:, :POINTS] = -(duration**2) * 1.5 * HALF_FORCE * SHARES[1].T * root
    slopes[:POINTS, :POINTS] -= np.eye(POINTS)
    slopes[:, POINTS] = times + press * duration * times**2 - 2.0 * duration * pushed
    return found, slopes


@lru_cache(maxsize=1)
def collision_shapes() -> tuple[Floats, Floats]:
    """Return collisions and their scalars over the press; each solution starts from the one before."""
    shapes, durations = np.zeros((SHAPES, SHAPE_ROWS, POINTS)), np.zeros((SHAPES, 7))
    # At zero press, the scaled duration of a collision is 2.943, and the depth is nearly a half sine.
    depths, duration = np.sin(math.pi * HEIGHTS), 2.943
    for softer in np.linspace(0.0, SOFTEST, SHAPES):
        depths, duration, _ = _solve_collision(depths, duration, float(softer))
    times = np.append(HEIGHTS, 1.0)
    for place in range(SHAPES):
        press = SOFTEST + SPACING * place
        depths, duration, slopes = _solve_collision(depths, duration, press)
        answer = np.linalg.inv(slopes)
        forces = HALF_FORCE * np.maximum(depths, 0.0) ** 1.5
        changes = answer @ -np.transpose(
            [
                0.5 * (duration * times) ** 2,
                (duration * times) ** 3,
                duration**3 * forces @ SHARES[2],
                duration**4 * forces @ SHARES[3],
            ]
        )
        shapes[place, : POINTS + 1] = answer[:POINTS].T
        shapes[place, DEPTHS], shapes[place, BY_PRESS:] = depths, changes[:POINTS].T
        shapes[place, ONTO_DURATION] = answer[POINTS, :POINTS]
        deeper = _deepest(press) / _top_of(depths @ ABOUT_MIDDLE)
        durations[place] = duration, answer[POINTS, POINTS], deeper, *changes[POINTS]
    return shapes, durations


def _deepest(press: float) -> float:
    """Return the largest depth d, in units of free depth, from d^(5/2) = 1 + 2 press d (energy balance)."""
    depth = 1.0
    for _ in range(NEWTON_STEPS):
        depth -= (depth**2.5 - 1.0 - 2.0 * press * depth) / (2.5 * depth**1.5 - 2.0 * press)
    return depth


def _solve_collision(depths: Floats, duration: float, press: float) -> tuple[Floats, float, Floats]:
    """Solve a collision by Newton's method to rounding error; return depths, duration and Jacobian."""
    for _ in range(NEWTON_STEPS):
        found, slopes = _misfits(depths, duration, press)
        step = np.linalg.solve(slopes, found)
        depths, duration = depths - step[:POINTS], duration - float(step[POINTS])
        if float(np.abs(step).max()) < 1e-13:
            break
    return depths, duration, _misfits(depths, duration, press)[1]


# Weights for time steps under power laws. The weights are the same for every law and step length, because the
# step is scaled to 0..1. Within a step, the force F is the polynomial through its values at eight Gauss
# points. All results are linear in these values (docs/decisions/0026-power-laws.md).

GAUSS_POINTS = 8
"""Number of Gauss points in a time step; ten points would cost 50 % more for only 10 % longer steps."""
ORDER = 32
"""Number of terms of the series; in the longest step, the next term is 1e-20 of the largest."""
POWER_QUADRATURE = 24
"""Number of quadrature points with which all terms of the series are integrated exactly."""
COURSE_DEGREE = 5
"""Degree of the polynomial that predicts the force F in a step, fitted to F in the preceding step."""
END_WEIGHT = 3.0
"""Weight of the force F at the end of the preceding step, in the fit that predicts F."""
POINTS_AT: Floats = 0.5 * (np.polynomial.legendre.leggauss(GAUSS_POINTS)[0] + 1.0)
"""Gauss points c_i of a time step, on [0, 1]."""
GAUSS_WEIGHTS: Floats = 0.5 * np.polynomial.legendre.leggauss(GAUSS_POINTS)[1]


AT_START: Floats = _cardinal(np.array(0.0), POINTS_AT)
AT_END: Floats = _cardinal(np.array(1.0), POINTS_AT)
"""Weights by which values at the Gauss points give the polynomial's values at both ends of a step."""


def _course() -> Floats:
    """Return the matrix that extrapolates F: it maps values at the Gauss points and the end of a step to
    coefficients in powers of (s - 1). Shape (points + 1, points), zero beyond the degree.
    """
    weights = np.append(np.ones(GAUSS_POINTS), END_WEIGHT)
    known = np.vander(np.append(POINTS_AT, 1.0) - 1.0, COURSE_DEGREE + 1, increasing=True)
    fit = np.linalg.pinv(known * weights[:, None]) * weights
    return np.ascontiguousarray(np.pad(fit.T, ((0, 0), (0, GAUSS_POINTS - COURSE_DEGREE - 1))))


COURSE: Floats = _course()


def _power_shares() -> Floats:
    """Return the integrals of (c_i - s)^m times Lagrange polynomials, shape (ORDER, points, points + 1)."""
    places, weights = np.polynomial.legendre.leggauss(POWER_QUADRATURE)
    places, weights = 0.5 * (places + 1.0), 0.5 * weights
    ends = np.append(POINTS_AT, 1.0)
    left = ends[:, None] * (1.0 - places)
    basis = _cardinal(ends[:, None] * places, POINTS_AT) * (weights * ends[:, None])[:, :, None]
    whole = np.einsum("miq,iqk->mki", left ** np.arange(ORDER)[:, None, None], basis)
    return np.ascontiguousarray(whole)


POWER_SHARES: Floats = _power_shares()
INSTANTS: Floats = np.concatenate([[0.0], POINTS_AT, [1.0]])
"""Times within a step at which the motion is observed: start, Gauss points and end of the step."""


def _between(places: Floats) -> Floats:
    """Return the differences between all pairs of points as a matrix, with 1 on the diagonal."""
    return np.asarray(places[:, None] - places + np.eye(len(places)))


POINT_WEIGHTS: Floats = 1.0 / np.prod(_between(POINTS_AT), axis=1)
INSTANT_WEIGHTS: Floats = 1.0 / np.prod(_between(INSTANTS), axis=1)
"""Barycentric weights of the interpolation times (Berrut and Trefethen, SIAM Rev. 46 (2004) 501)."""
INSTANT_SLOPES: Floats = np.sum(1.0 / _between(INSTANTS), axis=1) - 1.0
"""Derivative of each Lagrange polynomial at its own node, shape of ``INSTANTS``."""
