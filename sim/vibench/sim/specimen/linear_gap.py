"""Linear elastic stops. SI units."""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from .stops import PAPER_INDENTATION_M, LawWord, Reference, Stops, Strict, number_in, require_positive


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
    """Return linear stops with the force of a Hertz contact of k [N/m^1.5] at the given indentation."""
    require_positive("Indentation of the fit", indentation_m, "m")
    return LinearGap(contact_stiffness * math.sqrt(indentation_m))


def _parse(detail: str, reference: Reference) -> LinearGap:
    return LinearGap(number_in(detail)) if detail else fit_linear_gap(reference.stiffness)


LINEAR_GAP = LawWord("linear_gap[:N/m]", "stops that are springs", "linear_gap", _parse)
