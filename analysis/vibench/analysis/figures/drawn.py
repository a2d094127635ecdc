"""A figure with what belongs to it: a name, a caption that says what is seen, and the plotted numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from ..tables import Table, write_tables
from .image_kind import ImageKind
from .style import PNG_DPI, styled

_NO_DATE = {"Date": None}
_NO_PDF_DATE = {"CreationDate": None}
"""Two figures of the same data are the same file."""


SCREEN = (ImageKind.PNG, ImageKind.SVG)


@dataclass(frozen=True, eq=False)
class DrawnFigure:
    """One figure, ready to be saved or put in a report."""

    name: str
    """Becomes the files' name."""
    title: str
    caption: str
    figure: Figure
    tables: tuple[Table, ...]

    @cached_property
    def png(self) -> bytes:
        """The figure as PNG, drawn once."""
        return self._drawn("png")

    @cached_property
    def svg(self) -> bytes:
        """The figure as SVG, drawn once."""
        return self._drawn("svg")

    @cached_property
    def pdf(self) -> bytes:
        """The figure as PDF, drawn once."""
        return self._drawn("pdf")

    def _drawn(self, kind: str) -> bytes:
        target = BytesIO()
        metadata = {"svg": _NO_DATE, "pdf": _NO_PDF_DATE}.get(kind)
        with styled():
            self.figure.savefig(target, format=kind, dpi=PNG_DPI, metadata=metadata)
        # The layout is found while drawing and costs as much: the next format takes it over.
        self.figure.set_layout_engine("none")
        return target.getvalue()

    def save(self, folder: Path, kinds: Sequence[ImageKind] = SCREEN) -> tuple[Path, ...]:
        """Write the images asked for and the numbers as CSV; an older figure of that name is replaced."""
        folder.mkdir(parents=True, exist_ok=True)
        drawn = []
        for kind in kinds:
            path = folder / f"{self.name}.{kind.value}"
            match kind:
                case ImageKind.PNG:
                    path.write_bytes(self.png)
                case ImageKind.SVG:
                    path.write_bytes(self.svg)
                case ImageKind.PDF:
                    path.write_bytes(self.pdf)
            drawn.append(path)
        return (*drawn, *write_tables(self.tables, folder))
