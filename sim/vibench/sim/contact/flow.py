"""The motion in contact, made polynomial so that a high-order method keeps its order. SI units.

With p = side (gap + w^2) and dt = w ds the Hertz force is k w^3 and every rate is a polynomial: the
kink of penetration^(3/2) at w = 0 is gone, and onset and exit are simple zeros of w. One step is
Dormand and Prince's order 8(5,3); coefficients and error estimate after Hairer, Norsett and Wanner,
Solving Ordinary Differential Equations I (2nd ed. 1993), section II.10 and the code DOP853.

The seven unknowns are (w, r, x, z, vx, vz, t), r = d|p|/dt; the eighth place only fills the lanes
of the processor. The base enters as one polynomial, base_force = k0 U + c0 dU/dt.
"""

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray
from scipy.integrate._ivp import dop853_coefficients as _dop

from ..kernels.arrays import Table, Vector
from ..kernels.compile import inlined, kernel_without_refcount
from ..slots.parameters import Parameters

W, R, CX, CZ, CVX, CVZ, T = range(7)
WIDTH = 8
STAGES = 12
WORK_ROWS = STAGES + 4
"""Rows of a workspace: the stages, an argument, the accepted point, the trial, a spare."""
ARGUMENT, POINT, TRIAL, SPARE = range(STAGES, WORK_ROWS)
_A = [[float(value) for value in row] for row in _dop.A[:STAGES, :STAGES]]
A21 = _A[1][0]
A31, A32 = _A[2][:2]
A41, A43 = _A[3][0], _A[3][2]
A51, A53, A54 = _A[4][0], _A[4][2], _A[4][3]
A61, A64, A65 = _A[5][0], _A[5][3], _A[5][4]
A71, A74, A75, A76 = _A[6][0], _A[6][3], _A[6][4], _A[6][5]
A81, A84, A85, A86, A87 = _A[7][0], _A[7][3], _A[7][4], _A[7][5], _A[7][6]
A91, A94, A95, A96, A97, A98 = _A[8][0], *_A[8][3:8]
A101, A104, A105, A106, A107, A108, A109 = _A[9][0], *_A[9][3:9]
A111, A114, A115, A116, A117, A118, A119, A1110 = _A[10][0], *_A[10][3:10]
A121, A124, A125, A126, A127, A128, A129, A1210, A1211 = _A[11][0], *_A[11][3:11]
_B = [float(value) for value in _dop.B]
B1, B6, B7, B8, B9, B10, B11, B12 = _B[0], *_B[5:12]
ERROR_5: NDArray[np.float64] = np.ascontiguousarray(_dop.E5[:STAGES])
ERROR_3: NDArray[np.float64] = np.ascontiguousarray(_dop.E3[:STAGES])
BLEND = 0.01
"""Weight of the third-order estimate in DOP853's error."""
LARGEST_SQUARE = 1e300
"""A squared error beyond this is one that no step may have."""


@inlined
def base_force_at(force: Vector, since_middle: float) -> float:
    """Polynomial of degree 7, summed in pairs: the shortest chain of dependent multiplications."""
    u = since_middle
    u2 = u * u
    low: float = (force[0] + force[1] * u) + u2 * (force[2] + force[3] * u)
    high: float = (force[4] + force[5] * u) + u2 * (force[6] + force[7] * u)
    return low + u2 * u2 * high


@inlined
def gap_of(side: float, lower: float, upper: float) -> float:
    """Clearance of the stop on one side [m]."""
    return upper if side > 0.0 else lower


System = TypeVar("System", bound=tuple[object, ...])
Rates = TypeVar("Rates", bound=Callable[..., None])


def motion_rates(
    at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: System
) -> None:
    """Write the rates of a system, chosen by its type when a kernel is compiled.

    One source of the twelve stages serves every law, and none pays for another's.
    """
    raise NotImplementedError


def places_of(system: System) -> int:
    """Give how many places a point of a system's motion has, as a constant of the compiled kernel."""
    raise NotImplementedError


