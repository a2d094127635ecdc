"""What commands print: people's text on one console, JSON on standard output alone."""

import json
import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from vibench.acquisition import printable

if TYPE_CHECKING:
    from rich.progress import TextColumn
    from rich.table import Table


class PrintableConsole(Console):
    """Shows control and formatting characters, which any name may hold, as escapes."""

    def print(self, *objects: Any, **settings: Any) -> None:
        """Print each string as one line; a text of several lines is a `paragraph`."""
        super().print(*(printable(each) if isinstance(each, str) else each for each in objects), **settings)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render tables, bars and lines alike."""
        for segment in super().render(renderable, options):
            text = "\n".join(map(printable, segment.text.split("\n")))
            yield segment if segment.control else Segment(text, segment.style)


# Neither markup nor emoji: names and paths may hold what looks like some.
console = PrintableConsole(highlight=False, soft_wrap=True, markup=False, emoji=False)
errors = PrintableConsole(stderr=True, highlight=False, soft_wrap=True, markup=False, emoji=False)


def words(text_format: str) -> "TextColumn":
    """Make a column of progress bars that shows names as they are."""
    from rich.progress import TextColumn

    return TextColumn(text_format, markup=False)


def bold(text: object) -> Text:
    """Make something stand out on a terminal, whatever brackets it has."""
    return Text(printable(str(text)), style="bold")


def paragraph(text: str) -> Text:
    """Return a text of several lines to a console."""
    return Text(text)


def print_table(rows: "Table") -> None:
    """Print a table that no terminal and no file is too narrow for: words wrap, a number is never cut."""
    for column in rows.columns:
        words_of = [word for text in (column.header, *column.cells) for word in str(text).split()]
        column.min_width = max((len(word) for word in words_of), default=0)
    console.print(rows)


def print_warnings(sentences: Iterable[str]) -> None:
    """Print what should be looked at on standard error, so that standard output holds only answers."""
    for sentence in sentences:
        errors.print(f"warning: {sentence}")


def leave_output_to_json() -> None:
    """Write text for people to standard error, so that standard output holds one JSON document."""
    console.file = sys.stderr


def print_json(document: Mapping[str, object]) -> None:
    """Print one JSON document on standard output, and nothing else."""
    json.dump(document, sys.stdout, indent=2, allow_nan=False)
    sys.stdout.write("\n")
