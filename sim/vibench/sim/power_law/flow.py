"""The force of a power law, which acts at every p. SI units."""

import math

from ..kernels.compile import inlined
from ..kernels.simd import SimdVector
from ..model.power_law import MOST_TERMS
from ..slots.parameters import PowerTerms


@inlined
def whole_power(base: float, exponent: int) -> float:
    """Raise ``base`` to a whole power, zero or more, by squaring."""
    result = 1.0
    while exponent > 0:
        if exponent & 1:
            result *= base
        base *= base
        exponent >>= 1
    return result


@inlined
def power_force(p: float, power: PowerTerms) -> float:
    """Sum the terms by Horner's scheme in q = (p/p_ref)^2; infinite or NaN where it overflows [N]."""
    u = p * power.inverse_reference
    square = u * u
    force = 0.0
    for place in range(MOST_TERMS - 1, -1, -1):
        if power.halves[place] > 0:
            force = (force + power.forces[place]) * whole_power(square, power.halves[place])
    result: float = force * u
    return result


@inlined
def power_forces(p: SimdVector, power: PowerTerms) -> SimdVector:
    """Give the force at eight p at once [N]."""
    u = power.inverse_reference * p
    square = u * u
    force = 0.0 * u
    for place in range(MOST_TERMS - 1, -1, -1):
        half = power.halves[place]
        if half == 0:
            continue
        force += power.forces[place]
        base = square
        while half > 0:
            if half & 1:
                force *= base
            base *= base
            half >>= 1
    return force * u


@inlined
def stiffest_rate(p: float, linear: float, inverse_mass: float, power: PowerTerms) -> float:
    """Angular frequency at ``p`` of a mass on a linear spring and the law's steepest term [rad/s]."""
    exponent = 1
    for place in range(MOST_TERMS):
        exponent += 2 * power.halves[place]
    secant = power_force(p, power) / p if p > 0.0 else 0.0
    rate: float = math.sqrt((linear + exponent * secant) * inverse_mass)
    return rate
