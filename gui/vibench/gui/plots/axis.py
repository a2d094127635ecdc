"""Axes with the unit in the label, 1-2-5 ticks on logarithmic scales, and a grid at all ticks."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from html import escape
from math import ceil, floor, log10

import pyqtgraph as pg
from PySide6.QtCore import QLineF
from PySide6.QtGui import QColor, QFontMetricsF, QPainter
from PySide6.QtWidgets import QGraphicsItem, QGraphicsSceneResizeEvent

from vibench.acquisition import printable

from ..widgets.theme import Theme
from ..widgets.units import CHOICES, UNITS, ShownUnit


class Scale(Enum):
    """Scale of an axis: linear or logarithmic."""

    LINEAR = auto()
    LOGARITHMIC = auto()

    def position(self, value: float) -> float:
        """Return the coordinate at which pyqtgraph draws a value: on a logarithmic axis, its logarithm."""
        return log10(value) if self is Scale.LOGARITHMIC else value

    def value_at(self, drawn: float) -> float:
        """Return the value that is drawn at a coordinate."""
        return float(10.0 ** min(max(drawn, -300.0), 300.0)) if self is Scale.LOGARITHMIC else drawn


class Blankness(Enum):
    """Whether the numbers of an axis are shown."""

    WRITTEN = auto()
    BLANK = auto()


@dataclass(frozen=True)
class PlotAxis:
    """Quantity, unit and scale of an axis."""

    label: str
    unit: str = ""
    """SI unit of the values if the user can choose the displayed unit; otherwise the displayed unit."""
    factor: float = 1.0
    """Ratio of displayed to plotted values, for a unit that cannot be chosen: 1e3 shows seconds as ms."""
    scale: Scale = Scale.LINEAR
    short: str = ""

    @property
    def display(self) -> ShownUnit:
        """Displayed unit, with the factor from plotted to displayed values."""
        return UNITS.on_axis(self.unit) if self.unit in CHOICES else ShownUnit(self.unit, self.factor)

    @property
    def text(self) -> str:
        """Label of the axis: quantity and unit."""
        return self._with_unit(self.label)

    @property
    def short_text(self) -> str:
        """Short label with unit, or the unit alone."""
        return self._with_unit(self.short) if self.short else self.display.name

    def _with_unit(self, label: str) -> str:
        unit = self.display.name
        return f"{label} ({unit})" if label and unit else label or unit


FREQUENCY = PlotAxis("Frequency", "Hz")
LOG_FREQUENCY = PlotAxis("Frequency", "Hz", scale=Scale.LOGARITHMIC)
TIME = PlotAxis("Time", "s")
_LINE_DISTANCE = 1.25
"""Smallest distance between numbers on a vertical axis, in font heights."""
_MINOR = 0.01
"""Special value of the tick spacing by which `tickStrings` recognises ticks without a number."""
_WIDE = "2000"
"""Text as wide as the widest number on a logarithmic horizontal axis, with margins."""


class AxisItem(pg.AxisItem):  # type: ignore[misc] # untyped library
    """Axis of a plot; on a logarithmic scale, the coordinates are decimal logarithms."""

    def __init__(self, orientation: str, axis: PlotAxis) -> None:
        super().__init__(orientation)
        self._blankness = Blankness.WRITTEN
        self.levels: tuple[list[float], ...] = ()
        """Coordinates of the ticks painted last; ticks with numbers come first."""
        self.enableAutoSIPrefix(False)
        self.setLabel(axis.text)
        self.axis = axis
        """Quantity, unit and scale of this axis."""
        UNITS.on_change(self._show_other_unit)
        # Cache the image of the axis, because the axis text takes most of a frame's time.
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)

    def show_unit(self, axis: PlotAxis) -> None:
        """Replace quantity, unit and scale of this axis."""
        self.axis = axis
        self._show_other_unit()

    def _show_other_unit(self) -> None:
        # The label no longer exists after pyqtgraph has closed the plot.
        if self.label is not None:
            self._fit_label()
            self.update()

    def resizeEvent(self, event: QGraphicsSceneResizeEvent | None = None) -> None:
        """Adapt the label to the available length."""
        # pyqtgraph also calls this method before the object is initialised.
        if getattr(self, "axis", None) is not None and self.label is not None:
            self._fit_label()
        super().resizeEvent(event)

    def paint(self, painter: QPainter, *_: object) -> None:
        """Paint directly; pyqtgraph would paint via a QPicture, which looks up the font for every label."""
        self.levels = ()
        specs = self.generateDrawSpecs(painter)
        if specs is not None:
            self.drawPicture(painter, *specs)

    def show_nothing(self) -> None:
        """Hide numbers and label, because the plot below shows them for both plots."""
        self.setStyle(showValues=False)
        self.showLabel(False)

    def blank(self, blankness: Blankness) -> None:
        """Hide the numbers of the axis while the plot is empty, or show the numbers again."""
        if blankness is not self._blankness:
            self._blankness = blankness
            self.update()

    def labelString(self) -> str:
        """Return the label with HTML escaped, because units come from files."""
        style = "; ".join(f"{name}: {value}" for name, value in self.labelStyle.items())
        return f"<span style='{style}'>{escape(printable(self.labelText))}</span>"

    def showLabel(self, show: bool = True) -> None:  # noqa: FBT001, FBT002 - pyqtgraph's own
        """Show or hide the label; ignore pyqtgraph's own call when only the text changes."""
        if not getattr(self, "_is_fitting", False):
            self._is_labelled = show
        super().showLabel(show and self._is_labelled)

    def _fit_label(self) -> None:
        room = self.size().height() if self._is_upright else self.size().width()
        metrics = QFontMetricsF(self.label.font())
        texts = (self.axis.text, self.axis.short_text, "")
        text = next(each for each in texts if metrics.horizontalAdvance(each) <= room or not each)
        if text != self.labelText:
            self._is_fitting = True
            self.setLabel(text)
            self._is_fitting = False

    @property
    def _is_upright(self) -> bool:
        return self.orientation in ("left", "right")

    def tickValues(self, low: float, high: float, size: float) -> list[tuple[float, list[float]]]:
        """Return the coordinates of the ticks: major ticks have a number, minor ticks do not."""
        found = self._ticks(low, high, size)
        self.levels = tuple([each for each in places if low <= each <= high] for _, places in found)
        return found

    def _ticks(self, low: float, high: float, size: float) -> list[tuple[float, list[float]]]:
        if not self.logMode:
            factor = self.axis.display.per_si
            # Return only ticks with numbers, because every further grid line takes time in every frame.
            levels = super().tickValues(low * factor, high * factor, size)
            step, values = next((each for each in levels if len(each[1]) > 1), levels[-1])
            widest = max(super().tickStrings(values, 1.0, step), key=len, default="")
            step, values = thin_ticks(step, values, self._most_labels(size, f"{widest}0"))
            return [(step / factor, [value / factor for value in values])]
        shift = log10(self.axis.display.per_si)
        ticks = logarithmic_ticks(low + shift, high + shift)
        if len(ticks[0][1]) > self._most_labels(size):
            ticks = [thin_ticks(1.0, ticks[0][1], self._most_labels(size)), *ticks[1:]]
        return [(step, [value - shift for value in values]) for step, values in ticks]

    def tickStrings(self, values: Sequence[float], scale: float, spacing: float) -> list[str]:
        """Return the numbers at ticks, as text."""
        if self._blankness is Blankness.BLANK or (self.logMode and spacing == _MINOR):
            return [""] * len(values)
        if not self.logMode:
            factor = self.axis.display.per_si
            return list(super().tickStrings([v * factor for v in values], scale, spacing * factor))
        factor = self.axis.display.per_si
        return [number_text(10**value * factor) for value in values]

    def _most_labels(self, size: float, widest: str = _WIDE) -> int:
        metrics = QFontMetricsF(self.font())
        each = _LINE_DISTANCE * metrics.height() if self._is_upright else metrics.horizontalAdvance(widest)
        return max(2, int(size / each))


