"""Two markers that the user drags along the common horizontal axis of several plots."""

from collections.abc import Iterable
from functools import partial

import pyqtgraph as pg
from PySide6.QtCore import QObject, Signal

from .line_style import LineStyle
from .plot import Plot

_MARKER = LineStyle(lambda theme: theme.accent)


class Markers(QObject):
    """Two vertical lines, each at the same value in all plots."""

    moved = Signal()

    def __init__(self, early: float, late: float, parent: QObject) -> None:
        super().__init__(parent)
        self._values = [early, late]
        self._are_shown = False
        self._plots: tuple[Plot, ...] = ()
        self.lines: list[list[pg.InfiniteLine]] = []
        """Vertical lines of each marker, one line per plot."""

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the markers, the smaller first; empty while they are hidden."""
        return tuple(sorted(self._values)) if self._are_shown else ()

    def draw_in(self, plots: Iterable[Plot]) -> None:
        """Draw the markers in these plots, and remove the lines in earlier plots."""
        self._plots = tuple(plots)
        self.lines = [[plot.upright(_MARKER, value) for plot in self._plots] for value in self._values]
        for number, lines in enumerate(self.lines):
            for line in lines:
                line.setMovable(True)
                line.sigDragged.connect(partial(self._drag, number))
        self._place()

    def show(self, are_shown: bool) -> None:  # noqa: FBT001 - as Qt's own toggled(bool)
        """Show or hide the markers; if they are outside the visible range, move them into it."""
        self._are_shown = are_shown
        if are_shown and self._plots:
            scale = self._plots[0].scales[0]
            low, high = self._plots[0].getViewBox().viewRange()[0]
            if not all(low <= scale.position(value) <= high for value in self._values):
                self._values = [scale.value_at(low + (high - low) * share) for share in (1 / 3, 2 / 3)]
        self._place()

    def move(self, number: int, value: float) -> None:
        """Move one marker to a value in all plots."""
        self._values[number] = value
        self._place()

    def _drag(self, number: int, line: pg.InfiniteLine) -> None:
        self.move(number, self._plots[0].scales[0].value_at(line.value()))

    def _place(self) -> None:
        for lines, value in zip(self.lines, self._values, strict=False):
            for plot, line in zip(self._plots, lines, strict=True):
                line.setVisible(self._are_shown)
                line.setValue(plot.scales[0].position(value))
        self.moved.emit()
