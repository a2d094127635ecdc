"""One of a few: wherever a member of an enum is asked for, its word is accepted."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from ..errors import ConfigurationError

Choice = TypeVar("Choice", bound=StrEnum)


def chosen(kind: type[Choice], given: Choice | str) -> Choice:
    """Return the member that was given, or whose word was; an unknown word raises ConfigurationError.

    >>> from enum import StrEnum
    >>> Ground = StrEnum("Ground", ["SAND", "CLAY"])
    >>> chosen(Ground, "clay")
    <Ground.CLAY: 'clay'>
    """
    try:
        return kind(given)
    except ValueError as unknown:
        raise ConfigurationError(
            f"{given!r} is no {kind.__name__}; give one of {', '.join(map(repr, map(str, kind)))}"
        ) from unknown


@dataclass(frozen=True)
class ChosenFrom:
    """Mark a text of a model, in its ``Annotated`` type, as one that is mostly chosen from a list."""

    texts: Callable[[], Iterable[str]]
