"""All positive zeros of a sum of a few powers, whatever the exponents.

A polynomial of degree 201 with four terms has at most three positive zeros (Descartes), but companion
matrices and powers of u lose them. Rolle's theorem finds them all: divided by its lowest power and
differentiated, a sum of m powers becomes one of m - 1, between whose zeros the sum is monotone. In
t = ln u, and with every term over the largest, nothing overflows.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]

TOUCHING = 1e-14
"""A turning point whose value is this part of its largest term is a double zero."""
ROOT_TOLERANCE = 1e-15
"""On ln u, absolute; brentq adds four units in the last place of it."""


def positive_zeros(coefficients: Floats, exponents: Floats) -> Floats:
    """Find every u > 0 with sum c_i u^e_i = 0, ascending.

    Parameters
    ----------
    coefficients, exponents
        Shape (m,), finite; exponents may repeat and need not be whole.

    Returns
    -------
    Shape (n,), n < m; a double zero is given once.

    """
    kept, powers = _gathered(
        np.asarray(coefficients, dtype=np.float64), np.asarray(exponents, dtype=np.float64)
    )
    return np.exp(np.array(_zeros(kept, powers), dtype=np.float64))


def _gathered(coefficients: Floats, exponents: Floats) -> tuple[Floats, Floats]:
    """Sum equal exponents, drop zeros, sort."""
    powers, place = np.unique(exponents, return_inverse=True)
    sums = np.zeros(len(powers))
    np.add.at(sums, place, coefficients)
    return sums[sums != 0.0], powers[sums != 0.0]


def _value(t: float, coefficients: Floats, exponents: Floats) -> float:
    """Sum over its largest term: the sign is what counts."""
    sizes = np.log(np.abs(coefficients)) + exponents * t
    return float(np.sum(np.sign(coefficients) * np.exp(sizes - sizes.max())))


def _bounds(coefficients: Floats, exponents: Floats) -> tuple[float, float]:
    """Beyond these t the lowest, the highest, power outweighs all others together."""
    sizes = np.log(np.abs(coefficients)) + np.log(len(coefficients))
    own = np.log(np.abs(coefficients))
    low = np.min((own[0] - sizes[1:]) / (exponents[1:] - exponents[0]))
    high = np.max((sizes[:-1] - own[-1]) / (exponents[-1] - exponents[:-1]))
    return float(low), float(high)


def _zeros(coefficients: Floats, exponents: Floats) -> list[float]:
    if len(coefficients) < 2 or np.all(coefficients > 0.0) or np.all(coefficients < 0.0):
        return []
    lowered = exponents - exponents[0]
    turning = _zeros(coefficients[1:] * lowered[1:], lowered[1:])
    low, high = _bounds(coefficients, exponents)
    ends = [min([low, *turning]), *turning, max([high, *turning])]
    values = [_value(t, coefficients, exponents) for t in ends]
    found = [
        t for t, value in zip(ends[1:-1], values[1:-1], strict=True) if abs(value) < TOUCHING * len(values)
    ]
    for k in range(len(ends) - 1):
        touching = any(t in found for t in ends[k : k + 2])
        if values[k] * values[k + 1] < 0.0 and not touching:
            found.append(
                float(
                    brentq(_value, ends[k], ends[k + 1], args=(coefficients, exponents), xtol=ROOT_TOLERANCE)
                )
            )
    return sorted(found)
