"""The force between m1 and its stops, as a function of how deep it presses in. SI units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import ConfigDict

_STRICT = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class Elasticity:
    """How stiff a body is: what its contact with another body needs."""

    youngs_modulus: float
    """E [Pa]."""
    poissons_ratio: float

    def __post_init__(self) -> None:
        if not 0.0 < self.youngs_modulus < math.inf:
            msg = f"Young's modulus {self.youngs_modulus} Pa is not allowed: it must be positive and finite."
            raise ValueError(msg)
        if not -1.0 < self.poissons_ratio <= 0.5:
            msg = f"Poisson's ratio {self.poissons_ratio} is not allowed: it must lie in (-1, 0.5]."
            raise ValueError(msg)

    @property
    def plane_strain_compliance(self) -> float:
        """(1 - nu^2) / E [1/Pa]: what each body adds to a contact's compliance."""
        return (1.0 - self.poissons_ratio**2) / self.youngs_modulus


def hertz_stiffness(sphere: Elasticity, plane: Elasticity, radius_m: float) -> float:
    """Stiffness k of a sphere pressed on a plane, F = k d^(3/2) [N/m^1.5].

    k = 4/3 E* sqrt(R), 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; Johnson, Contact Mechanics (1985),
    eq. 4.23. Holds for frictionless, elastic contact much smaller than the radius.
    """
    if not 0.0 < radius_m < math.inf:
        msg = f"Sphere radius {radius_m} m is not allowed: it must be positive and finite."
        raise ValueError(msg)
    modulus = 1.0 / (sphere.plane_strain_compliance + plane.plane_strain_compliance)
    return 4.0 / 3.0 * modulus * math.sqrt(radius_m)


@dataclass(frozen=True)
class Hertz:
    """Elastic sphere on a plane: F = stiffness * penetration^(3/2), no loss of its own."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    stiffness: float
    """k_contact [N/m^1.5]."""
    kind: Literal["hertz"] = "hertz"

    def __post_init__(self) -> None:
        _require_positive("Contact stiffness", self.stiffness, "N/m^1.5")


@dataclass(frozen=True)
class NoContact:
    """No stops at all: the linear specimen, whatever the gap says."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    kind: Literal["linear"] = "linear"


@dataclass(frozen=True)
class LinearGap:
    """Stops that are springs: F = stiffness * penetration, no loss of its own."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    stiffness: float
    """[N/m]."""
    kind: Literal["linear_gap"] = "linear_gap"

    def __post_init__(self) -> None:
        _require_positive("Stop stiffness", self.stiffness, "N/m")


@dataclass(frozen=True)
class HuntCrossley:
    """Hertz contact that loses energy: F = stiffness * penetration^(3/2) * (1 + loss * penetration rate).

    Hunt and Crossley, J. Appl. Mech. 42 (1975) 440, eq. 8, with lambda = loss * stiffness. Without other
    forces m1 leaves more slowly than 1/loss whatever it came with, so that the stop never pulls; springs that
    tear it off faster than that do make it pull, as the law says.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    stiffness: float
    """[N/m^1.5]."""
    loss: float
    """chi [s/m]; about 3/2 of (1 - restitution) per approach speed while that is small. Zero is Hertz."""
    kind: Literal["hunt_crossley"] = "hunt_crossley"

    def __post_init__(self) -> None:
        _require_positive("Contact stiffness", self.stiffness, "N/m^1.5")
        if not 0.0 <= self.loss < math.inf:
            msg = f"Contact loss {self.loss} s/m is not allowed: it must be zero or positive, and finite."
            raise ValueError(msg)


@dataclass(frozen=True)
class RigidStops:
    """Stops that do not yield: m1 and m2 part with ``restitution`` times the speed of approach (Newton)."""

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    restitution: float
    """0 (they stay together) to 1 (nothing is lost)."""
    kind: Literal["rigid"] = "rigid"

    def __post_init__(self) -> None:
        if not 0.0 <= self.restitution <= 1.0:
            msg = f"Restitution {self.restitution} is not allowed: it must lie in [0, 1]."
            raise ValueError(msg)


