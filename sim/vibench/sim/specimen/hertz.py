"""Hertz contact of an elastic sphere on a plane: the paper's stops. SI units."""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from .stops import LawWord, Reference, Stops, Strict, require_nothing, require_positive


@dataclass(frozen=True)
class Hertz(Strict):
    """Elastic sphere on a plane: F = stiffness * penetration^(3/2), without loss."""

    OWN_UNITS: ClassVar = {"stiffness": "N m-1.5"}

    stiffness: float
    """Contact stiffness k_contact [N/m^1.5]."""
    kind: Literal["hertz"] = "hertz"

    def __post_init__(self) -> None:
        require_positive("Contact stiffness", self.stiffness, "N/m^1.5")

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops(contact_stiffness=float(self.stiffness))


def _parse(detail: str, reference: Reference) -> Hertz:
    require_nothing(detail)
    return Hertz(reference.stiffness)


HERTZ = LawWord("hertz", "an elastic sphere on a plane, force as d^1.5", "hertz", _parse)


@dataclass(frozen=True)
class Elasticity:
    """Elastic constants of one of the two bodies in contact."""

    youngs_modulus: float
    """Young's modulus E of the body [Pa]."""
    poissons_ratio: float

    def __post_init__(self) -> None:
        require_positive("Young's modulus", self.youngs_modulus, "Pa")
        if not -1.0 < self.poissons_ratio <= 0.5:
            raise ValueError(
                f"Poisson's ratio {self.poissons_ratio} is not allowed: it must lie in (-1, 0.5]."
            )

    @property
    def plane_strain_compliance(self) -> float:
        """Plane-strain compliance (1 - nu^2) / E [1/Pa]; the compliances of two bodies in contact add up."""
        return (1.0 - self.poissons_ratio**2) / self.youngs_modulus


def hertz_stiffness(sphere: Elasticity, plane: Elasticity, radius_m: float) -> float:
    """Return the stiffness k of a sphere on a plane, F = k d^(3/2) [N/m^1.5].

    k = 4/3 E* sqrt(R) with 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (Johnson, Contact Mechanics (1985), eq.
    4.23), valid for a frictionless, elastic contact much smaller than the radius.

    Raises ValueError when the radius is not positive.
    """
    require_positive("Sphere radius", radius_m, "m")
    modulus = 1.0 / (sphere.plane_strain_compliance + plane.plane_strain_compliance)
    return 4.0 / 3.0 * modulus * math.sqrt(radius_m)
