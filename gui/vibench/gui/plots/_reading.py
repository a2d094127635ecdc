"""Reading a plot: what stands under the pointer, and how far it is from a place that was marked."""

from collections.abc import Callable
from math import isfinite, log10

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import QLabel, QWidget

from ..widgets import Theme
from ._axis import PlotAxis, Scale

NamedCurves = Callable[[], list[tuple[str, pg.PlotDataItem]]]


class Reading:
    """Two crossed lines at the pointer, and a line of text with the place and the curve that is nearest.

    A place that was marked stays; differences are told from there, and as a ratio in dB where the upright
    axis is logarithmic.
    """

    def __init__(self, host: QWidget, add: Callable[[pg.InfiniteLine], None], curves: NamedCurves) -> None:
        self._curves = curves
        self._lines = [pg.InfiniteLine(angle=angle, movable=False) for angle in (90, 0)]
        self._marks = [pg.InfiniteLine(angle=angle, movable=False) for angle in (90, 0)]
        for line in (*self._lines, *self._marks):
            line.hide()
            add(line)
        self._label = QLabel(host)
        self._label.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._label.setBackgroundRole(QPalette.ColorRole.Base)
        self._label.setAutoFillBackground(True)
        self._label.setContentsMargins(4, 1, 4, 1)
        self._label.hide()
        self._marked: tuple[float, float] | None = None
        self.place: tuple[float, float] | None = None
        """Where the lines cross, in values; None while nothing is read."""

    @property
    def text(self) -> str:
        """What is told; empty while nothing is read."""
        return self._label.text() if self.place is not None else ""

    def dress(self, theme: Theme) -> None:
        """Draw in other colours."""
        for line in self._lines:
            line.setPen(pg.mkPen(theme.muted))
        for line in self._marks:
            line.setPen(pg.mkPen(theme.accent, style=Qt.PenStyle.DashLine))

    def show_at(self, point: QPointF, axes: tuple[PlotAxis, PlotAxis], scales: list[Scale]) -> None:
        """Read at a point of the picture, in the coordinates that are drawn."""
        for line, at in zip(self._lines, (point.x(), point.y()), strict=True):
            line.setValue(at)
            line.show()
        values = [_value(at, scale) for at, scale in zip((point.x(), point.y()), scales, strict=True)]
        self.place = (values[0], values[1])
        said = [_shown(value, axis) for value, axis in zip(self.place, axes, strict=True)]
        nearest = self._nearest(point)
        if nearest is not None:
            name, height = nearest
            said.append(f"{name or 'curve'}: {_shown(height, axes[1])}")
        if self._marked is not None:
            across, up = (now - then for now, then in zip(self.place, self._marked, strict=True))
            said.append(f"Δ {_shown(across, axes[0])}, {_shown(up, axes[1])}")
            if scales[1] is Scale.LOGARITHMIC:
                said.append(f"{20 * log10(self.place[1] / self._marked[1]):+.2f} dB")
        self._label.setText("   ".join(said))
        self._put_label()

    def mark(self, scales: list[Scale]) -> None:
        """Tell differences from this place on; asked again at the same place, no more."""
        self._marked = None if self._marked == self.place else self.place
        for line, value, scale in zip(self._marks, self._marked or (0.0, 0.0), scales, strict=True):
            line.setVisible(self._marked is not None)
            if self._marked is not None:
                line.setValue(log10(value) if scale is Scale.LOGARITHMIC else value)

    def hide(self) -> None:
        """Read no more; what was marked stays."""
        self.place = None
        for line in self._lines:
            line.hide()
        self._label.hide()

    def _put_label(self) -> None:
        host = self._label.parentWidget()
        self._label.adjustSize()
        size = self._label.size()
        if host is not None:
            self._label.move(max(0, host.width() - size.width() - 2), host.height() - size.height() - 2)
        self._label.show()

    def _nearest(self, point: QPointF) -> tuple[str, float] | None:
        """Find the curve that is nearest, upright, at this place across."""
        found: list[tuple[float, str, float]] = []
        for name, item in self._curves():
            drawn_x, drawn_y = item.getData()
            if drawn_x is None or len(drawn_x) == 0 or not drawn_x[0] <= point.x() <= drawn_x[-1]:
                continue
            place = min(int(np.searchsorted(drawn_x, point.x())), len(drawn_x) - 1)
            if place and point.x() - drawn_x[place - 1] < drawn_x[place] - point.x():
                place -= 1
            if isfinite(drawn_y[place]) and item.yData is not None:
                found.append((abs(drawn_y[place] - point.y()), name, float(item.yData[place])))
        return None if not found else min(found)[1:]


def _value(drawn: float, scale: Scale) -> float:
    return float(10.0 ** min(max(drawn, -300.0), 300.0)) if scale is Scale.LOGARITHMIC else drawn


def _shown(value: float, axis: PlotAxis) -> str:
    return f"{value * axis.factor:.5g} {axis.unit or axis.short}".strip()
