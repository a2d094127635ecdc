"""Page layout of every report: overview, one card for each part, and folded details below the cards."""

import base64
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from vibench.acquisition import printable
from vibench.sim.operating_system.this import replace_file

from ..figures.style import DrawnFigure

Rows = tuple[tuple[str, str], ...]
LONGEST_CAPTION = 225
"""Maximum number of characters of title and caption together: three lines of a figure's column."""
MOST_OPEN_CARDS = 12
"""Maximum number of cards shown unfolded, which keeps the page short."""
_LARGEST_SVG_BYTES = 300_000
"""Largest embedded SVG; above this size, a PNG is smaller, faster to show and equally legible."""
_SENTENCE_ENDS = re.compile(r"(?<=\.)(?<!\bal\.)(?<!\bFig\.)\s+(?=[A-Z0-9])")


class Agreement(StrEnum):
    """Whether a simulation, or a claim, agrees with the measurement."""

    YES = "yes"
    NO = "no"
    OPEN = "cannot tell"


@dataclass(frozen=True)
class ReportTable:
    """Table of texts with a note below it."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Fold:
    """Folded part of a page: sentences, tables and figures below a heading."""

    title: str
    sentences: tuple[str, ...] = ()
    tables: tuple[ReportTable, ...] = ()
    figures: tuple[DrawnFigure, ...] = ()


@dataclass(frozen=True)
class Card:
    """Card of one recording or of one group of claims, and its row in the overview table."""

    name: str
    result: str
    """Result of the recording or of the group of claims in one sentence."""
    agreement: Agreement
    look_at: str
    """Warnings to read before the result is used."""
    numbers: Rows = ()
    """Up to three quantities: name, and value with bounds."""
    warnings: tuple[str, ...] = ()
    figure: DrawnFigure | None = None
    folds: tuple[Fold, ...] = ()


@dataclass(frozen=True)
class Page:
    """Content of a report, in the order of its fields."""

    title: str
    about: str
    """Subject of the report, shown next to date and version."""
    warnings: tuple[str, ...]
    """Warnings that change a conclusion."""
    findings: str
    """Summary of at most 120 words."""
    figure: DrawnFigure | None
    noun: str
    """Noun for the rows of the overview table, such as recording or claims."""
    cards: tuple[Card, ...]
    further: Fold
    """Unfolded part: common figures of several recordings, and sentences on the model."""
    folds: tuple[Fold, ...]
    limits: tuple[str, ...]


@dataclass(frozen=True)
class _EmbeddedFigure:
    number: int
    source: str
    """A ``data:`` address that contains the whole image."""
    caption: str
    rest: str
    """Further sentences of the caption, which are folded."""


def write_page(page: Page, path: Path, figures_folder: Path | None = None) -> Path:
    """Write one HTML file with all figures inside; an older file of that name is replaced.

    Parameters
    ----------
    figures_folder
        Folder for PNG, SVG and CSV of each figure; nothing is saved if None.
    """
    figures = list(dict.fromkeys(_figures(page)))
    environment = Environment(
        loader=PackageLoader("vibench.analysis.report", "."),
        autoescape=True,
        # Escape control characters in names and texts; Markup from the template stays unchanged.
        finalize=lambda content: printable(content) if type(content) is str else content,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = environment.get_template("report.html.j2").render(
        page=page,
        embedded={each: _embed(number, each, figures_folder) for number, each in enumerate(figures, 1)},
        is_long=len(page.cards) > MOST_OPEN_CARDS,
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        version=version("vibench"),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    with replace_file(path) as coming:
        coming.write_text(text, encoding="utf-8")
    return path


def _figures(page: Page) -> Iterator[DrawnFigure]:
    """Yield all figures in the order of their numbers: unfolded figures first, then figures in folds."""
    yield from (each for each in (page.figure, *(card.figure for card in page.cards)) if each is not None)
    yield from page.further.figures
    for fold in (*(fold for card in page.cards for fold in card.folds), *page.folds):
        yield from fold.figures


def _embed(number: int, drawn: DrawnFigure, folder: Path | None) -> _EmbeddedFigure:
    if folder is not None:
        drawn.save(folder)
    svg = drawn.svg
    kind, content = ("svg+xml", svg) if len(svg) <= _LARGEST_SVG_BYTES else ("png", drawn.png)
    source = f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
    return _EmbeddedFigure(number, source, *split_caption(drawn))


def split_caption(drawn: DrawnFigure) -> tuple[str, str]:
    """Split a caption into its first sentences, which fill at most three lines, and the rest."""
    sentences = _SENTENCE_ENDS.split(drawn.caption)
    lengths = [len(drawn.title) + len(" ".join(sentences[:end])) for end in range(len(sentences) + 1)]
    fitting = sum(each <= LONGEST_CAPTION for each in lengths) - 1
    return " ".join(sentences[:fitting]), " ".join(sentences[fitting:])
