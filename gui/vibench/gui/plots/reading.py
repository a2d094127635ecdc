"""Cursor reading of a plot: values at the pointer, and differences from a mark."""

from math import isfinite, log10
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QGuiApplication, QPalette
from PySide6.QtWidgets import QLabel

from vibench.acquisition import printable

from ..widgets.theme import Theme
from ..widgets.units import UNITS
from .axis import PlotAxis, Scale

if TYPE_CHECKING:
    from .plot import Plot


class Reading:
    """Crosshair at the pointer, with a text that states the pointer's values and the nearest curve.

    If a mark is set, the text also states the differences from it; on a logarithmic vertical axis, in dB.
    """

    def __init__(self, plot: "Plot") -> None:
        self._plot = plot
        self._lines: tuple[pg.InfiniteLine, ...] = ()
        """Two lines of the crosshair, then two lines of the mark; all are created when first needed."""
        self._label: QLabel | None = None
        self._at = QPointF()
        self._marked: tuple[float, float] | None = None
        self.place: tuple[float, float] | None = None
        """Values (x, y) at the crosshair; None while the crosshair is hidden."""

    @property
    def text(self) -> str:
        """The reading as text; empty while the crosshair is hidden."""
        return self._label.text() if self._label is not None and self.place is not None else ""

    def dress(self, theme: Theme) -> None:
        """Change the colours."""
        for line in self._lines[:2]:
            line.setPen(pg.mkPen(theme.muted))
        for line in self._lines[2:]:
            line.setPen(pg.mkPen(theme.accent, style=Qt.PenStyle.DashLine))

    def follow(self, place: QPointF) -> None:
        """Show the reading at the pointer's scene position; hide it outside the axes or during dragging."""
        box = self._plot.getViewBox()
        is_pressed = QGuiApplication.mouseButtons() != Qt.MouseButton.NoButton
        if box.sceneBoundingRect().contains(place) and not is_pressed:
            self.show_at(box.mapSceneToView(place))
        else:
            self.hide()

    def show_at(self, point: QPointF) -> None:
        """Show the reading at a point, given in axis coordinates (logarithms on a logarithmic axis)."""
        self._at = point
        drawn, scales = (point.x(), point.y()), self._plot.scales
        for line, at in zip(self._create_lines()[:2], drawn, strict=True):
            line.setValue(at)
            line.show()
        across, up = (scale.value_at(at) for at, scale in zip(drawn, scales, strict=True))
        self.place = across, up
        axes = self._plot.across.axis, self._plot.up.axis
        parts = [_value_text(value, axis) for value, axis in zip(self.place, axes, strict=True)]
        nearest = self._nearest(point)
        if nearest is not None:
            name, height = nearest
            parts.append(f"{UNITS.convert(name) or 'curve'}: {_value_text(height, axes[1])}")
            bounds = next((each.at(across) for each in self._plot.bands if name and each.of == name), None)
            if bounds is not None:
                parts.append(f"bounds {_value_text(bounds[0], axes[1])} to {_value_text(bounds[1], axes[1])}")
        if more := self._plot.read_more(*drawn):
            parts.append(more)
        if self._marked is not None:
            changes = [now - then for now, then in zip(self.place, self._marked, strict=True)]
            parts.append("Δ " + ", ".join(map(_value_text, changes, axes)))
            if scales[1] is Scale.LOGARITHMIC and self._marked[1] > 0.0:
                parts.append(f"{20 * log10(up / self._marked[1]):+.2f} dB")
        self._show_text("   ".join(parts))

    def reread(self) -> None:
        """Update the reading after the curves have changed."""
        if self.place is not None:
            self.show_at(self._at)

    def on_or_off(self) -> None:
        """Show the crosshair at the centre of the plot, or hide it."""
        if self.place is not None:
            self.hide()
        else:
            self.show_at(self._plot.getViewBox().viewRect().center())

    def mark_or_unmark(self) -> None:
        """Set the mark at the crosshair; a second call at the same place removes the mark."""
        if self.place is None:
            self.on_or_off()
        self._marked = None if self._marked == self.place else self.place
        self._place_marks()

    def rescale(self) -> None:
        """Redraw the mark at its values after the axis has changed between linear and logarithmic."""
        self.hide()
        self._place_marks()

    def hide(self) -> None:
        """Hide the crosshair; the mark stays visible."""
        if self._label is not None:
            self.place = None
            self._label.hide()
            for line in self._lines[:2]:
                line.hide()

    def forget(self) -> None:
        """Hide the reading, and drop the crosshair lines that the plot has deleted."""
        self.hide()
        self._lines, self._marked = (), None

    def _place_marks(self) -> None:
        for line, value, scale in zip(
            self._lines[2:], self._marked or (1.0, 1.0), self._plot.scales, strict=False
        ):
            is_drawn = self._marked is not None and (value > 0.0 or scale is Scale.LINEAR)
            line.setVisible(is_drawn)
            if is_drawn:
                line.setValue(scale.position(value))

    def _create_lines(self) -> tuple[pg.InfiniteLine, ...]:
        if not self._lines:
            self._lines = tuple(pg.InfiniteLine(angle=angle, movable=False) for angle in (90, 0, 90, 0))
            for line in self._lines:
                line.hide()
                self._plot.addItem(line, ignoreBounds=True)
            self.dress(self._plot.theme)
        return self._lines

    def _show_text(self, text: str) -> None:
        if self._label is None:
            self._label = QLabel(self._plot)
            self._label.setTextFormat(Qt.TextFormat.PlainText)
            self._label.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            self._label.setBackgroundRole(QPalette.ColorRole.Base)
            self._label.setAutoFillBackground(True)
            self._label.setContentsMargins(4, 1, 4, 1)
        self._label.setText(printable(text))
        self._label.adjustSize()
        size, room = self._label.size(), self._plot.size()
        self._label.move(max(0, room.width() - size.width() - 2), room.height() - size.height() - 2)
        self._label.show()

    def _nearest(self, point: QPointF) -> tuple[str, float] | None:
        """Return name and value of the curve that is vertically nearest; None without curves."""
        found: list[tuple[float, str, float]] = []
        for name, item in self._plot.named_curves:
            drawn_x, drawn_y = item.getData()
            if drawn_x is None or len(drawn_x) == 0 or not drawn_x[0] <= point.x() <= drawn_x[-1]:
                continue
            place = min(int(np.searchsorted(drawn_x, point.x())), len(drawn_x) - 1)
            if place and point.x() - drawn_x[place - 1] < drawn_x[place] - point.x():
                place -= 1
            if isfinite(drawn_y[place]) and item.yData is not None:
                found.append((abs(drawn_y[place] - point.y()), name, float(item.yData[place])))
        return None if not found else min(found)[1:]


def _value_text(value: float, axis: PlotAxis) -> str:
    shown = axis.display
    return f"{value * shown.per_si:.5g} {shown.name or axis.short}".strip()
