"""What a user does in a plot: read values at the pointer, and save the plot as a picture or as numbers."""

from math import isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QBuffer, QPointF, QRect, Qt
from PySide6.QtGui import QAction, QGuiApplication, QKeySequence, QPainter, QPalette
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QLabel, QMessageBox

from vibench.acquisition import printable
from vibench.sim.operating_system.this import replace_file

from ..widgets.boxes import new_path, plain_tip
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
        """Return name and value of the curve that is vertically nearest; None if there are no curves."""
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


FILTERS = "PNG (*.png);;SVG (*.svg);;Numbers as CSV (*.csv)"


def add_actions(plot: "Plot") -> None:
    """Add all actions to a plot; keys without an action are passed on to the page."""
    clipboard = QGuiApplication.clipboard()
    for text, key, act in (
        ("Show everything", "A", plot.show_everything),
        ("Linear or logarithmic", "L", plot.turn_scale),
        ("Read values", "G", plot.reading.on_or_off),
        ("Differences from here", "D", plot.reading.mark_or_unmark),
        ("Copy the picture", "Ctrl+C", lambda: clipboard.setPixmap(plot.grab())),
        ("Copy the numbers", "", lambda: clipboard.setText(numbers_of(plot, "\t"))),
        ("Save picture or numbers…", "", lambda: save_plot(plot)),
    ):
        action = QAction(text, plot)
        action.setShortcut(QKeySequence(key))
        action.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        action.setShortcutVisibleInContextMenu(True)
        action.triggered.connect(act)
        plot.addAction(action)
    plot.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)


def save_plot(plot: "Plot") -> None:
    """Ask for a path; save the picture or the numbers there."""
    wish = Path(f"{plot.accessibleName().lower().replace(' ', '_')}.png")
    path = new_path(plot, "Save picture or numbers", wish, FILTERS)
    if path is None:
        return
    try:
        write_plot(plot, path)
    except OSError as error:
        why = plain_tip(f"{path} was not written: {error.strerror}. Choose another name.")
        QMessageBox.warning(plot, "Not written", why)


def write_plot(plot: "Plot", path: Path) -> None:
    """Write the picture or the numbers, in the format of the path's suffix.

    Raises OSError when the file exists, cannot be written, or has another suffix.
    """
    if path.exists():
        raise FileExistsError(0, "it exists already")
    memory = QBuffer()  # let Qt write to memory, because Qt does not report every disk error
    match path.suffix.lower():
        case ".csv":
            memory.setData(numbers_of(plot, ",").encode())
        case ".svg":
            generator = QSvgGenerator()
            generator.setOutputDevice(memory)
            generator.setSize(plot.size())
            generator.setViewBox(QRect(0, 0, plot.width(), plot.height()))
            # In any other resolution, axes and curves would not line up.
            generator.setResolution(plot.logicalDpiX())
            painter = QPainter(generator)
            plot.render(painter)
            painter.end()
        case ending:
            if not plot.grab().save(memory, ending.removeprefix(".")):
                raise OSError(0, "the name must end in .png, .svg or .csv")
    with replace_file(path) as coming:
        coming.write_bytes(memory.data().data())


def numbers_of(plot: "Plot", separator: str) -> str:
    """Return the curves as text lines with name, x and y, in the displayed units."""
    across, up = plot.across.axis, plot.up.axis
    rows = [separator.join(("Curve", across.text, up.text))]
    for number, (name, item) in enumerate(plot.named_curves):
        if item.xData is not None and item.yData is not None:
            called = (name or f"{plot.accessibleName()} {number + 1}").replace(separator, ";")
            rows += [
                f"{called}{separator}{x * across.display.per_si:.9g}{separator}{y * up.display.per_si:.9g}"
                for x, y in zip(item.xData.tolist(), item.yData.tolist(), strict=True)
            ]
    return "\n".join(rows) + "\n"
