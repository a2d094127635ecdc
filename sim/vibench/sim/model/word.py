"""A word where an enum is meant: ``accuracy="standard"`` as well as `Accuracy.STANDARD`."""

from enum import StrEnum
from typing import TypeVar

Choice = TypeVar("Choice", bound=StrEnum)


def chosen(kind: type[Choice], word: str) -> Choice:
    """Take the member of an enum that a user names, by itself or by its word.

    Raises ValueError when the enum has no such word.
    """
    try:
        return kind(word)
    except ValueError:
        msg = f"{kind.__name__} {word!r} is not allowed: give one of {', '.join(kind)}."
        raise ValueError(msg) from None
