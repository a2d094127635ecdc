"""The rates of motion under a power law, whose force acts at every p. SI units.

The unknowns (p, dp/dt, x, z, vx, vz, t) stand in the places of (w, r, x, z, vx, vz, t) of a contact, and s is
time itself, so that the same step advances both.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from numba.extending import overload

from ..contact import base_force_at, motion_rates
from ..kernels import SimdVector, Vector, inlined
from ..model import MOST_TERMS
from ..slots import Parameters, PowerTerms


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
def stiffest_rate(p: float, par: Parameters, power: PowerTerms) -> float:
    """Angular frequency that the law's steepest term would give the pair at ``p``, at least [rad/s]."""
    exponent = 1
    for place in range(MOST_TERMS):
        exponent += 2 * power.halves[place]
    secant = power_force(p, power) / p if p > 0.0 else 0.0
    rate: float = math.sqrt((par.k1 + exponent * secant) / par.reduced_mass)
    return rate


@inlined
def power_rates(
    at: Vector, rates: Vector, force: Vector, middle: float, par: Parameters, power: PowerTerms
) -> None:
    """Write d/dt of the seven unknowns at ``at`` into ``rates``."""
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


@overload(motion_rates, jit_options={"forceinline": True})
def _choose_power_rates(
    at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: PowerSystem
) -> Callable[..., None] | None:
    # numba calls this with types, not values, and wants the names of what it returns.
    del at, rates, side, force, middle
    if getattr(system, "instance_class", None) is not PowerSystem:
        return None

    # fmt: off
    def chosen(
        at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: PowerSystem  # noqa: ARG001 - as above
    ) -> None:
        # fmt: on
        power_rates(at, rates, force, middle, system.par, system.power)

    return chosen