def thin_ticks(step: float, values: Sequence[float], most: int) -> tuple[float, list[float]]:
    """Return a larger step, and the ticks at its multiples, of which there are at most ``most``.

    An axis needs two numbers. If fewer than two are left, return the two outermost ticks of the smaller step.
    """
    wider, kept = step, list(values)
    for every in (1, 2, 5, 10, 20, 50, 100):
        before, narrower = kept, wider
        wider = every * step
        kept = [value for value in values if abs(value / wider - round(value / wider)) < 1e-6]
        if len(kept) <= most:
            break
    few = 2
    return (wider, kept) if len(kept) >= min(few, len(values)) else (narrower, [before[0], before[-1]])


def logarithmic_ticks(low: float, high: float) -> list[tuple[float, list[float]]]:
    """Return the ticks of a logarithmic axis: 1-2-5 per decade, or even spacing within a decade."""
    if high - low < 1.0:
        return [(0.1, _even(10**low, 10**high))]
    decades = range(floor(low), ceil(high) + 1)
    few = 5.0
    mantissas = (1, 2, 5) if high - low < few else (1,)
    major = [log10(m) + d for d in decades for m in mantissas if low <= log10(m) + d <= high]
    minor = [
        log10(m) + d
        for d in decades
        for m in range(1, 10)
        if m not in mantissas and low <= log10(m) + d <= high
    ]
    return [(1.0, major), (_MINOR, minor)]


