"""Common parts of the contact laws: numbers for the engine, and names in files. SI units."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, Generic, NamedTuple, TypeVar

from pydantic import ConfigDict

Law_co = TypeVar("Law_co", covariant=True)
HERTZ_EXPONENT = 1.5
"""Exponent of the indentation, for a sphere on a plane."""
PAPER_INDENTATION_M = 1e-6
"""The paper fits its continuous models where the contact is pressed in by 1 um (its section 2)."""


class Strict:
    """Base of dataclasses that refuse unknown keys when pydantic reads them from a file."""

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid")


class Stops(NamedTuple):
    """Numbers of F = (linear d + contact d^(3/2)) (1 + loss dd/dt) at the indentation d."""

    linear_stiffness: float = 0.0
    """[N/m]."""
    contact_stiffness: float = 0.0
    """[N/m^1.5]."""
    loss: float = 0.0
    """[s/m]."""
    restitution: float | None = None
    """Restitution of rigid stops; None for elastic stops or no stops."""

    @property
    def term(self) -> tuple[float, float]:
        """Stiffness and exponent of the term with the highest power of a compliant law."""
        if self.contact_stiffness:
            return self.contact_stiffness, HERTZ_EXPONENT
        return self.linear_stiffness, 1.0

    @property
    def spring_beside(self) -> float:
        """Stiffness of the linear term if there is also a Hertz term, else 0 [N/m]."""
        return self.linear_stiffness if self.contact_stiffness else 0.0


@dataclass(frozen=True)
class Reference:
    """Hertz contact and clearance that fitted laws approximate."""

    stiffness: float
    """k_contact [N/m^1.5]."""
    gap_m: float

    def __post_init__(self) -> None:
        require_positive("Contact stiffness", self.stiffness, "N/m^1.5")


@dataclass(frozen=True)
class LawWord(Generic[Law_co]):
    """Entry of `CONTACT_LAWS`: form of a law's name, and a function that parses it."""

    form: str
    """Allowed forms, for messages."""
    about: str
    """Short description, for lists."""
    example: str
    """Example of the form, for pictures."""
    made: Callable[[str, Reference], Law_co]
    """Create the law from the text after the colon; raises `UnreadableLawError` for an unreadable number."""


class UnreadableLawError(ValueError):
    """The text after a law's name does not have the law's form."""


def number_in(detail: str) -> float:
    """Read the one number of a law."""
    try:
        return float(detail)
    except ValueError:
        raise UnreadableLawError(detail) from None


def require_nothing(detail: str) -> None:
    """Refuse text after the name of a law without parameters."""
    if detail:
        raise UnreadableLawError(detail)


def require_positive(name: str, value: float, unit: str) -> None:
    """Refuse numbers that are not positive and finite."""
    if not 0.0 < value < math.inf:
        raise ValueError(f"{name} {value} {unit} is not allowed: it must be positive and finite.")


Choice = TypeVar("Choice", bound=StrEnum)


def chosen(kind: type[Choice], word: str) -> Choice:
    """Return an enum's member from the member itself or from its name in text.

    Raises ValueError when the enum has no such word.
    """
    try:
        return kind(word)
    except ValueError:
        raise ValueError(f"{kind.__name__} {word!r} is not allowed: give one of {', '.join(kind)}.") from None
