"""Several plots with a common horizontal axis: a stack of plots, and markers across them."""

from collections.abc import Iterable, Sequence
from functools import partial

import pyqtgraph as pg
from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from ..widgets.boxes import fill_box
from ..widgets.theme import Theme
from .line_style import LineStyle
from .plot import Plot

AXIS_EM = 3
"""Height of the horizontal axis with its label, in font heights."""


class PlotStack(QWidget):
    """Plots of equal height; only the lowest plot labels the common axis."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.plots: Sequence[Plot] = ()
        self._layout = fill_box(QVBoxLayout(self), margin=0)
        self._layout.setSpacing(2)

    def retheme(self, theme: Theme) -> None:
        """Use the colours of another theme for new plots."""
        self._theme = theme

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep all plots of the stack equally high."""
        super().resizeEvent(event)
        self._share_height()

    def _label_last(self) -> None:
        """Label only the axis of the lowest plot, and make all plots equally high."""
        for plot in self.plots:
            is_last = plot is self.plots[-1]
            plot.across.setStyle(showValues=is_last)
            plot.across.showLabel(is_last)
        self._share_height()

    def _share_height(self) -> None:
        axis = AXIS_EM * self.fontMetrics().height()
        height = max(1, (self.height() - axis) // max(1, len(self.plots)))
        for place in range(len(self.plots)):
            self._layout.setStretch(place, height + (axis if place == len(self.plots) - 1 else 0))
        # Apply the layout now, because a later change would repaint everything.
        self._layout.activate()


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
        """Values of the markers, the smaller first; empty while the markers are hidden."""
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
