"""A plot as all pages draw it: labelled axes that follow the data without trembling, and a legend."""

from collections.abc import Callable
from math import isfinite, log10

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QResizeEvent
from PySide6.QtWidgets import QApplication, QWidget

from vibench.acquisition import printable

from ..widgets.boxes import paint_hint
from ..widgets.theme import Theme
from ..widgets.units import UNITS
from .axis import AxisItem, Blankness, Grid, PlotAxis, Scale
from .legend import LegendEntry, LegendLine
from .line_style import SIGNS, Band, LineStyle, LogicalLine, curve_pen, shade_of, straight_pen
from .plot_actions import add_actions
from .reading import Reading
from .upright_marks import Rules, Stripes

ROOM = 0.15
"""Empty share of the range at either end after a change."""
LEAST_USED = 0.5
"""Share of the range that the data must fill, or it is drawn larger."""

Range = tuple[float, float]


def steady_range(shown: Range, data: Range) -> Range | None:
    """Return the range to change to, or None while the data is inside and fills enough of what is shown."""
    low, high = data
    size = high - low
    is_inside = shown[0] <= low and high <= shown[1]
    if is_inside and size >= LEAST_USED * (shown[1] - shown[0]):
        return None
    if size <= 0.0:
        # A dead signal: some room around it, whatever its unit.
        half = 0.5 * abs(low) or 1e-3
        wanted = (low - half, high + half)
        return None if is_inside and shown[1] - shown[0] <= 8 * half else wanted
    return low - ROOM * size, high + ROOM * size


# Antialiasing halves the frame rate, and OpenGL draws grey areas on machines without it.
pg.setConfigOptions(antialias=False, useOpenGL=False)


_DOT = "●"
_VEIL = 0.5
OUT_OF_DATE = "of earlier inputs"
_FIRST = -1000
_RIGHT_EM = 0.6
"""Room for half of the last number across."""


