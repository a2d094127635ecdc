"""Output of commands: consoles for text and errors, JSON on standard output, and exit codes."""

import json
import sys
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from vibench.acquisition import printable, shorten

if TYPE_CHECKING:
    from rich.progress import TextColumn
    from rich.table import Table


class ExitCode(IntEnum):
    """Exit codes of all commands; see docs/installation.md."""

    DONE = 0
    """The command did everything that was requested."""
    FAILED = 1
    """An error, a forbidden value, or a failed part of the result; a text on standard error explains it."""
    MISUSED = 2
    """A command or an option is unknown or missing."""
    STOPPED = 3
    """The user stopped the command before it had finished; ``--resume`` continues its work."""


LONGEST_LINE = 1800
"""Largest number of characters of a printed line; names in files may be longer."""


class PrintableConsole(Console):
    """Console that escapes control and formatting characters, which names may contain."""

    def print(self, *objects: Any, **settings: Any) -> None:
        """Print each string as one line; use `paragraph` for text of several lines."""
        super().print(*map(_printable, objects), **settings)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render tables, progress bars and lines of text, with control characters escaped."""
        for segment in super().render(renderable, options):
            text = "\n".join(map(printable, segment.text.split("\n")))
            yield segment if segment.control else Segment(text, segment.style)


def _printable(each: Any) -> Any:
    return shorten(printable(each), LONGEST_LINE) if isinstance(each, str) else each


# Names and paths may look like markup or emoji codes, so switch both off.
console = PrintableConsole(highlight=False, soft_wrap=True, markup=False, emoji=False)
errors = PrintableConsole(stderr=True, highlight=False, soft_wrap=True, markup=False, emoji=False)


def words(text_format: str) -> "TextColumn":
    """Return a column of progress bars that shows names unchanged, even if they look like markup."""
    from rich.progress import TextColumn

    return TextColumn(text_format, markup=False)


def bold(text: object) -> Text:
    """Return bold text for the console; brackets in this text do not start markup."""
    return Text(printable(str(text)), style="bold")


def paragraph(text: str) -> Text:
    """Return text of several lines for the console."""
    return Text(text)


def print_table(rows: "Table") -> None:
    """Print a table in which text is wrapped between words only, so that numbers are not cut."""
    for column in rows.columns:
        words_of = [word for text in (column.header, *column.cells) for word in str(text).split()]
        column.min_width = max((len(word) for word in words_of), default=0)
    console.print(rows)


def print_warnings(sentences: Iterable[str]) -> None:
    """Print all non-empty warnings on standard error, because standard output is for results."""
    for sentence in filter(None, sentences):
        errors.print(f"warning: {sentence}")


def print_json(document: Mapping[str, object]) -> None:
    """Print a single JSON document on standard output."""
    json.dump(document, sys.stdout, indent=2, allow_nan=False)
    sys.stdout.write("\n")