@dataclass(frozen=True)
class PowerLaw:
    """The continuous substitute of stops: F = sum force_i (p / reference)^exponent_i, at every p.

    Held relative to a reference displacement, because a coefficient of p^47 in SI is 1e204 and overflows.
    The gap plays no part in it (Gong et al. 2025, eq. 3).
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    reference: float
    """Displacement p at which the terms have the forces given [m]."""
    terms: tuple[tuple[int, float], ...]
    """(exponent, force [N]); exponents odd and ascending, forces positive."""
    kind: Literal["power"] = "power"

    def __post_init__(self) -> None:
        _require_positive("Reference displacement", self.reference, "m")
        if not self.terms:
            msg = "A power law without terms is not allowed: give one exponent or more, or use NoContact."
            raise ValueError(msg)
        if len(self.terms) > MOST_TERMS:
            msg = f"A power law of {len(self.terms)} terms is not allowed: at most {MOST_TERMS}."
            raise ValueError(msg)
        previous = 0
        for exponent, force in self.terms:
            if exponent % 2 == 0 or not max(previous, 1) < exponent <= HIGHEST_EXPONENT:
                msg = (
                    f"Exponents {[n for n, _ in self.terms]} are not allowed: "
                    f"odd, ascending, from 3 to {HIGHEST_EXPONENT}."
                )
                raise ValueError(msg)
            _require_positive(f"Force of p^{exponent} at the reference", force, "N")
            previous = exponent


MOST_TERMS = 6
HIGHEST_EXPONENT = 1001
"""Beyond it the law is a wall for every purpose: a part in a thousand of p changes the force by e."""
PAPER_INDENTATION_M = 1e-6
"""The paper fits its continuous models where the contact is pressed in by 1 um (its section 2)."""


def fitted_power_law(
    exponents: Sequence[int],
    contact: Hertz,
    gap_m: float,
    indentation_m: float = PAPER_INDENTATION_M,
    shares: Sequence[float] | None = None,
) -> PowerLaw:
    """Fit a sum of powers to a Hertz contact as the paper does: equal force at p = gap + indentation.

    Parameters
    ----------
    exponents
        Odd, in any order: (5,) or (3, 5, 7).
    contact, gap_m, indentation_m
        What is fitted, and where.
    shares
        Part of that force which each power takes; they must add up to 1. The paper leaves it open; the
        default is equal parts.

    Raises
    ------
    ValueError
        When an argument is not allowed.

    """
    parts = [1.0 / len(exponents)] * len(exponents) if shares is None else list(shares)
    if len(parts) != len(exponents) or not math.isclose(sum(parts), 1.0, rel_tol=1e-9):
        msg = f"Shares {parts} of exponents {list(exponents)} are not allowed: one each, adding up to 1."
        raise ValueError(msg)
    _require_positive("Indentation of the fit", indentation_m, "m")
    force = contact.stiffness * indentation_m**1.5
    terms = sorted((n, part * force) for n, part in zip(exponents, parts, strict=True))
    return PowerLaw(gap_m + indentation_m, tuple(terms))


def fitted_linear_gap(contact: Hertz, indentation_m: float = PAPER_INDENTATION_M) -> LinearGap:
    """Fit springy stops to a Hertz contact: equal force at the given indentation."""
    _require_positive("Indentation of the fit", indentation_m, "m")
    return LinearGap(contact.stiffness * math.sqrt(indentation_m))


ContactLaw = Hertz | NoContact | LinearGap | HuntCrossley | RigidStops | PowerLaw


def _require_positive(name: str, value: float, unit: str) -> None:
    if not 0.0 < value < math.inf:
        msg = f"{name} {value} {unit} is not allowed: it must be positive and finite."
        raise ValueError(msg)
