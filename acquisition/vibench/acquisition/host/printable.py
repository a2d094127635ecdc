"""Printable form of text from a file, a folder or an instrument."""

from unicodedata import category

LONGEST_CLAUSE = 400
"""Largest number of letters of a value in an error; without it, the error could be as long as a file."""


def printable(text: str) -> str:
    r"""Escape characters that move the cursor, reorder text or are invisible; the result is one line.

    >>> print(printable("a\x1b[2J\nb"))
    a\x1b[2J\nb

    Parameters
    ----------
    text
        From a file, a folder or an instrument.
    """
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() or category(each) == "Zs" else each.encode("unicode_escape").decode()
        for each in text
    )


def shortened(text: str, longest: int = LONGEST_CLAUSE) -> str:
    """Replace the middle of a long text by three dots.

    >>> shortened("0123456789", 7)
    '01...89'

    ``text`` has any length; ``longest`` is the most letters of the result, the dots included.
    """
    if len(text) <= longest:
        return text
    kept = (longest - 3) // 2
    return f"{text[:kept]}...{text[len(text) - kept :]}"
