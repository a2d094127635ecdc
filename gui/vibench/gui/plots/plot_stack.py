"""Plots one above the other with a common horizontal axis."""

from collections.abc import Sequence

from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from ..widgets.boxes import fill_box
from ..widgets.theme import Theme
from .plot import Plot

AXIS_EM = 3
"""Height of the horizontal axis with its label, in font heights."""


class PlotStack(QWidget):
    """Plots of equal height; only the lowest one labels the common axis."""

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
        # Apply the layout now; a later change would repaint everything.
        self._layout.activate()
