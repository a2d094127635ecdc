"""The grid of a plot: a line for every tick of its axes, painted with the picture."""

import pyqtgraph as pg
from PySide6.QtCore import QLineF
from PySide6.QtGui import QColor, QPainter

from ..widgets import Theme
from ._axis import AxisItem

_ABOVE = 100
"""Over the curves: an area that they fill is read by it."""
_OPACITY = 0.25
"""Of the lines that are labelled; each level after them has a part of it."""
_APART = 20.0
"""Pixels from line to line; lines that are closer are fainter."""


class Grid(pg.UIGraphicsItem):  # type: ignore[misc] # untyped library
    """Lines over the whole picture.

    pyqtgraph lets the axes draw them. These keep a copy of what they paint, which would be as large
    as the picture, twice, and be laid over it in every frame.
    """

    def __init__(self, across: AxisItem, up: AxisItem) -> None:
        super().__init__()
        self._across, self._up = across, up
        self._colour = QColor()
        self.setZValue(_ABOVE)

    def dress(self, theme: Theme) -> None:
        """Draw in other colours."""
        self._colour = QColor(theme.line)
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Draw the lines of the ticks that the axes have painted just before."""
        to_pixels = painter.transform()
        seen = to_pixels.mapRect(self.boundingRect())
        painter.resetTransform()
        for level, places in enumerate(self._across.levels):
            painter.setPen(self._shade(level, seen.width() / (len(places) + 1)))
            columns = (place * to_pixels.m11() + to_pixels.m31() for place in places)
            painter.drawLines([QLineF(at, seen.top(), at, seen.bottom()) for at in columns])
        for level, places in enumerate(self._up.levels):
            painter.setPen(self._shade(level, seen.height() / (len(places) + 1)))
            rows = (place * to_pixels.m22() + to_pixels.m32() for place in places)
            painter.drawLines([QLineF(seen.left(), at, seen.right(), at) for at in rows])

    def _shade(self, level: int, apart: float) -> QColor:
        shade = QColor(self._colour)
        shade.setAlphaF(_OPACITY / (level + 1) * min(1.0, apart / _APART))
        return shade