def _even(low: float, high: float) -> list[float]:
    """Return the decimal logarithms of evenly spaced round numbers in a range."""
    rough = (high - low) / 6
    decade = 10 ** floor(log10(rough))
    step = next(m * decade for m in (1, 2, 5, 10) if m * decade >= rough)
    edge = 1e-9  # a round limit gets a tick in spite of rounding errors
    first, last = ceil(low / step - edge), floor(high / step + edge)
    return [log10(n * step) for n in range(first, last + 1) if n > 0]


def number_text(value: float) -> str:
    """Return the number at a tick as text: 10, 100, 1k, 20k; a power of ten for many zeros."""
    smallest, thousand, million = 1e-3, 1e3, 1e6
    if value == 0 or smallest <= abs(value) < thousand:
        return f"{value:.6g}"
    if thousand <= abs(value) < million:
        return f"{value / thousand:.6g}k"
    exponent = floor(log10(abs(value)) + 1e-9)
    mantissa = value / 10**exponent
    power = "10" + str(exponent).translate(_RAISED)
    return power if abs(mantissa - 1) < 1e-6 else f"{mantissa:.3g}·{power}"


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_ABOVE = 100
"""Drawing order above the curves, so that filled areas do not hide the grid."""
_OPACITY = 0.25
"""Opacity of grid lines at ticks with numbers; lines at other ticks are fainter."""
_APART = 20.0
"""Smallest spacing of grid lines with full opacity [pixels]; denser lines are fainter."""


class Grid(pg.UIGraphicsItem):  # type: ignore[misc] # untyped library
    """Grid lines over the whole plot.

    They replace pyqtgraph's grid, which blends an image of the size of the plot in every frame.
    """

    def __init__(self, across: AxisItem, up: AxisItem) -> None:
        super().__init__()
        self._across, self._up = across, up
        self._colour = QColor()
        self.setZValue(_ABOVE)

    def dress(self, theme: Theme) -> None:
        """Change the colours."""
        self._colour = QColor(theme.line)
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Draw the grid lines at the ticks that the axes have just painted."""
        to_pixels = painter.transform()
        visible = to_pixels.mapRect(self.boundingRect())
        painter.resetTransform()
        for level, places in enumerate(self._across.levels):
            painter.setPen(self._shade(level, visible.width() / (len(places) + 1)))
            columns = (place * to_pixels.m11() + to_pixels.m31() for place in places)
            painter.drawLines([QLineF(at, visible.top(), at, visible.bottom()) for at in columns])
        for level, places in enumerate(self._up.levels):
            painter.setPen(self._shade(level, visible.height() / (len(places) + 1)))
            rows = (place * to_pixels.m22() + to_pixels.m32() for place in places)
            painter.drawLines([QLineF(visible.left(), at, visible.right(), at) for at in rows])

    def _shade(self, level: int, apart: float) -> QColor:
        shade = QColor(self._colour)
        shade.setAlphaF(_OPACITY / (level + 1) * min(1.0, apart / _APART))
        return shade
