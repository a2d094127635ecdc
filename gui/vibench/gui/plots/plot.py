"""Base class of all plots: labelled axes whose range follows the data in steps, and a legend."""

from collections.abc import Callable, Iterable, Mapping
from html import escape
from math import isfinite
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QLineF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QKeyEvent, QPainter, QPalette, QPen, QResizeEvent
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from vibench.acquisition import printable

from ..widgets.boxes import paint_hint
from ..widgets.theme import Theme
from ..widgets.units import UNITS
from .axis import AxisItem, Blankness, Grid, PlotAxis, Scale
from .line_style import SIGNS, Band, LineStyle, LogicalLine, curve_pen, shade_of, straight_pen
from .plot_actions import Reading, add_actions

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
    """Vertical stripes, each at least one pixel wide, so that all stripes are visible."""

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
    """Vertical lines of a plot; if the lines are too close together, no line is drawn."""

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


ROOM = 0.15
"""Margin at both ends when an axis is fitted to the data, relative to the range of the data."""
LEAST_USED = 0.5
"""Smallest fraction of an axis that the data may fill; if they fill less, the axis range is reduced."""

Range = tuple[float, float]


def steady_range(shown: Range, data: Range) -> Range | None:
    """Return a new range for an axis; None if the data are inside the current range and fill enough of it."""
    low, high = data
    size = high - low
    is_inside = shown[0] <= low and high <= shown[1]
    if is_inside and size >= LEAST_USED * (shown[1] - shown[0]):
        return None
    if size <= 0.0:
        # In any unit, a constant signal needs a range around its value.
        half = 0.5 * abs(low) or 1e-3
        wanted = (low - half, high + half)
        return None if is_inside and shown[1] - shown[0] <= 8 * half else wanted
    return low - ROOM * size, high + ROOM * size


# Antialiasing would halve the frame rate. OpenGL without hardware support would draw grey areas.
pg.setConfigOptions(antialias=False, useOpenGL=False)


_DOT = "●"
_VEIL = 0.5
OUT_OF_DATE = "outdated: inputs have changed"
_FIRST = -1000
_RIGHT_EM = 0.6
"""Right margin, in font heights, with room for half of the last number."""
_MARGIN = 4
"""Margin above and below the legend [pixels]."""


class LegendLine(QLabel):
    """Legend whose entries are side by side and wrapped to the width; no entry is split."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._of = parent
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setTextFormat(Qt.TextFormat.RichText)
        self.setWordWrap(True)
        self.setBackgroundRole(QPalette.ColorRole.Base)
        self.setAutoFillBackground(True)
        self.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.follow_font()

    def follow_font(self) -> None:
        """Use a slightly smaller font than the rest of the window."""
        font = QFont(self._of.font())
        font.setPointSizeF(0.85 * font.pointSizeF())
        self.setFont(font)

    def show_entries(self, entries: list[tuple[LineStyle, str, str]], theme: Theme) -> None:
        """Show these curves in the legend; an entry has line style, sign (``━━``, ``●``) and name."""
        names = [printable(UNITS.convert(name)) for _, _, name in entries]
        text = "&nbsp;&nbsp;&nbsp; ".join(
            f'<span style="color:{line_style.colour(theme)}">{sign}</span>&nbsp;'
            f"{escape(name).replace(' ', '&nbsp;').replace('-', '&#8209;')}"
            for (line_style, sign, _), name in zip(entries, names, strict=True)
        )
        if text != self.text():
            self.setText(text)
            self.setAccessibleName("Legend: " + ", ".join(names))


Curves = Mapping[str, pg.PlotDataItem]
"""Curves of a plot, keyed by the result's field that each curve shows."""


def show_fields(curves: Curves, result: Any) -> None:
    """Draw fields of a result over its frequency, each in the curve with the field's name; None clears."""
    for name, curve in curves.items():
        if result is None:
            curve.clear()
        else:
            curve.setData(result.frequency_hz, np.asarray(getattr(result, name)))


