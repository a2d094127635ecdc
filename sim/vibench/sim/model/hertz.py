"""An elastic sphere on a plane: the paper's stops. SI units."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import ConfigDict

from .stops import STRICT, LawWord, Reference, Stops, require_nothing, require_positive


@dataclass(frozen=True)
class Hertz:
    """Elastic sphere on a plane: F = stiffness * penetration^(3/2), no loss of its own."""

    OWN_UNITS: ClassVar = {"stiffness": "N m-1.5"}

    __pydantic_config__: ClassVar[ConfigDict] = STRICT

    stiffness: float
    """k_contact [N/m^1.5]."""
    kind: Literal["hertz"] = "hertz"

    def __post_init__(self) -> None:
        require_positive("Contact stiffness", self.stiffness, "N/m^1.5")

    @property
    def stops(self) -> Stops:
        """Numbers of the law for the engine."""
        return Stops(contact_stiffness=float(self.stiffness))


def _made(detail: str, reference: Reference) -> Hertz:
    require_nothing(detail)
    return Hertz(reference.stiffness)


HERTZ = LawWord("hertz", "an elastic sphere on a plane, force as d^1.5", "hertz", _made)
