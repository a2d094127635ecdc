"""Upright stripes and lines of a plot, however many: each kind is one item, painted by columns of pixels."""

from collections.abc import Callable, Iterable

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, Qt
from PySide6.QtGui import QPainter, QPen

_BEHIND = -10
"""Marks lie below the curves."""
_LEAST_APART = 5
"""Pixels between lines: closer ones would be a grey wall, and are seen when somebody looks closer."""


class _UprightMarks(pg.UIGraphicsItem):  # type: ignore[misc] # untyped library
    """As high as the picture; an item for every mark would cost each of them its part of every frame."""

    def __init__(self, across: Callable[[float], float]) -> None:
        super().__init__()
        self._across = across
        """From a value to its place on the axis, which may be logarithmic."""
        self.setZValue(_BEHIND)

    def _begin(self, painter: QPainter) -> tuple[QRectF, float, float]:
        """Paint in pixels from here on: what is in sight, and how values become columns."""
        to_pixels = painter.transform()
        seen = to_pixels.mapRect(self.boundingRect())
        painter.resetTransform()
        return seen, to_pixels.m11(), to_pixels.m31()


class Stripes(_UprightMarks):
    """Bands across a plot, none thinner than a pixel, so that none is overlooked."""

    def __init__(self, across: Callable[[float], float]) -> None:
        super().__init__(across)
        self._shade: object = Qt.GlobalColor.gray
        self._bands: NDArray[np.float64] = np.empty((0, 2))

    def show_bands(self, bands: Iterable[tuple[float, float]]) -> None:
        """Show these, from low to high each."""
        places = [(self._across(low), self._across(high)) for low, high in bands]
        self._bands = np.array(places, dtype=np.float64).reshape(-1, 2)
        self.update()

    def dress(self, shade: object) -> None:
        """Fill them with a colour."""
        self._shade = shade
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Fill every column of pixels that a band touches, once."""
        seen, scale, shift = self._begin(painter)
        width = max(1, round(seen.width()))
        edges = np.clip(np.floor(self._bands * scale + shift - seen.left()), -1, width).astype(int)
        steps = np.zeros(width + 3, dtype=int)
        np.add.at(steps, edges[:, 0] + 1, 1)
        np.add.at(steps, np.maximum(edges[:, 1], edges[:, 0] + 1) + 1, -1)
        covered = (np.cumsum(steps) > 0)[1 : width + 1]
        turns = np.flatnonzero(np.diff(covered.astype(int), prepend=0, append=0))
        for first, last in turns.reshape(-1, 2).tolist():
            painter.fillRect(
                QRectF(seen.left() + first, seen.top(), last - first, seen.height()), self._shade
            )


class Rules(_UprightMarks):
    """Lines across a plot, in one pen; where they crowd, none is drawn."""

    def __init__(self, across: Callable[[float], float]) -> None:
        super().__init__(across)
        self._pen = QPen()
        self._places: NDArray[np.float64] = np.empty(0)

    def show_at(self, values: Iterable[float]) -> None:
        """Show a line at each of these values."""
        self._places = np.array([self._across(value) for value in values], dtype=np.float64)
        self.update()

    def dress(self, pen: QPen) -> None:
        """Draw them with a pen."""
        self._pen = pen
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Draw those in sight."""
        seen, scale, shift = self._begin(painter)
        columns = np.unique(np.round(self._places * scale + shift))
        columns = columns[(columns >= seen.left()) & (columns <= seen.right())]
        if columns.size * _LEAST_APART > seen.width():
            return
        painter.setPen(self._pen)
        painter.drawLines([QLineF(at, seen.top(), at, seen.bottom()) for at in columns.tolist()])
