"""Styles of lines, dots and areas, from which the theme determines pens and colours."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import ceil

import numpy as np
import pyqtgraph as pg
from numpy.typing import ArrayLike
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPainter, QPen, QTransform
from PySide6.QtWidgets import QStyleOptionGraphicsItem, QWidget

from ..widgets.theme import Colour, Theme


class Dash(Enum):
    """Dash pattern of a line."""

    SOLID = Qt.PenStyle.SolidLine
    DASHED = Qt.PenStyle.DashLine
    DOTTED = Qt.PenStyle.DotLine
    DASH_DOTTED = Qt.PenStyle.DashDotLine
    DASH_DOT_DOTTED = Qt.PenStyle.DashDotDotLine
    LONG = Qt.PenStyle.CustomDashLine


@dataclass(frozen=True)
class LineStyle:
    """Dash pattern of a line, and the function that returns the line's colour in a theme."""

    colour: Callable[[Theme], Colour]
    dash: Dash = Dash.SOLID
    fill_opacity: float = 0.0
    """Opacity of a filled area, 0 to 1."""


def curve_style(number: int, dash: Dash = Dash.SOLID) -> LineStyle:
    """Return the style of the curve with this number in the plot."""
    return LineStyle(lambda theme: theme.traces[number % len(theme.traces)], dash)


PREDICTED = LineStyle(lambda theme: theme.predicted, Dash.DASHED)
LIMIT = LineStyle(lambda theme: "#b3261e" if theme.name == "light" else "#ff8a80", Dash.DASHED)
GUIDE = LineStyle(lambda theme: theme.line, Dash.DOTTED)
SIGNS = {
    Dash.SOLID: "━━━",
    Dash.DASHED: "╍╍╍",
    Dash.DOTTED: "┉┉┉",
    Dash.DASH_DOTTED: "━╸╺",
    Dash.DASH_DOT_DOTTED: "━╺╺",
    Dash.LONG: "━━ ━━",
}
_LONG = [9.0, 4.0]
"""Alternating lengths of dashes and gaps of `Dash.LONG`, in line widths."""


def dashed_pen(colour: Colour, width: float, dash: Dash) -> QPen:
    """Return a pen with colour, width and dash pattern."""
    pen: QPen = pg.mkPen(colour, width=width, style=dash.value)
    if dash is Dash.LONG:
        pen.setDashPattern(_LONG)
    return pen


def straight_pen(line_style: LineStyle, theme: Theme, ratio: float) -> QPen:
    """Return the pen of a straight line, ``ratio`` screen pixels (one logical pixel) wide."""
    return dashed_pen(line_style.colour(theme), ratio, line_style.dash)


def curve_pen(line_style: LineStyle, theme: Theme, ratio: float) -> QPen:
    """Return the pen of a curve, one screen pixel wide; `LogicalLine` draws it wider if necessary.

    Dashes have the same length on all screens, whatever their resolution.
    """
    pen = dashed_pen(line_style.colour(theme), 1, line_style.dash)
    if line_style.dash is not Dash.SOLID and ratio > 1.0:
        pen.setDashPattern([ratio * part for part in pen.dashPattern()])
    return pen


def shade_of(line_style: LineStyle, theme: Theme) -> QColor:
    """Return the colour of a filled area."""
    colour: QColor = pg.mkColor(line_style.colour(theme))
    colour.setAlphaF(line_style.fill_opacity or 0.25)
    return colour


class _LogicalCurve(pg.PlotCurveItem):  # type: ignore[misc] # untyped library
    """Curve that draws a thick line as several thin lines, each shifted by one more screen pixel.

    A pen of two pixels looks the same but takes three times as long, because Qt draws it as an area.
    """

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None) -> None:
        """Draw the line, then again to the right and below for each further screen pixel of its width."""
        super().paint(painter, option, widget)
        ratio = painter.device().devicePixelRatioF()
        place = painter.transform()
        for step in range(1, ceil(ratio)):
            for right, down in ((step, 0), (0, step)):
                painter.setTransform(place * QTransform.fromTranslate(right / ratio, down / ratio))
                super().paint(painter, option, widget)
        painter.setTransform(place)


class LogicalLine(pg.PlotDataItem):  # type: ignore[misc] # untyped library
    """Curve of pyqtgraph with a faster way to draw thick lines."""

    def __init__(self) -> None:
        super().__init__()
        self.curve.setParentItem(None)
        self.curve: pg.PlotCurveItem = _LogicalCurve()
        self.curve.setParentItem(self)


_INSIDE = "enclosed"


class Band:
    """Filled area between a lower and an upper bound."""

    def __init__(self, of: str) -> None:
        self.of = of
        """Name of the curve whose bounds the area shows."""
        self._edges = np.empty((3, 0))
        self.item = pg.PlotDataItem(pen=None, fillLevel=_INSIDE)

    def set_data(self, across: ArrayLike, low: ArrayLike, high: ArrayLike) -> None:
        """Set the bounds; non-finite bounds leave a gap."""
        x, below, above = (np.asarray(values, dtype=np.float64) for values in (across, low, high))
        self._edges = np.stack((x, below, above))
        drawn = np.isfinite(below) & np.isfinite(above)
        there, back = np.flatnonzero(drawn), np.flatnonzero(drawn)[::-1]
        self.item.setData(np.concatenate((x[there], x[back])), np.concatenate((below[there], above[back])))

    def at(self, across: float) -> tuple[float, float] | None:
        """Return the bounds at the horizontal coordinate nearest to ``across``; None if not finite."""
        x, below, above = self._edges
        if x.size == 0:
            return None
        place = int(np.argmin(np.abs(x - across)))
        return (float(below[place]), float(above[place])) if np.isfinite(below[place]) else None

    def paint(self, shade: object) -> None:
        """Set the colour of the filled area."""
        self.item.setFillBrush(shade)
