"""Power-law forces that act at every p and approximate stops by a smooth function. SI units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from .stops import (
    HERTZ_EXPONENT,
    PAPER_INDENTATION_M,
    LawWord,
    Reference,
    Stops,
    Strict,
    UnreadableLawError,
    number_in,
    require_positive,
)

MOST_TERMS = 6
HIGHEST_EXPONENT = 1001
"""Largest exponent; a 0.1 % change of p then changes the force by a factor of e, like a rigid wall."""


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
            require_positive(f"Force of p^{exponent} at the reference", force, "N")
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
    """Return the power law with the force of a Hertz contact at p = gap + indentation, as in the paper.

    Raises ValueError when an argument is not allowed.

    Parameters
    ----------
    exponents
        Odd exponents in any order, such as (5,) or (3, 5, 7).
    contact_stiffness, gap_m, indentation_m
        k_contact of the Hertz contact [N/m^1.5]; gap and indentation, where both forces are equal [m].
    shares
        Share of each power in the force; the sum must be 1. The paper does not state the shares; the default
        is equal shares.
    """
    parts = [1.0 / len(exponents)] * len(exponents) if shares is None else list(shares)
    if len(parts) != len(exponents) or not math.isclose(sum(parts), 1.0, rel_tol=1e-9):
        raise ValueError(
            f"Shares {parts} of exponents {list(exponents)}: give one for each exponent, adding up to 1."
        )
    require_positive("Indentation of the fit", indentation_m, "m")
    force = contact_stiffness * indentation_m**HERTZ_EXPONENT
    terms = sorted((n, part * force) for n, part in zip(exponents, parts, strict=True))
    return PowerLaw(gap_m + indentation_m, tuple(terms))


def _parse(detail: str, reference: Reference) -> PowerLaw:
    """Return the law for ``3+5+7`` (equal shares) or ``3@0.2+7@0.8``; an indentation may follow a colon."""
    powers, _, indentation = detail.partition(":")
    terms = [term.partition("@") for term in powers.split("+")]
    try:
        exponents = [int(exponent) for exponent, _, _ in terms]
    except ValueError:
        raise UnreadableLawError(detail) from None
    is_equal = all(share == "" for _, _, share in terms)
    shares = None if is_equal else [number_in(share) for _, _, share in terms]
    at_m = number_in(indentation) if indentation else PAPER_INDENTATION_M
    return fit_power_law(exponents, reference.stiffness, reference.gap_m, at_m, shares)


POWER = LawWord(
    "power:3+5+7 or power:3@0.2+7@0.8[:M]", "odd powers of p instead of stops, with shares", "power:5", _parse
)
