"""A plot as all pages draw it: labelled axes that follow the data without trembling, and a legend."""

from collections.abc import Callable
from math import isfinite, log10

import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPointF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QGuiApplication,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QResizeEvent,
)
from PySide6.QtWidgets import QMenu, QWidget

from ..widgets import Theme, paint_hint
from ._axis import AxisItem, Blankness, Grid, PlotAxis, Scale
from ._band import Band
from ._legend import LegendEntry, LegendLine
from ._line_style import SIGNS, LineStyle, curve_pen, shade_of, straight_pen
from ._logical_line import LogicalLine
from ._reading import Reading
from ._saved_plot import save_plot
from ._upright_marks import Rules, Stripes

ROOM = 0.15
"""Empty share of the range at either end after a change."""
LEAST_USED = 0.5
"""Share of the range that the data must fill, or it is drawn larger."""

Range = tuple[float, float]


def steady_range(shown: Range, data: Range) -> Range | None:
    """Give the range to change to, or None while the data is inside and fills enough of what is shown."""
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
_UP_EM = 5
"""Room for the upright axis: the same in all plots, so that those above one another are aligned."""


class Plot(pg.PlotWidget):  # type: ignore[misc] # untyped library
    """One pair of axes. Values are given as they are; logarithms are taken here.

    With the focus on it: A shows everything, L changes the upright axis between linear and logarithmic,
    G reads values, D tells differences from there, Ctrl+C copies the picture; the context menu saves picture
    and numbers. While it is disabled a veil says that it belongs to earlier inputs.
    """

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
            # They would write a label anew, that nobody sees, at every change of the range.
            self.getPlotItem().getAxis(unseen).unlinkFromView()
        for axis in (self.across, self.up):
            # Before the grid, which is drawn at their ticks.
            axis.setZValue(_FIRST)
        # A number that does not fit below the upper end of its axis would be cut in two.
        self.up.setStyle(hideOverlappingLabels=True)
        self.getPlotItem().layout.setContentsMargins(1, 1, round(_RIGHT_EM * self.fontMetrics().height()), 1)
        # A width that followed the numbers would be known after painting, and everything painted again.
        self.up.setWidth(_UP_EM * self.fontMetrics().height())
        self.getPlotItem().hideButtons()
        self._axes = (across, up)
        self._grid = Grid(self.across, self.up)
        self.addItem(self._grid, ignoreBounds=True)
        self.getPlotItem().setLogMode(across.scale is Scale.LOGARITHMIC, up.scale is Scale.LOGARITHMIC)
        self._scales = [across.scale, up.scale]
        self._inked: list[tuple[LineStyle, Callable[[Theme], None]]] = []
        self._legend: LegendLine | None = None
        self._legend_entries: list[tuple[LineStyle, str, str]] = []
        self._curves: list[pg.PlotDataItem] = []
        self._hint, self._is_empty = "", False
        self._blanked: tuple[AxisItem, ...] = (self.across, self.up)
        self._theme = theme
        self._named: list[tuple[str, pg.PlotDataItem]] = []
        self._levels: dict[pg.InfiniteLine, float] = {}
        self._reading: Reading | None = None
        self._follows = False
        self.getViewBox().sigRangeChangedManually.connect(self._let_be)
        self.retheme(theme)

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

    def band(self, line_style: LineStyle) -> Band:
        """Add an area between the bounds of a curve; the axes follow the curve alone."""
        band = Band()
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
        self._named.clear()
        self._levels.clear()
        self._reading = None
        self._legend_entries.clear()
        self._curves.clear()
        self._look_for_points()
        self._relegend()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self._theme = theme
        self.setBackground(theme.base)
        self._grid.dress(theme)
        if self._reading is not None:
            self._reading.dress(theme)
        for axis in (self.across, self.up):
            axis.setPen(pg.mkPen(theme.line, width=self.devicePixelRatioF()))
            axis.setTextPen(pg.mkPen(theme.text))
        for _, paint in self._inked:
            paint(theme)
        self._relegend()

    @property
    def lines_across(self) -> int:
        """How many upright lines fill the picture; on a fine screen each is some of its pixels wide."""
        return int(self.getViewBox().width())

    def show_everything(self) -> None:
        """Let the axes follow the data."""
        self.getPlotItem().enableAutoRange()

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
        if event.type() == QEvent.Type.DevicePixelRatioChange and getattr(self, "_theme", None) is not None:
            self.retheme(self._theme)
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
            paint_hint(painter, inside, self._hint, self._theme.muted)
        elif not self.isEnabled() and any(_has_points(each) for each in self._curves):
            veil = QColor(self._theme.base)
            veil.setAlphaF(_VEIL)
            painter.fillRect(inside, veil)
            paint_hint(painter, inside, OUT_OF_DATE, self._theme.text)

    def changeEvent(self, event: QEvent) -> None:
        """Lay a veil over what belongs to other inputs, or take it away."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.EnabledChange:
            self.viewport().update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Act on A, L and Ctrl+C, while the plot has the focus."""
        match event.key(), event.modifiers():
            case Qt.Key.Key_A, Qt.KeyboardModifier.NoModifier:
                self.show_everything()
            case Qt.Key.Key_L, Qt.KeyboardModifier.NoModifier:
                self._turn_scale()
            case Qt.Key.Key_G, Qt.KeyboardModifier.NoModifier:
                self.read_on_or_off()
            case Qt.Key.Key_D, Qt.KeyboardModifier.NoModifier:
                self.mark_or_unmark()
            case Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier:
                QGuiApplication.clipboard().setPixmap(self.grab())
            case _:
                # To the page: what it does with a key it does while a plot has the focus too.
                event.ignore()
                return
        event.accept()

    @property
    def reading(self) -> str:
        """What is read under the pointer; empty while nothing is."""
        return "" if self._reading is None else self._reading.text

    def read_at(self, drawn: QPointF) -> None:
        """Tell the place, and the nearest curve there, in the coordinates that are drawn."""
        if self._reading is None:
            self._reading = Reading(
                self, lambda line: self.addItem(line, ignoreBounds=True), lambda: self._named
            )
            self._reading.dress(self._theme)
        self._reading.show_at(drawn, self._axes, self._scales)

    def read_on_or_off(self) -> None:
        """Read in the middle of the picture, where no pointer is; or no more."""
        if self._reading is not None and self._reading.place is not None:
            self._reading.hide()
        else:
            self.read_at(self.getViewBox().viewRect().center())

    def mark_or_unmark(self) -> None:
        """Tell differences from the place that is read, or from none."""
        if self._reading is None or self._reading.place is None:
            self.read_on_or_off()
        if self._reading is not None:
            self._reading.mark(self._scales)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Read under the pointer."""
        super().mouseMoveEvent(event)
        place = self.mapToScene(event.position().toPoint())
        if event.buttons() == Qt.MouseButton.NoButton and self.getViewBox().sceneBoundingRect().contains(
            place
        ):
            self.read_at(self.getViewBox().mapSceneToView(place))
        elif self._reading is not None:
            self._reading.hide()

    def leaveEvent(self, event: QEvent) -> None:
        """Read no more."""
        super().leaveEvent(event)
        if self._reading is not None:
            self._reading.hide()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what can be done with the picture and its numbers."""
        menu = QMenu(self)
        place = self.getViewBox().mapSceneToView(self.mapToScene(event.pos()))

        def mark_here() -> None:
            self.read_at(place)
            self.mark_or_unmark()

        for text, act in (*self.actions_offered, ("Differences from here\tD", mark_here)):
            menu.addAction(text).triggered.connect(lambda _checked=False, act=act: act())
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())
        event.accept()

    @property
    def actions_offered(self) -> tuple[tuple[str, Callable[[], object]], ...]:
        """What the context menu holds."""
        return (
            ("Show everything\tA", self.show_everything),
            ("Linear or logarithmic\tL", self._turn_scale),
            ("Read values\tG", self.read_on_or_off),
            ("Copy the picture\tCtrl+C", lambda: QGuiApplication.clipboard().setPixmap(self.grab())),
            ("Copy the numbers", lambda: QGuiApplication.clipboard().setText(self.numbers("\t"))),
            ("Save picture or numbers…", lambda: save_plot(self)),
        )

    def numbers(self, separator: str = ",") -> str:
        """Give what is drawn as rows of curve, place across and value, in the units of the axes."""
        across, up = self._axes
        rows = [separator.join(("Curve", across.text, up.text))]
        for number, (name, item) in enumerate(self._named):
            if item.xData is not None and item.yData is not None:
                called = (name or f"{self.accessibleName()} {number + 1}").replace(separator, ";")
                rows += [
                    f"{called}{separator}{x * across.factor:.9g}{separator}{y * up.factor:.9g}"
                    for x, y in zip(item.xData.tolist(), item.yData.tolist(), strict=True)
                ]
        return "\n".join(rows) + "\n"

    def _let_be(self, *_: object) -> None:
        """Follow the data no more: somebody looks at a part of the picture."""
        self._follows = False

    def _turn_scale(self) -> None:
        up = Scale.LINEAR if self._scales[1] is Scale.LOGARITHMIC else Scale.LOGARITHMIC
        self._scales[1] = up
        self.getPlotItem().setLogMode(y=up is Scale.LOGARITHMIC)
        self._place_levels()
        self.show_everything()

    def _place_levels(self) -> None:
        is_logarithmic = self._scales[1] is Scale.LOGARITHMIC
        for item, value in self._levels.items():
            item.setVisible(isfinite(value) and (value > 0 or not is_logarithmic))
            if item.isVisible():
                item.setValue(log10(value) if is_logarithmic else value)

    def _across(self, value: float) -> float:
        return log10(value) if self._scales[0] is Scale.LOGARITHMIC else value

    def _line(
        self, line_style: LineStyle, position: float, angle: float, label: str, at: float
    ) -> pg.InfiniteLine:
        options = {"position": at, "movable": False}
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
        paint(self._theme)

    def _add(self, item: pg.PlotDataItem, name: str) -> None:
        self._curves.append(item)
        self._named.append((name, item))
        self.addItem(item)
        item.sigPlotChanged.connect(self._look_for_points)
        self._look_for_points()

    def _look_for_points(self, *_: object) -> None:
        """Write the hint, and no numbers, where there is nothing that they could be about.

        Best known before anything is painted: what is found out in painting has to be painted again.
        """
        self._is_empty = bool(self._hint) and not any(_has_points(each) for each in self._curves)
        for axis in self._blanked:
            axis.blank(Blankness.BLANK if self._is_empty else Blankness.WRITTEN)

    def _relegend(self) -> None:
        """Write the legend anew: its colours follow the theme."""
        if self._legend is None:
            return
        self._legend.show_entries(
            tuple(
                LegendEntry(sign, line_style.colour(self._theme), name)
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


def _has_points(item: pg.PlotDataItem) -> bool:
    return item.xData is not None and len(item.xData) > 0
