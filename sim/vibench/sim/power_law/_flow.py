"""The rates of motion under a power law, whose force acts at every p. SI units.

The unknowns (p, dp/dt, x, z, vx, vz, t) stand in the places of (w, r, x, z, vx, vz, t) of a contact, and s is
time itself, so that the same step advances both.
"""

import math
from typing import NamedTuple

from ..contact import base_force_at, rates_of
from ..kernels import SimdVector, Vector, inlined, kernel_without_refcount
from ..model import MOST_TERMS
from ..slots import Parameters, PowerTerms

WALL_TURN = 1.5
"""See `short_of_the_wall`: for p^47 the errors are ten times smaller than without, at no cost, for steps
that would fail are not tried [rad]."""
SHORTENING, MOST_SHORTENINGS = 0.75, 40


class PowerSystem(NamedTuple):
    """A specimen under a power law."""

    par: Parameters
    power: PowerTerms


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


@rates_of(PowerSystem)
@inlined
def power_rates(
    at: Vector,
    rates: Vector,
    side: float,  # noqa: ARG001 - the law acts on both
    force: Vector,
    middle: float,
    system: PowerSystem,
) -> None:
    """Write d/dt of the seven unknowns at ``at`` into ``rates``."""
    par, power = system.par, system.power
    p, rate, vx, vz = at[0], at[1], at[4], at[5]
    pressing = par.k1 * p + par.c1 * rate + power_force(p, power)
    pull = par.k2 * (at[3] - at[2]) + par.c2 * (vz - vx)
    drive = base_force_at(force, at[6] - middle) - par.k0 * at[2] - par.c0 * vx
    rates[0] = rate
    rates[1] = pull * par.inverse2 - pressing * par.inverse_pair
    rates[2] = vx
    rates[3] = vz
    rates[4] = (pull + drive) * par.inverse0
    rates[5] = (pressing - pull) * par.inverse2
    rates[6] = 1.0
    # Nobody's rate: p itself, for who carries a small change along.
    rates[7] = p


@kernel_without_refcount
def short_of_the_wall(
    step: float, at: Vector, linear: float, inverse_mass: float, power: PowerTerms
) -> float:
    """Shorten a step until it would turn the stiffest spring on its way by `WALL_TURN` at most.

    In free motion the error sees nothing of a steep wall ahead, and a stage that meets it late in the step is
    too little for the estimate. ``at`` begins with p and dp/dt.
    """
    outward = at[1] if at[0] >= 0.0 else -at[1]
    for _ in range(MOST_SHORTENINGS):
        reach = abs(at[0]) + max(outward, 0.0) * step
        if step * stiffest_rate(reach, linear, inverse_mass, power) <= WALL_TURN:
            break
        step *= SHORTENING
    return step
