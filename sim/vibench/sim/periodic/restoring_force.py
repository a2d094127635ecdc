"""Nonlinear spring between m1 and m2: force and derivatives. SI units."""

import math
from dataclasses import dataclass

import numpy as np

from ..specimen.contact_laws import NoContact, PowerLaw, RigidStops
from ..specimen.specimen import Floats, Specimen


@dataclass(frozen=True)
class PowerSpring:
    """Sum of odd powers, F = sum F_i (p / length)^n_i. Scaling by ``length`` avoids overflow."""

    length: float
    """Reference displacement at which term i equals F_i [m]."""
    terms: tuple[tuple[int, float], ...]
    """Pairs of exponent n_i (odd) and force F_i [N]; empty for no force."""

    def __post_init__(self) -> None:
        if not 0.0 < self.length < math.inf:
            raise ValueError(
                f"Reference displacement {self.length} m is not allowed: it must be positive and finite."
            )
        for exponent, force in self.terms:
            if exponent < 1 or exponent % 2 == 0 or not math.isfinite(force):
                raise ValueError(
                    f"The term ({exponent}, {force} N) needs an odd exponent and a finite force."
                )

    @property
    def kinks(self) -> tuple[float, ...]:
        """Values of p at which a derivative of the force jumps [m]; empty, because a power law is smooth."""
        return ()

    @property
    def is_odd(self) -> bool:
        """Whether F(-p, -v) = -F(p, v): True, because all powers are odd."""
        return True

    def force(self, p: Floats, rate: Floats) -> Floats:  # noqa: ARG002 - does not depend on the rate
        """Return the force F, shape of ``p`` [N]; infinite on overflow."""
        with np.errstate(over="ignore", under="ignore"):
            return np.asarray(sum(f * (p / self.length) ** n for n, f in self.terms) + 0.0 * p)

    def stiffness(self, p: Floats, rate: Floats) -> Floats:  # noqa: ARG002 - does not depend on the rate
        """Return the stiffness dF/dp, shape of ``p`` [N/m]."""
        with np.errstate(over="ignore", under="ignore"):
            slope = sum(n * f / self.length * (p / self.length) ** (n - 1) for n, f in self.terms)
            return np.asarray(slope + 0.0 * p)

    def damping(self, p: Floats, rate: Floats) -> Floats:  # noqa: ARG002 - a power law has no loss
        """Return the damping dF/d(dp/dt), which is zero, shape of ``p`` [N s/m]."""
        return np.zeros_like(p)


@dataclass(frozen=True)
class GapSpring:
    """Stops on one or both sides: F = (k d^exponent + beside d) (1 + loss dd/dt) at penetration d."""

    stiffness_coefficient: float
    """Contact stiffness k [N/m^exponent]."""
    exponent: float
    """Exponent of the penetration: 1 for a linear stop, 3/2 for a Hertz contact."""
    upper: float
    """Gap at positive p [m]; infinite for no stop."""
    lower: float
    """Gap at negative p, positive [m]; infinite for no stop."""
    loss: float = 0.0
    """Loss factor: Hunt and Crossley's lambda over k [s/m]."""
    beside: float = 0.0
    """Stiffness of a linear spring parallel to the stop [N/m]."""

    def __post_init__(self) -> None:
        if not (self.stiffness_coefficient > 0.0 and self.exponent >= 1.0 and self.loss >= 0.0):
            raise ValueError(
                f"A stop of stiffness {self.stiffness_coefficient}, exponent {self.exponent} and loss "
                f"{self.loss} s/m is not allowed: give a positive stiffness, exponent >= 1 and loss >= 0."
            )
        if not (self.upper > 0.0 and self.lower > 0.0 and math.isfinite(min(self.upper, self.lower))):
            raise ValueError(
                f"Stops at {self.upper} and -{self.lower} m: give positive distances, at least one finite."
            )

    @property
    def length(self) -> float:
        """Length scale of the spring: the smaller gap [m]."""
        return min(self.upper, self.lower)

    @property
    def kinks(self) -> tuple[float, ...]:
        """Values of p at which a derivative of the force jumps, ascending [m]: the stops."""
        return tuple(stop for stop in (-self.lower, self.upper) if math.isfinite(stop))

    @property
    def is_odd(self) -> bool:
        """Whether F(-p, -v) = -F(p, v): True for equal gaps."""
        return self.upper == self.lower

    def force(self, p: Floats, rate: Floats) -> Floats:
        """Return the force F, shape of ``p`` [N]."""
        side, depth = self._penetration(p)
        return side * self._push(depth) * (1.0 + self.loss * side * rate)

    def stiffness(self, p: Floats, rate: Floats) -> Floats:
        """Return the stiffness dF/dp, shape of ``p`` [N/m]."""
        side, depth = self._penetration(p)
        slope = self.exponent * self.stiffness_coefficient * depth ** (self.exponent - 1.0) + self.beside
        return np.where(depth > 0.0, slope * (1.0 + self.loss * side * rate), 0.0)

    def damping(self, p: Floats, rate: Floats) -> Floats:  # noqa: ARG002 - the force is linear in the rate
        """Return the damping dF/d(dp/dt), shape of ``p`` [N s/m]."""
        _, depth = self._penetration(p)
        return self.loss * self._push(depth)

    def _push(self, depth: Floats) -> Floats:
        return self.stiffness_coefficient * depth**self.exponent + self.beside * depth

    def _penetration(self, p: Floats) -> tuple[Floats, Floats]:
        depth = np.where(p > 0.0, p - self.upper, -p - self.lower)
        return np.sign(p), np.maximum(depth, 0.0)


RestoringForce = PowerSpring | GapSpring
"""Nonlinear force F(p, dp/dt) between m1 and m2, parallel to the spring k1."""
LINEAR = PowerSpring(1.0, ())
"""Spring that exerts no force; its length scale is arbitrary."""


def spring_of(specimen: Specimen) -> RestoringForce:
    """Return the restoring force of a specimen's stops for harmonic balance.

    Raises ValueError for rigid stops, because their force is not finite.
    """
    lower, upper = specimen.gaps_m
    match specimen.contact:
        case PowerLaw(reference=reference, terms=terms):
            return PowerSpring(reference, terms)
        case NoContact():
            return LINEAR
        case RigidStops():
            raise ValueError(
                "Rigid stops have no finite contact force: integrate in time instead, or give Hertz stops."
            )
        case law:
            return GapSpring(*law.stops.term, upper, lower, law.stops.loss, law.stops.spring_beside)
