"""What lines, dots and areas of a plot are drawn with: told anew at every change of theme."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPen

from ..widgets.theme import Colour, Theme


class Dash(Enum):
    """How a line is drawn."""

    SOLID = Qt.PenStyle.SolidLine
    DASHED = Qt.PenStyle.DashLine
    DOTTED = Qt.PenStyle.DotLine
    DASH_DOTTED = Qt.PenStyle.DashDotLine
    DASH_DOT_DOTTED = Qt.PenStyle.DashDotDotLine
    LONG = Qt.PenStyle.CustomDashLine


@dataclass(frozen=True)
class LineStyle:
    """Which colour of a theme, and which dash: told anew at every change of theme."""

    colour: Callable[[Theme], Colour]
    dash: Dash = Dash.SOLID
    filled: float = 0.0
    """Opacity of an area, 0 to 1."""


def curve_style(number: int, dash: Dash = Dash.SOLID) -> LineStyle:
    """Style of the curve with this number."""
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
"""Dashes and gaps of `Dash.LONG`, in widths of the line."""


def dashed_pen(colour: Colour, width: float, dash: Dash) -> QPen:
    """Give a pen of a colour and a width, with these dashes."""
    pen: QPen = pg.mkPen(colour, width=width, style=dash.value)
    if dash is Dash.LONG:
        pen.setDashPattern(_LONG)
    return pen


def straight_pen(line_style: LineStyle, theme: Theme, ratio: float) -> QPen:
    """Give the pen of a straight line, as wide as a pixel of the layout: so many of the screen."""
    return dashed_pen(line_style.colour(theme), ratio, line_style.dash)


def curve_pen(line_style: LineStyle, theme: Theme, ratio: float) -> QPen:
    """Give the pen of a curve, one pixel of the screen wide; `LogicalLine` draws it wider.

    Its dashes are as long on a fine screen as on a coarse one.
    """
    pen = dashed_pen(line_style.colour(theme), 1, line_style.dash)
    if line_style.dash is not Dash.SOLID and ratio > 1.0:
        pen.setDashPattern([ratio * part for part in pen.dashPattern()])
    return pen


def shade_of(line_style: LineStyle, theme: Theme) -> QColor:
    """Give the colour of an area."""
    colour: QColor = pg.mkColor(line_style.colour(theme))
    colour.setAlphaF(line_style.filled or 0.25)
    return colour
