"""Vertical stripes and lines of a plot; one graphics item draws all marks of one kind."""

from collections.abc import Callable, Iterable

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QPainter, QPen

_BEHIND = -10
"""Drawing order below the curves."""
_LEAST_APART = 5
"""Smallest distance between drawn lines [pixels]; closer lines would look like a grey area."""


class _UprightMarks(pg.UIGraphicsItem):  # type: ignore[misc] # untyped library
    """Base class of items that draw many marks; one item per mark would slow down every frame."""

    def __init__(self, across: Callable[[float], float]) -> None:
        super().__init__()
        self._across = across
        """Function from a value to its coordinate on the axis, which may be logarithmic."""
        self.setZValue(_BEHIND)

    def _begin(self, painter: QPainter) -> tuple[QRectF, float, float]:
        """Let the painter draw in pixels; return the visible rectangle, scale and shift to columns."""
        to_pixels = painter.transform()
        visible = to_pixels.mapRect(self.boundingRect())
        painter.resetTransform()
        return visible, to_pixels.m11(), to_pixels.m31()


class Stripes(_UprightMarks):
    """Vertical stripes, each at least one pixel wide, so that all are visible."""

    def __init__(self, across: Callable[[float], float]) -> None:
        super().__init__(across)
        self._shade: object = Qt.GlobalColor.gray
        self._bands: NDArray[np.float64] = np.empty((0, 2))

    def show_bands(self, bands: Iterable[tuple[float, float]]) -> None:
        """Show stripes, each given by its lower and upper end."""
        places = [(self._across(low), self._across(high)) for low, high in bands]
        self._bands = np.array(places, dtype=np.float64).reshape(-1, 2)
        self.update()

    def dress(self, shade: object) -> None:
        """Set the colour of the stripes."""
        self._shade = shade
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Fill every pixel column that has a stripe exactly once, so that overlaps are not darker."""
        visible, scale, shift = self._begin(painter)
        width = max(1, round(visible.width()))
        edges = np.clip(np.floor(self._bands * scale + shift - visible.left()), -1, width).astype(int)
        steps = np.zeros(width + 3, dtype=int)
        np.add.at(steps, edges[:, 0] + 1, 1)
        np.add.at(steps, np.maximum(edges[:, 1], edges[:, 0] + 1) + 1, -1)
        covered = (np.cumsum(steps) > 0)[1 : width + 1]
        turns = np.flatnonzero(np.diff(covered.astype(int), prepend=0, append=0))
        for first, last in turns.reshape(-1, 2).tolist():
            painter.fillRect(
                QRectF(visible.left() + first, visible.top(), last - first, visible.height()), self._shade
            )


class Rules(_UprightMarks):
    """Vertical lines of a plot; if the lines are too close together, none is drawn."""

    def __init__(self, across: Callable[[float], float]) -> None:
        super().__init__(across)
        self._pen = QPen()
        self._places: NDArray[np.float64] = np.empty(0)

    def show_at(self, values: Iterable[float]) -> None:
        """Show a vertical line at each value."""
        self._places = np.array([self._across(value) for value in values], dtype=np.float64)
        self.update()

    def dress(self, pen: QPen) -> None:
        """Set the pen of the lines."""
        self._pen = pen
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Draw the visible lines."""
        visible, scale, shift = self._begin(painter)
        columns = np.unique(np.round(self._places * scale + shift))
        columns = columns[(columns >= visible.left()) & (columns <= visible.right())]
        if columns.size * _LEAST_APART > visible.width():
            return
        painter.setPen(self._pen)
        painter.drawLines([QLineF(at, visible.top(), at, visible.bottom()) for at in columns.tolist()])
