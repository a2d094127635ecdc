"""The force that a moving base puts into m0, k0 U + c0 dU/dt, as a cubic in time. SI units."""

from typing import NamedTuple

from ..kernels import Vector, kernel_without_refcount
from ..slots import Parameters


class Cubic(NamedTuple):
    """f0 + f1 tau + f2 tau^2 + f3 tau^3 [N]."""

    f0: float
    f1: float
    f2: float
    f3: float


@kernel_without_refcount
def base_force(base: Vector, par: Parameters) -> Cubic:
    """Turn the base displacement c0 + c1 tau + c2 tau^2 + c3 tau^3 [m], shape (4,), into force."""
    return Cubic(
        par.k0 * base[0] + par.c0 * base[1],
        par.k0 * base[1] + 2.0 * par.c0 * base[2],
        par.k0 * base[2] + 3.0 * par.c0 * base[3],
        par.k0 * base[3],
    )


@kernel_without_refcount
def shifted(force: Cubic, by: float) -> Cubic:
    """Express the same force in the time since ``by``."""
    return Cubic(
        force.f0 + by * (force.f1 + by * (force.f2 + by * force.f3)),
        force.f1 + by * (2.0 * force.f2 + 3.0 * by * force.f3),
        force.f2 + 3.0 * by * force.f3,
        force.f3,
    )


FORCE_TERMS = 8
"""A base force is a polynomial of degree 7 in the time since its middle."""
