"""How a SCPI header finds its command: long and short forms, optional nodes, numeric suffixes, paths."""

import re
from dataclasses import dataclass, field

_NODE = re.compile(r"(?P<short>\*?[A-Z]+)(?P<rest>[a-z]*)(?P<suffix>#?)")


@dataclass(frozen=True)
class HeaderPattern:
    """A header as manuals print it: capitals are the short form, brackets are optional, # is a number.

    ``[SOURce#:]FREQuency[:FIXed]`` matches ``FREQ``, ``source2:frequency:fix`` and so on. A missing
    number means 1 (SCPI-1999, volume 1, 6.2.5.2).
    """

    text: str
    _expression: re.Pattern[str] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_expression", re.compile(_expression(self.text), re.IGNORECASE))

    def match(self, header: str) -> int | None:
        """Return the numeric suffix (1 when absent) if the header is this command, else None."""
        found = self._expression.fullmatch(header)
        if found is None:
            return None
        return int(found.groupdict().get("suffix") or 1)


def _expression(pattern: str) -> str:
    """Translate the manual's notation into a regular expression."""
    expression = pattern.replace("[", "(?:").replace("]", ")?").replace("*", r"\*")
    return _NODE.sub(_node_expression, expression)


def _node_expression(node: re.Match[str]) -> str:
    rest = f"(?:{node['rest']})?" if node["rest"] else ""
    suffix = r"(?P<suffix>\d{1,3})?" if node["suffix"] else ""
    return f"{node['short']}{rest}{suffix}"


@dataclass(frozen=True)
class HeaderPath:
    """Where in the command tree the next header of a message counts from (SCPI-1999, volume 1, 6.2.4)."""

    prefix: str = ""

    def resolve(self, header: str) -> tuple[str, "HeaderPath"]:
        """Return the full header and the path for the unit after it."""
        if header.startswith("*"):
            return header, self
        full = header[1:] if header.startswith(":") else self.prefix + header
        return full, HeaderPath(full[: full.rfind(":") + 1])


def mnemonic_matches(word: str, mnemonic: str) -> bool:
    """Say whether a word is the long or the short form of a mnemonic such as ``SINusoid``, in any case."""
    short = "".join(letter for letter in mnemonic if not letter.islower())
    return word.upper() in (short.upper(), mnemonic.upper())


def short_form(mnemonic: str) -> str:
    """Return the capitals of a mnemonic: what the instrument answers."""
    return "".join(letter for letter in mnemonic if not letter.islower())
