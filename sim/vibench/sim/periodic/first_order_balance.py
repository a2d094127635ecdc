"""The paper's analytical solution: first-order harmonic balance of power laws, all branches. SI units.

With p = Re(P exp(i w t)), the balance of the fundamental (Gong et al. 2025, eqs. 4 and 5) is P (1 + G N(|P|))
= P_lin. G is the compliance at the spring, N the describing function of the spring, and P_lin the solution
without the spring. Squared magnitudes give an equation in a few powers of |P|; all its zeros are found, so no
branch is missed.

`positive_zeros` finds all positive zeros of a sum of a few powers. Companion matrices would miss some zeros,
for example of a polynomial of degree 201 with four terms. Instead Rolle's theorem is used: a sum of m powers,
divided by its lowest power, is monotone between the zeros of its derivative, which has m - 1 powers. The sum
is evaluated in t = ln u, relative to its largest term, to avoid overflow.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from ..specimen.specimen import Complex, Floats
from .harmonic_balance import LinearStructure, condense
from .restoring_force import PowerSpring

TOUCHING = 1e-14
"""Value of a sum of powers, relative to the largest term, below which an extremum is a double zero."""
ROOT_TOLERANCE = 1e-15
"""Absolute tolerance of ln u; the method `brentq` adds a relative tolerance of rounding size."""


def positive_zeros(coefficients: Floats, exponents: Floats) -> Floats:
    """Return every u > 0 with sum c_i u^e_i = 0, ascending, shape (n,) with n < m.

    A double zero is listed once.

    Parameters
    ----------
    coefficients, exponents
        Finite numbers, shape (m,); exponents may repeat and need not be whole numbers.
    """
    kept, powers = _sum_equal_exponents(
        np.asarray(coefficients, dtype=np.float64), np.asarray(exponents, dtype=np.float64)
    )
    return np.exp(np.array(_zeros(kept, powers), dtype=np.float64))


def _sum_equal_exponents(coefficients: Floats, exponents: Floats) -> tuple[Floats, Floats]:
    """Add the coefficients of equal exponents, drop zero coefficients, and sort by exponent."""
    powers, place = np.unique(exponents, return_inverse=True)
    sums = np.zeros(len(powers))
    np.add.at(sums, place, coefficients)
    return sums[sums != 0.0], powers[sums != 0.0]


def _value(t: float, coefficients: Floats, exponents: Floats) -> float:
    """Return a sum of powers divided by the magnitude of its largest term; the sum keeps its sign."""
    sizes = np.log(np.abs(coefficients)) + exponents * t
    return float(np.sum(np.sign(coefficients) * np.exp(sizes - sizes.max())))


def _bounds(coefficients: Floats, exponents: Floats) -> tuple[float, float]:
    """Return bounds on t, outside which one term (of the lowest or highest power) exceeds all others."""
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
            low, high = ends[k], ends[k + 1]
            root = scipy.optimize.brentq(
                _value, low, high, args=(coefficients, exponents), xtol=ROOT_TOLERANCE
            )
            found.append(float(root))
    return sorted(found)


FUNDAMENTAL = np.array([1])


def fundamental_share(exponent: int) -> float:
    """Return the fundamental's amplitude in cos^n: binomial(n, (n-1)/2) / 2^(n-1), such as 3/4 for n = 3.

    The quotient of two exact integers is correctly rounded for every n.
    """
    if exponent < 1 or exponent % 2 == 0:
        raise ValueError(
            f"Exponent {exponent} is not allowed: the first-order balance takes odd powers 1, 3, 5, ..."
        )
    return math.comb(exponent, (exponent - 1) // 2) / (1 << (exponent - 1))


@dataclass(frozen=True, eq=False)
class FirstOrderState:
    """One solution of the first-order balance at one frequency."""

    relative: complex
    """Phasor P of p for exp(+i w t) and the drive U = A0 sin(w t) [m]."""
    displacements: Complex
    """Phasors of every displacement of the structure, shape (n,) [m]."""
    is_stable_to_amplitude: bool
    """Whether perturbations of the amplitude decay; False on the middle branch of three.

        Floquet multipliers also show all other instabilities (`vibench.sim.periodic.floquet`).
    """


def first_order_states(
    structure: LinearStructure, spring: PowerSpring, frequency_hz: float, amplitude_m: float
) -> list[FirstOrderState]:
    """Return every first-order solution at one frequency and drive amplitude, by ascending abs(P).

    Raises ValueError when frequency or amplitude is not allowed.

    Parameters
    ----------
    structure, spring
        Result of `vibench.sim.periodic.harmonic_balance.structure_of`, and the power law.
    frequency_hz, amplitude_m
        Drive U = amplitude sin(2 pi frequency t); positive frequency, zero or positive amplitude.
    """
    if not (0.0 < frequency_hz < math.inf and 0.0 <= amplitude_m < math.inf):
        raise ValueError(
            f"A drive of {frequency_hz} Hz and {amplitude_m} m is not allowed: "
            "the frequency must be positive, the amplitude zero or positive, and both finite."
        )
    seen = condense(structure, 2.0 * math.pi * frequency_hz, FUNDAMENTAL)
    drive = -1j * amplitude_m
    alone = seen.linear * drive
    compliance = complex(seen.compliance[0])
    coefficients, exponents = _balance_squared(compliance, spring)
    target = abs(alone / spring.length) ** 2
    sizes = positive_zeros(np.append(coefficients, -target), np.append(exponents, 0.0))
    slopes = [_slope_sign(size, coefficients, exponents) for size in sizes]
    states = []
    for size, slope in zip(sizes, slopes, strict=True):
        describing = _describe_force(float(size), spring)
        relative = alone / (1.0 + compliance * describing)
        states.append(
            FirstOrderState(
                relative=relative,
                displacements=seen.carried * drive - seen.reach[0] * describing * relative,
                is_stable_to_amplitude=slope > 0.0,
            )
        )
    return states


def _describe_force(size: float, spring: PowerSpring) -> float:
    """Return the describing function N = F_1 / P at abs(P) = size * length [N/m]; inf on overflow."""
    with np.errstate(over="ignore"):
        return float(
            sum(
                fundamental_share(n) * f / spring.length * np.float64(size) ** (n - 1)
                for n, f in spring.terms
            )
        )


def _balance_squared(compliance: complex, spring: PowerSpring) -> tuple[Floats, Floats]:
    """Return |P/length|^2 |1 + G N|^2 as coefficients and exponents of a sum of powers of |P|/length."""
    weights = np.array([fundamental_share(n) * f / spring.length for n, f in spring.terms])
    powers = np.array([float(n) for n, _ in spring.terms])
    coefficients = np.concatenate(
        [[1.0], 2.0 * compliance.real * weights, (abs(compliance) ** 2 * np.outer(weights, weights)).ravel()]
    )
    exponents = np.concatenate([[2.0], powers + 1.0, (powers[:, None] + powers[None, :]).ravel()])
    return coefficients, exponents


def _slope_sign(size: float, coefficients: Floats, exponents: Floats) -> float:
    sizes = exponents * math.log(size)
    return float(np.sum(coefficients * exponents * np.exp(sizes - sizes.max())))
