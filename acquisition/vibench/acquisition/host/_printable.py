"""Printable form of text from a file, a folder or an instrument."""

from unicodedata import category


def printable(text: str) -> str:
    r"""Write what would move a cursor, reorder text or be invisible as an escape: one line comes of it.

    >>> print(printable("a\x1b[2J\nb"))
    a\x1b[2J\nb

    Parameters
    ----------
    text
        From a file, a folder or an instrument.

    """
    if text.isprintable():
        return text
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() or category(each) == "Zs" else each.encode("unicode_escape").decode()
        for each in text
    )
