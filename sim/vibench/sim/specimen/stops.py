"""Common parts of the contact laws: parameters for the engine, and names in files. SI units."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, Generic, NamedTuple, TypeVar

from pydantic import ConfigDict

Law_co = TypeVar("Law_co", covariant=True)
HERTZ_EXPONENT = 1.5
"""Exponent of the indentation for a sphere on a plane."""
PAPER_INDENTATION_M = 1e-6
"""Indentation at which the paper (section 2) fits its power laws to the Hertz contact [m]."""


class Strict:
    """Base of dataclasses that refuse unknown keys when pydantic reads the data from a file."""

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid")


class Stops(NamedTuple):
    """Parameters of F = (linear d + contact d^(3/2)) (1 + loss dd/dt) for m1 at indentation d in a stop."""

    linear_stiffness: float = 0.0
    """Stiffness: coefficient of the indentation d [N/m]."""
    contact_stiffness: float = 0.0
    """Hertz stiffness: coefficient of d^(3/2), with the indentation d [N/m^1.5]."""
    loss: float = 0.0
    """Loss factor: coefficient of the indentation rate dd/dt [s/m]."""
    restitution: float | None = None
    """Coefficient of restitution of rigid stops; None for elastic stops or no stops."""

    @property
    def term(self) -> tuple[float, float]:
        """Coefficient and exponent of the term with the highest power of d in the force."""
        if self.contact_stiffness:
            return self.contact_stiffness, HERTZ_EXPONENT
        return self.linear_stiffness, 1.0

    @property
    def spring_beside(self) -> float:
        """Stiffness of the linear term if there is also a Hertz term, else 0 [N/m]."""
        return self.linear_stiffness if self.contact_stiffness else 0.0


@dataclass(frozen=True)
class LawWord(Generic[Law_co]):
    """Entry of `CONTACT_LAWS`: form of a law's name, and the function that parses it."""

    form: str
    """Allowed forms of the law's name, as messages show them."""
    about: str
    """Short description of the law, as lists show it."""
    example: str
    """Example of the law's name, as figures show it."""
    made: Callable[[str, float, float], Law_co]
    """Function that returns the law for the text after the colon; raises `UnreadableLawError`. The other two
    arguments are those of `law_by_name`: stiffness and clearance of the Hertz contact."""


class UnreadableLawError(ValueError):
    """Error: the text after the name of a law does not have the required form."""


def number_in(detail: str) -> float:
    """Return the text after a law's name as one number; raise `UnreadableLawError` for other text."""
    try:
        return float(detail)
    except ValueError:
        raise UnreadableLawError(detail) from None


def require_nothing(detail: str) -> None:
    """Raise `UnreadableLawError` if text follows the name of a law that has no parameters."""
    if detail:
        raise UnreadableLawError(detail)


def require_positive(name: str, value: float, unit: str) -> None:
    """Raise ValueError if a number is not positive and finite."""
    if not 0.0 < value < math.inf:
        raise ValueError(f"{name} {value} {unit} is not allowed: it must be positive and finite.")


Choice = TypeVar("Choice", bound=StrEnum)


def member(kind: type[Choice], word: str) -> Choice:
    """Return the enum member whose value is ``word``; a member is returned unchanged.

    Raises ValueError when the enum has no such word.
    """
    try:
        return kind(word)
    except ValueError:
        raise ValueError(f"{kind.__name__} {word!r} is not allowed: give one of {', '.join(kind)}.") from None
