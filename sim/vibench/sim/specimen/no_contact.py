"""No stops: the linear specimen. SI units."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import ConfigDict

from .stops import STRICT, LawWord, Reference, Stops, require_nothing


@dataclass(frozen=True)
class NoContact:
    """No stops: the linear specimen. Its gap is ignored."""

    __pydantic_config__: ClassVar[ConfigDict] = STRICT

    kind: Literal["linear"] = "linear"

    @property
    def stops(self) -> Stops:
        """Numbers of the law for the engine."""
        return Stops()


def _parse(detail: str, _reference: Reference) -> NoContact:
    require_nothing(detail)
    return NoContact()


LINEAR = LawWord("linear", "no stops", "linear", _parse)
