"""No stops: the linear specimen. SI units."""

from dataclasses import dataclass
from typing import Literal

from .stops import LawWord, Reference, Stops, Strict, require_nothing


@dataclass(frozen=True)
class NoContact(Strict):
    """No stops: the linear specimen, whose gap is ignored."""

    kind: Literal["linear"] = "linear"

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops()


def _parse(detail: str, _reference: Reference) -> NoContact:
    require_nothing(detail)
    return NoContact()


LINEAR = LawWord("linear", "no stops", "linear", _parse)
