"""Contact laws between m1 and its stops, and the table of their names. SI units.

To add a law of the form F = (k1 d + k d^(3/2)) (1 + loss dd/dt) at indentation d, add its class here and an
entry in `CONTACT_LAWS`. The native engine, the independent solution and harmonic balance need no change,
because they read the law's `stops`. A force of another form also needs a type in native/contact.hpp.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from .stops import (
    PAPER_INDENTATION_M,
    LawWord,
    Stops,
    Strict,
    UnreadableLawError,
    number_in,
    require_nothing,
    require_positive,
)

MOST_TERMS = 6
HIGHEST_EXPONENT = 1001
"""Largest exponent, close to a rigid wall: a 0.1 % change of p changes the force by a factor of e."""


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
    4.23). Valid for a frictionless, elastic contact much smaller than the radius.

    Raises ValueError when the radius is not positive.
    """
    require_positive("Sphere radius", radius_m, "m")
    modulus = 1.0 / (sphere.plane_strain_compliance + plane.plane_strain_compliance)
    return 4.0 / 3.0 * modulus * math.sqrt(radius_m)


@dataclass(frozen=True)
class HuntCrossley(Strict):
    """Hertz contact with energy loss: F = stiffness * penetration^(3/2) * (1 + loss * penetration rate).

    Hunt and Crossley, J. Appl. Mech. 42 (1975) 440, eq. 8, with lambda = loss * stiffness. If no other force
    acts, the separation speed is below 1/loss at any approach speed, so the force is never negative. If
    springs pull m1 off the stop faster than 1/loss, the force becomes negative (tensile).
    """

    OWN_UNITS: ClassVar = {"stiffness": "N m-1.5", "loss": "s m-1"}

    stiffness: float
    """Contact stiffness [N/m^1.5]."""
    loss: float
    """Loss factor [s/m], about 3/2 (1 - restitution) / approach speed for small losses. Zero gives Hertz."""
    kind: Literal["hunt_crossley"] = "hunt_crossley"

    def __post_init__(self) -> None:
        require_positive("Contact stiffness", self.stiffness, "N/m^1.5")
        if not 0.0 <= self.loss < math.inf:
            raise ValueError(
                f"Contact loss {self.loss} s/m is not allowed: it must be zero or positive, and finite."
            )

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops(contact_stiffness=float(self.stiffness), loss=float(self.loss))


@dataclass(frozen=True)
class LinearGap(Strict):
    """Linear elastic stops: F = stiffness * penetration, without loss."""

    OWN_UNITS: ClassVar = {"stiffness": "N m-1"}

    stiffness: float
    """Stiffness of a stop [N/m]."""
    kind: Literal["linear_gap"] = "linear_gap"

    def __post_init__(self) -> None:
        require_positive("Stop stiffness", self.stiffness, "N/m")

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops(linear_stiffness=float(self.stiffness))


def fit_linear_gap(contact_stiffness: float, indentation_m: float = PAPER_INDENTATION_M) -> LinearGap:
    """Return linear stops with the same force as a Hertz contact of k [N/m^1.5] at the given indentation."""
    require_positive("Indentation of the fit", indentation_m, "m")
    return LinearGap(contact_stiffness * math.sqrt(indentation_m))


@dataclass(frozen=True)
class RigidStops(Strict):
    """Rigid stops: m1 and m2 separate at ``restitution`` times the approach speed (Newton's law)."""

    restitution: float
    """Coefficient of restitution, from 0 (the masses stay together) to 1 (no energy is lost)."""
    kind: Literal["rigid"] = "rigid"

    def __post_init__(self) -> None:
        if not 0.0 <= self.restitution <= 1.0:
            raise ValueError(f"Restitution {self.restitution} is not allowed: it must lie in [0, 1].")

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops(restitution=float(self.restitution))


@dataclass(frozen=True)
class NoContact(Strict):
    """No stops: the linear specimen, whose gap is ignored."""

    kind: Literal["linear"] = "linear"

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops()


@dataclass(frozen=True)
class PowerLaw(Strict):
    """Smooth approximation of stops: F = sum force_i (p / reference)^exponent_i, at every p.

    Forces are given at a reference displacement, because the coefficient of p^47 in SI units is 1e204. The
    force does not depend on the gap (Gong et al. 2025, eq. 3).
    """

    OWN_UNITS: ClassVar = {"reference": "m"}

    reference: float
    """Displacement p at which term i has the force force_i [m]."""
    terms: tuple[tuple[int, float], ...]
    """Pairs (exponent, force [N]) with odd, ascending exponents and positive forces."""
    kind: Literal["power"] = "power"

    def __post_init__(self) -> None:
        require_positive("Reference displacement", self.reference, "m")
        if not self.terms:
            raise ValueError("A power law without terms is not allowed: give one exponent or more.")
        if len(self.terms) > MOST_TERMS:
            raise ValueError(f"A power law of {len(self.terms)} terms: give at most {MOST_TERMS} terms.")
        previous = 0
        for exponent, force in self.terms:
            if exponent % 2 == 0 or not max(previous, 1) < exponent <= HIGHEST_EXPONENT:
                raise ValueError(
                    f"Exponents {[n for n, _ in self.terms]} are not allowed: "
                    f"give odd, ascending numbers from 3 to {HIGHEST_EXPONENT}."
                )
            require_positive(f"Force of p^{exponent} at the reference displacement", force, "N")
            previous = exponent

    @property
    def stops(self) -> Stops:
        """Parameters for the engine: no stops, because the force acts at every p."""
        return Stops()