class Plot(pg.PlotWidget):  # type: ignore[misc] # untyped library
    """Plot with one pair of axes. Curves get plain values, which the plot converts for logarithmic axes.

    `add_actions` defines keys and context menu. A disabled plot is dimmed and marked as outdated.
    """

    up_em = 5.0
    """Width of the vertical axis, in font heights; the same in all plots, so that stacked plots align."""

    def __init__(
        self, name: str, across: PlotAxis, up: PlotAxis, theme: Theme, parent: QWidget | None = None
    ) -> None:
        self.across = AxisItem("bottom", across)
        self.up = AxisItem("left", up)
        # Without pyqtgraph's own menus, creating a plot takes half the time.
        super().__init__(parent=parent, axisItems={"bottom": self.across, "left": self.up}, enableMenu=False)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        for unseen in ("top", "right"):
            # Unlink invisible axes: pyqtgraph would update their labels at every change of the range.
            self.getPlotItem().getAxis(unseen).unlinkFromView()
        for axis in (self.across, self.up):
            # Paint the axes before the grid: painting an axis determines the ticks that the grid needs.
            axis.setZValue(_FIRST)
        # Hide the last number of an axis where it would be cut off.
        self.up.setStyle(hideOverlappingLabels=True)
        self.follow_font()
        self.getPlotItem().hideButtons()
        self._grid = Grid(self.across, self.up)
        self.addItem(self._grid, ignoreBounds=True)
        self.getPlotItem().setLogMode(across.scale is Scale.LOGARITHMIC, up.scale is Scale.LOGARITHMIC)
        self.scales = [across.scale, up.scale]
        self._inked: list[Callable[[Theme], None]] = []
        self._legend: LegendLine | None = None
        self._legend_entries: list[tuple[LineStyle, str, str]] = []
        self.named_curves: list[tuple[str, pg.PlotDataItem]] = []
        """All curves and sets of points of the plot, with their names for the legend; a name may be empty."""
        self.bands: list[Band] = []
        self.read_more: Callable[[float, float], str] = lambda _across, _up: ""
        """Function that returns additional text for the cursor reading at a point of the plot."""
        self._hint, self._is_empty = "", False
        self._blanked: tuple[AxisItem, ...] = (self.across, self.up)
        self.theme = theme
        self._levels: dict[pg.InfiniteLine, float] = {}
        self._follows = False
        self.reading = Reading(self)
        add_actions(self)
        self.scene().sigMouseMoved.connect(self.reading.follow)
        self.getViewBox().sigRangeChangedManually.connect(self._stop_following)
        UNITS.on_change(self._show_units)
        self.retheme(theme)

    def follow_font(self) -> None:
        """Fit axes and margins to the font."""
        em = self.fontMetrics().height()
        self.getPlotItem().layout.setContentsMargins(1, 1, round(_RIGHT_EM * em), 1)
        # Fix the width of the axis, because a width that depends on the numbers would require painting twice.
        self.up.setWidth(self.up_em * em)

    def with_legend(self) -> "Plot":
        """Show the named curves above the axes."""
        self._legend = LegendLine(self)
        self._relegend()
        return self

    def with_hint(self, text: str) -> "Plot":
        """Show a hint while no curve has points."""
        self._hint = text
        self._look_for_points()
        return self

    def keep_numbers(self) -> "Plot":
        """Show numbers on the horizontal axis of an empty plot too, because a plot above shares the axis."""
        self._blanked = (self.up,)
        self.across.blank(Blankness.WRITTEN)
        return self

    def curve(self, line_style: LineStyle, name: str = "") -> pg.PlotDataItem:
        """Add a line; ``setData(x, y)`` sets its points."""
        item = LogicalLine()
        item.setSkipFiniteCheck(False)
        self._add(item, line_style, SIGNS[line_style.dash], name)
        self._line_style(lambda theme: item.setPen(curve_pen(line_style, theme, self.devicePixelRatioF())))
        return item

    def dots(self, line_style: LineStyle, name: str = "", size: int = 4) -> pg.PlotDataItem:
        """Add a set of points that no line connects."""
        item = pg.PlotDataItem(pen=None, symbol="o", symbolSize=size, symbolPen=None)
        self._add(item, line_style, _DOT, name)
        self._line_style(lambda theme: item.setSymbolBrush(pg.mkBrush(line_style.colour(theme))))
        return item

    def band(self, line_style: LineStyle, of: str = "") -> Band:
        """Add an area between the bounds of a named curve; the axes ignore it when fitting their range."""
        band = Band(of)
        self.bands.append(band)
        self.addItem(band.item, ignoreBounds=True)
        self._line_style(lambda theme: band.paint(shade_of(line_style, theme)))
        return band

    def stripes(self, line_style: LineStyle) -> Stripes:
        """Add vertical stripes for frequency or time ranges."""
        item = Stripes(self.scales[0].position)
        self.addItem(item, ignoreBounds=True)
        self._line_style(lambda theme: item.dress(shade_of(line_style, theme)))
        return item

    def rules(self, line_style: LineStyle) -> Rules:
        """Add a set of vertical lines without labels."""
        item = Rules(self.scales[0].position)
        self.addItem(item, ignoreBounds=True)
        self._line_style(lambda theme: item.dress(straight_pen(line_style, theme, self.devicePixelRatioF())))
        return item

    def upright(
        self, line_style: LineStyle, value: float, label: str = "", label_at: float = 0.92
    ) -> pg.InfiniteLine:
        """Add a vertical line at a value; ``label_at`` is the height of the line's label (0 to 1)."""
        return self._line(line_style, self.scales[0].position(value), 90, label, label_at)

    def level(self, line_style: LineStyle, value: float, label: str = "") -> pg.InfiniteLine:
        """Add a horizontal line; on a logarithmic axis, it is hidden for values of zero or below."""
        item = self._line(line_style, value, 0, label, 0.92)
        self.move_level(item, value)
        return item

    def move_level(self, item: pg.InfiniteLine, value: float) -> None:
        """Move a horizontal line; NaN hides it."""
        self._levels[item] = value
        self._place_levels()

    def wipe(self) -> None:
        """Remove all curves, bands and lines from the plot."""
        self.getPlotItem().clear()
        self.addItem(self._grid, ignoreBounds=True)
        self._inked.clear()
        self.named_curves.clear()
        self.bands.clear()
        self._levels.clear()
        self.reading.forget()
        self._legend_entries.clear()
        self._look_for_points()
        self._relegend()

    def retheme(self, theme: Theme) -> None:
        """Change the colours."""
        self.theme = theme
        self.setBackground(theme.base)
        self._grid.dress(theme)
        self.reading.dress(theme)
        for axis in (self.across, self.up):
            axis.setPen(pg.mkPen(theme.line, width=self.devicePixelRatioF()))
            axis.setTextPen(pg.mkPen(theme.text))
        for paint in self._inked:
            paint(theme)
        self._relegend()

    @property
    def columns(self) -> int:
        """Number of columns in which a signal is drawn by its smallest and largest values.

        It slightly exceeds the width in logical pixels, so that no pixel between columns stays empty.
        """
        return int(1.02 * self.getViewBox().width()) + 2

    def show_everything(self) -> None:
        """Let the axes follow the data again."""
        self.getPlotItem().enableAutoRange()

    def turn_scale(self) -> None:
        """Toggle the vertical axis between linear and logarithmic, unless an image has fixed its rows."""
        if any(isinstance(item, pg.ImageItem) for item in self.getPlotItem().items):
            return
        is_linear = self.scales[1] is Scale.LINEAR
        self.scales[1] = Scale.LOGARITHMIC if is_linear else Scale.LINEAR
        self.getPlotItem().setLogMode(y=is_linear)
        self._place_levels()
        self.reading.rescale()
        self.show_everything()

    def keep_in_view(
        self, across: tuple[float, float] | None = None, up: tuple[float, float] | None = None
    ) -> None:
        """Fit the axes to the data's extremes, but only if necessary, because redrawing an axis is slow."""
        if not any(self.getViewBox().autoRangeEnabled()) and not self._follows:
            return
        self._follows = True
        shown = self.getViewBox().viewRange()
        if across is not None and (wanted := steady_range(tuple(shown[0]), across)) is not None:
            self.setXRange(*wanted, padding=0)
        if up is not None and (wanted := steady_range(tuple(shown[1]), up)) is not None:
            self.setYRange(*wanted, padding=0)

    def event(self, event: QEvent) -> bool:
        """Redraw straight lines if the window was moved to a screen with another resolution."""
        if event.type() == QEvent.Type.DevicePixelRatioChange and getattr(self, "theme", None) is not None:
            self.retheme(self.theme)
        return bool(super().event(event))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the legend to the new width."""
        super().resizeEvent(event)
        # pyqtgraph also calls this method before the object is initialised and after it is closed.
        if getattr(self, "_legend", None) is not None and self.plotItem is not None:
            self._place_legend()

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        """Draw the hint on an empty plot, or dim a disabled plot."""
        super().drawForeground(painter, rect)
        # No signal reports that a curve was cleared, so look for points again.
        self._look_for_points()
        if self._is_empty or not self.isEnabled():
            painter.resetTransform()
            inside = self.mapFromScene(self.getViewBox().sceneBoundingRect()).boundingRect()
        if self._is_empty:
            paint_hint(painter, inside, self._hint, self.theme.muted)
        elif not self.isEnabled() and self._holds_something:
            veil = QColor(self.theme.base)
            veil.setAlphaF(_VEIL)
            painter.fillRect(inside, veil)
            paint_hint(painter, inside, OUT_OF_DATE, self.theme.text)

    def changeEvent(self, event: QEvent) -> None:
        """Repaint the plot when it is enabled or disabled; apply a change of the font."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.EnabledChange:
            self.viewport().update()
        elif event.type() == QEvent.Type.FontChange and getattr(self, "theme", None) is not None:
            self.follow_font()
            if self._legend is not None:
                self._legend.follow_font()
                self._place_legend()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Pass every key on to the page."""
        event.ignore()

    def leaveEvent(self, event: QEvent) -> None:
        """Hide the cursor reading."""
        super().leaveEvent(event)
        # Keep the reading while a context menu is open, because the menu's actions use the position.
        if QApplication.activePopupWidget() is None:
            self.reading.hide()

    def _stop_following(self, *_: object) -> None:
        """Stop following the data, because the user has zoomed or moved the view."""
        self._follows = False

    def _place_levels(self) -> None:
        is_logarithmic = self.scales[1] is Scale.LOGARITHMIC
        for item, value in self._levels.items():
            item.setVisible(isfinite(value) and (value > 0 or not is_logarithmic))
            if item.isVisible():
                item.setValue(self.scales[1].position(value))

    def _line(
        self, line_style: LineStyle, position: float, angle: float, label: str, at: float
    ) -> pg.InfiniteLine:
        options = {"position": at, "movable": False}
        label = printable(label).replace("{", "{{").replace("}", "}}")  # pyqtgraph needs a format string
        item = pg.InfiniteLine(position, angle, label=label or None, labelOpts=options if label else None)
        self.addItem(item, ignoreBounds=True)

        def paint(theme: Theme) -> None:
            item.setPen(straight_pen(line_style, theme, self.devicePixelRatioF()))
            if label:
                item.label.setColor(line_style.colour(theme))
                item.label.fill = pg.mkBrush(theme.base)

        self._line_style(paint)
        return item

    def _line_style(self, paint: Callable[[Theme], None]) -> None:
        self._inked.append(paint)
        paint(self.theme)

    def _add(self, item: pg.PlotDataItem, line_style: LineStyle, sign: str, name: str) -> None:
        self.named_curves.append((name, item))
        if name:
            self._legend_entries.append((line_style, sign, name))
            self._relegend()
        self.addItem(item)
        item.sigPlotChanged.connect(self._look_for_points)
        item.sigPlotChanged.connect(self.reading.reread)
        self._look_for_points()

    @property
    def _holds_points(self) -> bool:
        return any(each.xData is not None and len(each.xData) > 0 for _, each in self.named_curves)

    @property
    def _holds_something(self) -> bool:
        items = self.getPlotItem().items
        return self._holds_points or any(getattr(each, "image", None) is not None for each in items)

    def _look_for_points(self, *_: object) -> None:
        """If no curve has points, show the hint and hide the numbers of the axes.

        Call this before painting, because a change during painting would cause another repaint.
        """
        self._is_empty = bool(self._hint) and not self._holds_points
        for axis in self._blanked:
            axis.blank(Blankness.BLANK if self._is_empty else Blankness.WRITTEN)

    def _show_units(self) -> None:
        """Show axis labels and cursor reading in the chosen units, unless the plot has been closed."""
        if self.plotItem is not None:
            self._relegend()
            self.reading.reread()

    def _relegend(self) -> None:
        if self._legend is not None:
            self._legend.show_entries(self._legend_entries, self.theme)
            self._place_legend()

    def _place_legend(self) -> None:
        """Move the legend into the row that pyqtgraph reserves for a title."""
        if self._legend is None:
            return
        left = self.fontMetrics().height()
        width = max(1, self.width() - 2 * left)
        height = self._legend.heightForWidth(width) + 2 * _MARGIN if self._legend.text() else 0
        self._legend.setGeometry(left, 0, width, height)
        self.getPlotItem().layout.setRowFixedHeight(0, height)
