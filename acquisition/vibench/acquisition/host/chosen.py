"""Conversion of a value to its enum member, so that functions accept either."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from ..errors import ConfigurationError

Choice = TypeVar("Choice", bound=StrEnum)


def member(kind: type[Choice], given: Choice | str) -> Choice:
    """Return the given member, or the member with the given value; raises ConfigurationError if none exists.

    >>> from enum import StrEnum
    >>> Ground = StrEnum("Ground", ["SAND", "CLAY"])
    >>> member(Ground, "clay")
    <Ground.CLAY: 'clay'>
    """
    try:
        return kind(given)
    except ValueError as unknown:
        raise ConfigurationError(
            f"{given!r} is not a value of {kind.__name__}; give one of {', '.join(map(repr, map(str, kind)))}"
        ) from unknown


@dataclass(frozen=True)
class ChosenFrom:
    """Marker in the ``Annotated`` type of a text field whose value is usually chosen from a list."""

    texts: Callable[[], Iterable[str]]