def fit_power_law(
    exponents: Sequence[int],
    contact_stiffness: float,
    gap_m: float,
    indentation_m: float = PAPER_INDENTATION_M,
    shares: Sequence[float] | None = None,
) -> PowerLaw:
    """Return the power law whose force equals a Hertz contact's at p = gap + indentation, as in the paper.

    Raises ValueError when an argument is not allowed.

    Parameters
    ----------
    exponents
        Odd exponents in any order, such as (5,) or (3, 5, 7).
    contact_stiffness, gap_m, indentation_m
        k_contact of the Hertz contact [N/m^1.5]; gap and indentation at which both forces are equal [m].
    shares
        Share of each power in the force; the shares must add up to 1. The paper does not state the shares; by
        default all are equal.
    """
    parts = [1.0 / len(exponents)] * len(exponents) if shares is None else list(shares)
    if len(parts) != len(exponents) or not math.isclose(sum(parts), 1.0, rel_tol=1e-9):
        raise ValueError(
            f"Shares {parts} of exponents {list(exponents)}: give a share for each exponent, with the sum 1."
        )
    require_positive("Indentation of the fit", indentation_m, "m")
    force = contact_stiffness * indentation_m * math.sqrt(indentation_m)
    terms = sorted((n, part * force) for n, part in zip(exponents, parts, strict=True))
    return PowerLaw(gap_m + indentation_m, tuple(terms))


def _parse_hertz(detail: str, stiffness: float, _gap_m: float) -> Hertz:
    require_nothing(detail)
    return Hertz(stiffness)


def _parse_hunt_crossley(detail: str, stiffness: float, _gap_m: float) -> HuntCrossley:
    return HuntCrossley(stiffness, number_in(detail))


def _parse_linear_gap(detail: str, stiffness: float, _gap_m: float) -> LinearGap:
    return LinearGap(number_in(detail)) if detail else fit_linear_gap(stiffness)


def _parse_rigid_stops(detail: str, _stiffness: float, _gap_m: float) -> RigidStops:
    return RigidStops(number_in(detail))


def _parse_no_contact(detail: str, _stiffness: float, _gap_m: float) -> NoContact:
    require_nothing(detail)
    return NoContact()


def _parse_power_law(detail: str, stiffness: float, gap_m: float) -> PowerLaw:
    """Return the law for ``3+5+7`` (equal shares) or ``3@0.2+7@0.8``; ``:`` and an indentation may follow."""
    powers, _, indentation = detail.partition(":")
    terms = [term.partition("@") for term in powers.split("+")]
    try:
        exponents = [int(exponent) for exponent, _, _ in terms]
    except ValueError:
        raise UnreadableLawError(detail) from None
    is_equal = all(share == "" for _, _, share in terms)
    shares = None if is_equal else [number_in(share) for _, _, share in terms]
    at_m = number_in(indentation) if indentation else PAPER_INDENTATION_M
    return fit_power_law(exponents, stiffness, gap_m, at_m, shares)


ContactLaw = Hertz | NoContact | LinearGap | HuntCrossley | RigidStops | PowerLaw

CONTACT_LAWS: Mapping[str, LawWord[ContactLaw]] = {
    "hertz": LawWord("hertz", "an elastic sphere on a plane, force as d^1.5", "hertz", _parse_hertz),
    "linear": LawWord("linear", "no stops", "linear", _parse_no_contact),
    "linear_gap": LawWord("linear_gap[:N/m]", "stops that are springs", "linear_gap", _parse_linear_gap),
    "hunt_crossley": LawWord(
        "hunt_crossley:s/m",
        "Hertz contact with a loss that grows with the speed",
        "hunt_crossley:2",
        _parse_hunt_crossley,
    ),
    "rigid": LawWord(
        "rigid:0..1", "rigid stops with a coefficient of restitution", "rigid:0.8", _parse_rigid_stops
    ),
    "power": LawWord(
        "power:3+5+7 or power:3@0.2+7@0.8[:M]",
        "instead of stops: odd powers of p, each with its share of the force",
        "power:5",
        _parse_power_law,
    ),
}
"""Contact laws, keyed by the names used on the command line and in files."""


def law_by_name(text: str, contact_stiffness: float, gap_m: float) -> ContactLaw:
    """Return the contact law for a name, for example ``hertz`` or ``rigid:0.8``.

    Raises ValueError when the name is unknown, or its numbers are not allowed.

    Parameters
    ----------
    text
        A name in `CONTACT_LAWS`, followed by a colon and the numbers of the law, if any.
    contact_stiffness, gap_m
        Hertz contact to which laws without explicit numbers are fitted: k_contact [N/m^1.5] and gap [m].
    """
    require_positive("Contact stiffness", contact_stiffness, "N/m^1.5")
    name, _, detail = text.strip().partition(":")
    if name in CONTACT_LAWS:
        try:
            return CONTACT_LAWS[name].made(detail, contact_stiffness, gap_m)
        except UnreadableLawError:
            pass
    *forms, last = (law.form for law in CONTACT_LAWS.values())
    raise ValueError(f"Contact {text!r} is not known: give one of {', '.join(forms)}, {last}.")
