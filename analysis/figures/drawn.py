"""A figure with what belongs to it: a name, a caption that says what is seen, and the plotted numbers."""

from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from ..tables import Table, write_tables
from .style import PNG_DPI, styled

_NO_DATE = {"Date": None}
"""Two figures of the same data are the same file."""


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

    def _drawn(self, kind: str) -> bytes:
        target = BytesIO()
        metadata = _NO_DATE if kind == "svg" else None
        with styled():
            self.figure.savefig(target, format=kind, dpi=PNG_DPI, metadata=metadata)
        # The layout is found while drawing and costs as much: the next format takes it over.
        self.figure.set_layout_engine("none")
        return target.getvalue()

    def save(self, folder: Path) -> tuple[Path, ...]:
        """Write PNG, SVG and the plotted numbers as CSV; an older figure of that name is replaced."""
        folder.mkdir(parents=True, exist_ok=True)
        png, svg = folder / f"{self.name}.png", folder / f"{self.name}.svg"
        png.write_bytes(self.png)
        svg.write_bytes(self.svg)
        return (png, svg, *write_tables(self.tables, folder))