def rates_of(kind: type[System], places: int = WIDTH) -> Callable[[Rates], Rates]:
    """Declare a kernel to be the `motion_rates` of a kind of system, and how many places its points have."""

    # numba calls what is overloaded with types, not values, and wants the names of what it returns.
    def declared(kernel: Rates) -> Rates:
        @overload(motion_rates, jit_options={"forceinline": True})
        def _choose_rates(
            at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: System
        ) -> Callable[..., None] | None:
            del at, rates, side, force, middle
            if getattr(system, "instance_class", None) is not kind:
                return None

            def chosen(
                at: Vector, rates: Vector, side: float, force: Vector, middle: float, system: System
            ) -> None:
                kernel(at, rates, side, force, middle, system)

            return chosen

        @overload(places_of, jit_options={"forceinline": True})
        def _choose_places(system: System) -> Callable[..., int] | None:
            if getattr(system, "instance_class", None) is not kind:
                return None

            def chosen(system: System) -> int:  # noqa: ARG001 - only its type counts
                return places

            return chosen

        return kernel

    return declared


@rates_of(Parameters)
@inlined
def contact_rates(
    at: Vector, rates: Vector, side: float, force: Vector, middle: float, par: Parameters
) -> None:
    """Write d/ds of the seven unknowns at ``at`` into ``rates``.

    The stop's reaction is formed on the positive side and its sign set once, so that a mirrored
    motion is mirrored to the last bit.
    """
    w, r, vx, vz = at[0], at[1], at[4], at[5]
    gap = gap_of(side, par.lower, par.upper)
    penetration = w * w
    reaction = penetration * (par.linear_stiffness + par.contact_stiffness * w) * (1.0 + par.loss * r)
    pressing = par.k1 * (gap + penetration) + par.c1 * r + reaction
    pull = par.k2 * (at[3] - at[2]) + par.c2 * (vz - vx)
    drive = base_force_at(force, at[6] - middle) - par.k0 * at[2] - par.c0 * vx
    rates[0] = 0.5 * r
    rates[1] = w * (side * pull * par.inverse2 - pressing * par.inverse_pair)
    rates[2] = w * vx
    rates[3] = w * vz
    rates[4] = w * ((pull + drive) * par.inverse0)
    rates[5] = w * ((side * pressing - pull) * par.inverse2)
    rates[6] = w
    rates[7] = 0.0