class Plot(pg.PlotWidget):  # type: ignore[misc] # untyped library
    """One pair of axes. Values are given as they are; logarithms are taken here.

    Keys while it has the focus, and the context menu, are in `add_actions`. While it is disabled a veil says
    that it belongs to earlier inputs.
    """

    up_em = 5.0
    """Room for the upright axis: the same in all plots, so that those above one another are aligned."""

    def __init__(
        self, name: str, across: PlotAxis, up: PlotAxis, theme: Theme, parent: QWidget | None = None
    ) -> None:
        self.across = AxisItem("bottom", across)
        self.up = AxisItem("left", up)
        # Menus that nobody can open would take half of the time of making a plot.
        super().__init__(parent=parent, axisItems={"bottom": self.across, "left": self.up}, enableMenu=False)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        for unseen in ("top", "right"):
            # They would write a label again, that nobody sees, at every change of the range.
            self.getPlotItem().getAxis(unseen).unlinkFromView()
        for axis in (self.across, self.up):
            # Before the grid, which is drawn at their ticks.
            axis.setZValue(_FIRST)
        # A number that does not fit below the upper end of its axis would be cut in two.
        self.up.setStyle(hideOverlappingLabels=True)
        self.follow_font()
        self.getPlotItem().hideButtons()
        self._grid = Grid(self.across, self.up)
        self.addItem(self._grid, ignoreBounds=True)
        self.getPlotItem().setLogMode(across.scale is Scale.LOGARITHMIC, up.scale is Scale.LOGARITHMIC)
        self.scales = [across.scale, up.scale]
        """How values are laid out now, across and up."""
        self._inked: list[tuple[LineStyle, Callable[[Theme], None]]] = []
        self._legend: LegendLine | None = None
        self._legend_entries: list[tuple[LineStyle, str, str]] = []
        self.named_curves: list[tuple[str, pg.PlotDataItem]] = []
        """Every line and set of points, with its name in the legend, if it has one."""
        self.bands: list[Band] = []
        self.read_more: Callable[[float, float], str] = lambda _across, _up: ""
        """What else is to be read at a place of the picture."""
        self._hint, self._is_empty = "", False
        self._blanked: tuple[AxisItem, ...] = (self.across, self.up)
        self.theme = theme
        self._levels: dict[pg.InfiniteLine, float] = {}
        self._follows = False
        self.reading = Reading(self)
        add_actions(self)
        self.scene().sigMouseMoved.connect(self.reading.follow)
        self.getViewBox().sigRangeChangedManually.connect(self._let_be)
        UNITS.on_change(self._tell_anew)
        self.retheme(theme)

    def follow_font(self) -> None:
        """Give axes and margins the room that the font needs."""
        em = self.fontMetrics().height()
        self.getPlotItem().layout.setContentsMargins(1, 1, round(_RIGHT_EM * em), 1)
        # A width that followed the numbers would be known after painting, and everything painted again.
        self.up.setWidth(self.up_em * em)

    def with_legend(self) -> "Plot":
        """Show names of the curves that have one, above the axes."""
        self._legend = LegendLine(self)
        self._relegend()
        return self

    def with_hint(self, text: str) -> "Plot":
        """Say this while no curve has a point."""
        self._hint = text
        self._look_for_points()
        return self

    def always_numbered(self) -> "Plot":
        """Keep the numbers across where there is no curve: another plot, above, has the same axis."""
        self._blanked = (self.up,)
        self.across.blank(Blankness.WRITTEN)
        return self

    def curve(self, line_style: LineStyle, name: str = "") -> pg.PlotDataItem:
        """Add a line; ``setData(x, y)`` draws it."""
        item = LogicalLine()
        item.setSkipFiniteCheck(False)
        self._add(item, name)
        if name:
            self._legend_entries.append((line_style, SIGNS[line_style.dash], name))
        self._line_style(
            line_style, lambda theme: item.setPen(curve_pen(line_style, theme, self.devicePixelRatioF()))
        )
        self._relegend()
        return item

    def dots(self, line_style: LineStyle, name: str = "", size: int = 4) -> pg.PlotDataItem:
        """Add points without a line."""
        item = pg.PlotDataItem(pen=None, symbol="o", symbolSize=size, symbolPen=None)
        self._add(item, name)
        if name:
            self._legend_entries.append((line_style, _DOT, name))
        self._line_style(line_style, lambda theme: item.setSymbolBrush(pg.mkBrush(line_style.colour(theme))))
        self._relegend()
        return item

    def band(self, line_style: LineStyle, of: str = "") -> Band:
        """Add an area between the bounds of the curve of a name; the axes follow the curve alone."""
        band = Band(of)
        self.bands.append(band)
        self.addItem(band.item, ignoreBounds=True)
        self._line_style(line_style, lambda theme: band.paint(shade_of(line_style, theme)))
        return band

    def stripes(self, line_style: LineStyle) -> Stripes:
        """Add upright stripes: where something happens, or is predicted to."""
        item = Stripes(self._across)
        self.addItem(item, ignoreBounds=True)
        self._line_style(line_style, lambda theme: item.dress(shade_of(line_style, theme)))
        return item

    def rules(self, line_style: LineStyle) -> Rules:
        """Add upright lines without labels."""
        item = Rules(self._across)
        self.addItem(item, ignoreBounds=True)
        self._line_style(
            line_style, lambda theme: item.dress(straight_pen(line_style, theme, self.devicePixelRatioF()))
        )
        return item

    def upright(
        self, line_style: LineStyle, value: float, label: str = "", label_at: float = 0.92
    ) -> pg.InfiniteLine:
        """Add an upright line at a value; its label stands at a share of the height."""
        return self._line(line_style, self._across(value), 90, label, label_at)

    def level(self, line_style: LineStyle, value: float, label: str = "") -> pg.InfiniteLine:
        """Add a level line at a value; a logarithmic scale has no place for one of zero or below."""
        item = self._line(line_style, value, 0, label, 0.92)
        self.move_level(item, value)
        return item

    def move_level(self, item: pg.InfiniteLine, value: float) -> None:
        """Put a level line at another value; NaN hides it."""
        self._levels[item] = value
        self._place_levels()

    def wipe(self) -> None:
        """Take every curve, band and line away, for others."""
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
        """Draw in other colours."""
        self.theme = theme
        self.setBackground(theme.base)
        self._grid.dress(theme)
        self.reading.dress(theme)
        for axis in (self.across, self.up):
            axis.setPen(pg.mkPen(theme.line, width=self.devicePixelRatioF()))
            axis.setTextPen(pg.mkPen(theme.text))
        for _, paint in self._inked:
            paint(theme)
        self._relegend()

    @property
    def columns(self) -> int:
        """How many columns of extremes fill the picture.

        A few more than it has pixels of the layout: with fewer, a pixel between two columns would stay empty.
        """
        return int(1.02 * self.getViewBox().width()) + 2

    def show_everything(self) -> None:
        """Let the axes follow the data."""
        self.getPlotItem().enableAutoRange()

    def turn_scale(self) -> None:
        """Lay values out upright linearly, or logarithmically."""
        is_linear = self.scales[1] is Scale.LINEAR
        self.scales[1] = Scale.LOGARITHMIC if is_linear else Scale.LINEAR
        self.getPlotItem().setLogMode(y=is_linear)
        self._place_levels()
        self.reading.rescale()
        self.show_everything()

    def keep_in_view(
        self, across: tuple[float, float] | None = None, up: tuple[float, float] | None = None
    ) -> None:
        """Let the axes follow these extremes, but only when they must: a quiet axis costs nothing to draw."""
        if not any(self.getViewBox().autoRangeEnabled()) and not self._follows:
            return
        self._follows = True
        shown = self.getViewBox().viewRange()
        if across is not None and (wanted := steady_range(tuple(shown[0]), across)) is not None:
            self.setXRange(*wanted, padding=0)
        if up is not None and (wanted := steady_range(tuple(shown[1]), up)) is not None:
            self.setYRange(*wanted, padding=0)

    def event(self, event: QEvent) -> bool:
        """Come to a screen with other pixels: straight lines are given its width."""
        if event.type() == QEvent.Type.DevicePixelRatioChange and getattr(self, "theme", None) is not None:
            self.retheme(self.theme)
        return bool(super().event(event))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the legend the lines it needs for the new width."""
        super().resizeEvent(event)
        # pyqtgraph calls this before the widget is whole, and when it is no more.
        if getattr(self, "_legend", None) is not None and self.plotItem is not None:
            self._place_legend()

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        """Say the hint where there is nothing else to see."""
        super().drawForeground(painter, rect)
        # A curve that is cleared says nothing.
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
        """Lay a veil over what belongs to other inputs, or take it away; follow the font."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.EnabledChange:
            self.viewport().update()
        elif event.type() == QEvent.Type.FontChange and getattr(self, "theme", None) is not None:
            self.follow_font()
            if self._legend is not None:
                self._legend.follow_font()
                self._place_legend()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave keys to the page: what it does with one it does while a plot has the focus too."""
        event.ignore()

    def leaveEvent(self, event: QEvent) -> None:
        """Read no more."""
        super().leaveEvent(event)
        # The place at which the context menu was opened stays, for what is chosen there.
        if QApplication.activePopupWidget() is None:
            self.reading.hide()

    def _let_be(self, *_: object) -> None:
        """Follow the data no more: somebody looks at a part of the picture."""
        self._follows = False

    def _place_levels(self) -> None:
        is_logarithmic = self.scales[1] is Scale.LOGARITHMIC
        for item, value in self._levels.items():
            item.setVisible(isfinite(value) and (value > 0 or not is_logarithmic))
            if item.isVisible():
                item.setValue(log10(value) if is_logarithmic else value)

    def _across(self, value: float) -> float:
        return log10(value) if self.scales[0] is Scale.LOGARITHMIC else value

    def _line(
        self, line_style: LineStyle, position: float, angle: float, label: str, at: float
    ) -> pg.InfiniteLine:
        options = {"position": at, "movable": False}
        label = printable(label).replace("{", "{{").replace("}", "}}")  # pyqtgraph takes it as a format
        item = pg.InfiniteLine(position, angle, label=label or None, labelOpts=options if label else None)
        self.addItem(item, ignoreBounds=True)

        def paint(theme: Theme) -> None:
            item.setPen(straight_pen(line_style, theme, self.devicePixelRatioF()))
            if label:
                item.label.setColor(line_style.colour(theme))
                item.label.fill = pg.mkBrush(theme.base)

        self._line_style(line_style, paint)
        return item

    def _line_style(self, line_style: LineStyle, paint: Callable[[Theme], None]) -> None:
        self._inked.append((line_style, paint))
        paint(self.theme)

    def _add(self, item: pg.PlotDataItem, name: str) -> None:
        self.named_curves.append((name, item))
        self.addItem(item)
        item.sigPlotChanged.connect(self._look_for_points)
        item.sigPlotChanged.connect(self.reading.again)
        self._look_for_points()

    @property
    def _holds_points(self) -> bool:
        return any(each.xData is not None and len(each.xData) > 0 for _, each in self.named_curves)

    @property
    def _holds_something(self) -> bool:
        """Whether there is a curve, or a picture made of pixels."""
        items = self.getPlotItem().items
        return self._holds_points or any(getattr(each, "image", None) is not None for each in items)

    def _look_for_points(self, *_: object) -> None:
        """Write the hint, and no numbers, where there is nothing that they could be about.

        Best known before anything is painted: what is found out in painting has to be painted again.
        """
        self._is_empty = bool(self._hint) and not self._holds_points
        for axis in self._blanked:
            axis.blank(Blankness.BLANK if self._is_empty else Blankness.WRITTEN)

    def _tell_anew(self) -> None:
        """Tell names and readings in other units, unless the plot is closed."""
        if self.plotItem is not None:
            self._relegend()
            self.reading.again()

    def _relegend(self) -> None:
        """Write the legend again: its colours follow the theme."""
        if self._legend is None:
            return
        self._legend.show_entries(
            tuple(
                LegendEntry(sign, line_style.colour(self.theme), UNITS.told(name))
                for line_style, sign, name in self._legend_entries
            )
        )
        self._place_legend()

    def _place_legend(self) -> None:
        """Put the legend into the row above the axes, which pyqtgraph keeps for a title."""
        if self._legend is None:
            return
        left = self.fontMetrics().height()
        width = max(1, self.width() - 2 * left)
        height = self._legend.height_for(width)
        self._legend.setGeometry(left, 0, width, height)
        self.getPlotItem().layout.setRowFixedHeight(0, height)
