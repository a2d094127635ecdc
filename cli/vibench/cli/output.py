"""What commands print: people's text on one console, JSON on standard output alone."""

import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

import typer
from rich.console import Console
from rich.progress import TextColumn
from rich.text import Text

# Neither markup nor emoji: names and paths may hold what looks like some.
console = Console(highlight=False, soft_wrap=True, markup=False, emoji=False)
errors = Console(stderr=True, highlight=False, soft_wrap=True, markup=False, emoji=False)


def words(text_format: str) -> TextColumn:
    """Make a column of progress bars that shows names as they are."""
    return TextColumn(text_format, markup=False)


def bold(text: object) -> Text:
    """Make something stand out on a terminal, whatever brackets it has."""
    return Text(str(text), style="bold")


def print_warnings(sentences: Iterable[str]) -> None:
    """Print what should be looked at on standard error, so that standard output holds only answers."""
    for sentence in sentences:
        typer.echo(f"warning: {sentence}", err=True)


def print_json(document: Mapping[str, object]) -> None:
    """Print one JSON document on standard output, and nothing else."""
    json.dump(document, sys.stdout, indent=2, allow_nan=False)
    sys.stdout.write("\n")


def write_json(document: Mapping[str, object], path: Path) -> None:
    """Write one JSON document for other programs."""
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
