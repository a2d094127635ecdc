"""Tables of the relative motion for the filter, for one specimen and sample rate."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from vibench.sim import PowerLaw, RigidStops, Specimen

from ..errors import InvalidRequest
from ..signals.arrays import Reals

STATES = 8
"""States: X, Y, Z and their rates relative to the base, base velocity W, error B of the acceleration, SI.

Deviations of the estimated parameters follow these states. Equations: docs/hidden-motion.md.
"""
X, Y, Z, VX, VY, VZ, W, B = range(STATES)
_SMALL_STEPS_A_CONTACT = 36
"""Number of steps in the shortest collision; the force at 1 um is then accurate to 1e-3."""
_FASTEST_APPROACH_M_PER_S = 0.5
_FEWEST_SMALL_STEPS = 4
HERTZ_EXPONENT = 1.5
_MICROMETRE = 1e-6


@dataclass(frozen=True)
class TrackedSpecimen:
    """A specimen with contact law F = f (d / 1 um)^n (1 + chi d') at indentation d; f, n, chi are free."""

    specimen: Specimen
    force_at_1um_n: float
    """Force at an indentation of 1 um [N]; a parallel spring of the law is not included."""
    exponent: float
    loss_s_per_m: float
    """Loss chi [s/m]; a search may find a negative value within its bounds."""

    @property
    def steepness(self) -> float:
        """Factor K of the force F = K d^n [N/m^n]."""
        return float(self.force_at_1um_n / _MICROMETRE**self.exponent)


def tracked_specimen(specimen: Specimen) -> TrackedSpecimen:
    """Return a described specimen for tracking; raises InvalidRequest for rigid or unsuitable stops."""
    match specimen.contact:
        case RigidStops() | PowerLaw():
            raise InvalidRequest(
                f"stops of the kind {specimen.contact.kind!r} cannot be tracked: the filter needs a "
                "contact force that depends on the penetration; describe the contact as hertz, "
                "hunt_crossley:LOSS, linear_gap or linear"
            )
        case _:
            stops = specimen.contact.stops
            stiffness, exponent = stops.term
            return TrackedSpecimen(specimen, stiffness * _MICROMETRE**exponent, exponent, stops.loss)


@dataclass(frozen=True, eq=False)
class StepTables:
    """Tables that the filter needs for a specimen."""

    flow: Reals
    """Matrix from state, base acceleration and its increment to the next state, no stops; shape (8, 10)."""
    small_flow: Reals
    """Matrix like `flow`, for a small step instead of a sample, shape (8, 10)."""
    small_steps: int
    stop: Reals
    """A `TrackedStop` of native/structures.hpp, shape (8,)."""
    force_input: Reals
    """State after a force of 1 N on m1 against m2 held over a sample, shape (8,)."""
    acceleration_input: Reals
    """State after a base acceleration of 1 m/s2 held over a sample, shape (8,)."""
    step_s: float


def equations(specimen: Specimen, coupling_rad_per_s: float) -> tuple[Reals, Reals, Reals]:
    """Return A (8, 8), and input vectors (8,) for recorded acceleration and a force on m1 against m2."""
    m0, m1, m2 = specimen.masses
    k0, k1, k2 = specimen.stiffnesses
    c0, c1, c2 = specimen.dampings
    a = np.zeros((STATES, STATES))
    for place, rate in ((X, VX), (Y, VY), (Z, VZ)):
        a[place, rate] = 1.0
    a[VX, [X, Z, VX, VZ]] = -(k0 + k2) / m0, k2 / m0, -(c0 + c2) / m0, c2 / m0
    a[VY, [Y, Z, VY, VZ]] = -k1 / m1, k1 / m1, -c1 / m1, c1 / m1
    a[VZ, [X, Y, Z]] = k2 / m2, k1 / m2, -(k1 + k2) / m2
    a[VZ, [VX, VY, VZ]] = c2 / m2, c1 / m2, -(c1 + c2) / m2
    a[[VX, VY, VZ], B] = -1.0
    a[W, B] = 1.0
    base, force = np.zeros(STATES), np.zeros(STATES)
    base[[VX, VY, VZ]] = -1.0
    base[W] = 1.0
    base[B] = coupling_rad_per_s
    force[VY], force[VZ] = 1.0 / m1, -1.0 / m2
    return a, base, force


def exact_flow(a: Reals, inputs: Reals, step_s: float) -> Reals:
    """Return the matrix of one step for state, input and the input's linear increase, shape (n, n + 2)."""
    n = len(a)
    joint = np.zeros((n + 2, n + 2))
    joint[:n, :n], joint[:n, n] = a * step_s, inputs * step_s
    joint[n, n + 1] = 1.0
    return np.ascontiguousarray(expm(joint)[:n])


def step_tables(tracked: TrackedSpecimen, sample_rate_hz: float, coupling_rad_per_s: float) -> StepTables:
    """Build the tables of a specimen."""
    specimen = tracked.specimen
    step_s = 1.0 / sample_rate_hz
    a, base, force = equations(specimen, coupling_rad_per_s)
    count = small_steps_of(tracked, step_s)
    lower, upper = specimen.gaps_m
    _, m1, m2 = specimen.masses
    flow = exact_flow(a, base, step_s)
    return StepTables(
        flow=flow,
        small_flow=exact_flow(a, base, step_s / count),
        small_steps=count,
        stop=np.array(
            [
                lower,
                upper,
                tracked.steepness,
                tracked.exponent,
                specimen.contact.stops.spring_beside,
                tracked.loss_s_per_m,
                1.0 / m1,
                1.0 / m2,
            ]
        ),
        force_input=exact_flow(a, force, step_s)[:, STATES].copy(),
        acceleration_input=flow[:, STATES].copy(),
        step_s=step_s,
    )


def indentation_m(tracked: TrackedSpecimen, approach_m_per_s: float) -> float:
    """Return the largest indentation of a stop for a speed of approach."""
    _, m1, m2 = tracked.specimen.masses
    energy, n = 0.5 * m1 * m2 / (m1 + m2) * approach_m_per_s**2, tracked.exponent
    return float(((n + 1.0) * energy / tracked.steepness) ** (1.0 / (n + 1.0)))


def small_steps_of(tracked: TrackedSpecimen, step_s: float) -> int:
    """Return the number of small steps per sample that resolve the shortest collision."""
    if tracked.steepness == 0.0:
        return _FEWEST_SMALL_STEPS
    # The time to the deepest point and back is pi / 2 times the time at constant speed.
    deepest_m = indentation_m(tracked, _FASTEST_APPROACH_M_PER_S)
    duration_s = math.pi * deepest_m / _FASTEST_APPROACH_M_PER_S
    return max(_FEWEST_SMALL_STEPS, math.ceil(step_s * _SMALL_STEPS_A_CONTACT / duration_s))
