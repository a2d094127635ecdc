"""Functions that make text from a file, a folder or an instrument printable and short."""

from collections.abc import Sequence
from unicodedata import category

LONGEST_CLAUSE = 400
"""Largest number of characters of a value quoted in an error; a quoted file could be very long."""


def printable(text: str) -> str:
    r"""Return ``text`` in one line, with escapes for characters that move the cursor or are not visible.

    >>> print(printable("a\x1b[2J\nb"))
    a\x1b[2J\nb
    """
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() or category(each) == "Zs" else each.encode("unicode_escape").decode()
        for each in text
    )


def shorten(text: str, longest: int = LONGEST_CLAUSE) -> str:
    """Return the text, with three dots in place of its middle if the text is long.

    >>> shorten("0123456789", 7)
    '01...89'

    ``text`` has any length; ``longest`` is the largest number of characters of the result, with dots.
    """
    if len(text) <= longest:
        return text
    kept = (longest - 3) // 2
    return f"{text[:kept]}...{text[len(text) - kept :]}"


def leading(texts: Sequence[str], most: int = 3) -> list[str]:
    """Return the first ``most`` texts, followed by ``and N more`` if there are more."""
    return [*texts[:most], *[f"and {len(texts) - most} more"] * (len(texts) > most)]