@kernel_without_refcount
def trial_step(  # noqa: C901 - the twelve stages of one formula, in order
    work: Table, step: float, side: float, force: Vector, middle: float, system: System
) -> None:
    """Step from ``work[POINT]``, whose rates are in ``work[0]``, and write the end to ``work[TRIAL]``."""
    h, places = step, places_of(system)
    k1, k2, k3, k4, k5, k6 = work[0], work[1], work[2], work[3], work[4], work[5]
    k7, k8, k9, k10, k11, k12 = work[6], work[7], work[8], work[9], work[10], work[11]
    u, y, end = work[ARGUMENT], work[POINT], work[TRIAL]
    for i in range(places):
        u[i] = y[i] + h * (A21 * k1[i])
    motion_rates(u, k2, side, force, middle, system)
    for i in range(places):
        u[i] = y[i] + h * (A31 * k1[i] + A32 * k2[i])
    motion_rates(u, k3, side, force, middle, system)
    for i in range(places):
        u[i] = y[i] + h * (A41 * k1[i] + A43 * k3[i])
    motion_rates(u, k4, side, force, middle, system)
    for i in range(places):
        u[i] = y[i] + h * (A51 * k1[i] + A53 * k3[i] + A54 * k4[i])
    motion_rates(u, k5, side, force, middle, system)
    for i in range(places):
        u[i] = y[i] + h * (A61 * k1[i] + A64 * k4[i] + A65 * k5[i])
    motion_rates(u, k6, side, force, middle, system)
    for i in range(places):
        u[i] = y[i] + h * (A71 * k1[i] + A74 * k4[i] + A75 * k5[i] + A76 * k6[i])
    motion_rates(u, k7, side, force, middle, system)
    for i in range(places):
        u[i] = y[i] + h * (A81 * k1[i] + A84 * k4[i] + A85 * k5[i] + A86 * k6[i] + A87 * k7[i])
    motion_rates(u, k8, side, force, middle, system)
    for i in range(places):
        early = A91 * k1[i] + A94 * k4[i] + A95 * k5[i]
        u[i] = y[i] + h * (early + A96 * k6[i] + A97 * k7[i] + A98 * k8[i])
    motion_rates(u, k9, side, force, middle, system)
    for i in range(places):
        early = A101 * k1[i] + A104 * k4[i] + A105 * k5[i] + A106 * k6[i]
        u[i] = y[i] + h * (early + A107 * k7[i] + A108 * k8[i] + A109 * k9[i])
    motion_rates(u, k10, side, force, middle, system)
    for i in range(places):
        early = A111 * k1[i] + A114 * k4[i] + A115 * k5[i] + A116 * k6[i]
        u[i] = y[i] + h * (early + A117 * k7[i] + A118 * k8[i] + A119 * k9[i] + A1110 * k10[i])
    motion_rates(u, k11, side, force, middle, system)
    for i in range(places):
        early = A121 * k1[i] + A124 * k4[i] + A125 * k5[i] + A126 * k6[i] + A127 * k7[i]
        u[i] = y[i] + h * (early + A128 * k8[i] + A129 * k9[i] + A1210 * k10[i] + A1211 * k11[i])
    motion_rates(u, k12, side, force, middle, system)
    for i in range(places):
        early = B1 * k1[i] + B6 * k6[i] + B7 * k7[i] + B8 * k8[i]
        end[i] = y[i] + h * (early + B9 * k9[i] + B10 * k10[i] + B11 * k11[i] + B12 * k12[i])


@inlined
def squared_errors(work: Table, column: int, allowed: float) -> tuple[float, float]:
    """Squares of the fifth- and third-order errors of one unknown's step, over step and what is allowed."""
    fifth, third = 0.0, 0.0
    for stage in range(STAGES):
        fifth += ERROR_5[stage] * work[stage, column]
        third += ERROR_3[stage] * work[stage, column]
    return (fifth / allowed) ** 2, (third / allowed) ** 2


@inlined
def blended_error(fifth: float, third: float, count: float, step: float) -> float:
    """DOP853's error from sums of squares over ``count``; infinite when a stage ran away or overflowed."""
    blended = fifth + BLEND * third
    if blended == 0.0:
        return 0.0
    if not blended < LARGEST_SQUARE:
        # A stage ran away: fifth over infinity would pass for no error at all.
        return math.inf
    return step * fifth / math.sqrt(count * blended)


@kernel_without_refcount
def step_error(work: Table, step: float, root_scale: float, rate_scale: float, tolerance: float) -> float:
    """Error of the step just tried, over what is allowed: on w and r, the two fast unknowns."""
    fifth_w, third_w = squared_errors(work, W, tolerance * (root_scale + abs(work[POINT, W])))
    fifth_r, third_r = squared_errors(work, R, tolerance * (rate_scale + abs(work[POINT, R])))
    return blended_error(fifth_w + fifth_r, third_w + third_r, 2.0, step)


@kernel_without_refcount
def contact_error(work: Table, step: float, root_scale: float, rate_scale: float, tolerance: float) -> float:
    """Error of a step in contact: on w, r and vx.

    m0 feels no contact, but a light one is faster than the contact itself, and a step that it cannot bear
    must be seen.
    """
    fifth_w, third_w = squared_errors(work, W, tolerance * (root_scale + abs(work[POINT, W])))
    fifth_r, third_r = squared_errors(work, R, tolerance * (rate_scale + abs(work[POINT, R])))
    fifth_x, third_x = squared_errors(work, CVX, tolerance * (rate_scale + abs(work[POINT, CVX])))
    return blended_error(fifth_w + fifth_r + fifth_x, third_w + third_r + third_x, 2.0, step)
