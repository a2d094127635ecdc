"""Axes with their unit in the label, 1-2-5 ticks where they are logarithmic, and a grid of all ticks."""

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
    """How values are laid out along an axis."""

    LINEAR = auto()
    LOGARITHMIC = auto()


class Blankness(Enum):
    """Whether numbers are written along an axis."""

    WRITTEN = auto()
    BLANK = auto()


@dataclass(frozen=True)
class PlotAxis:
    """What an axis shows."""

    label: str
    unit: str = ""
    """Of what is plotted, in SI, where people choose what it is shown in; else as written on the label."""
    factor: float = 1.0
    """Shown value per plotted value, where there is no choice: 1e3 shows seconds as milliseconds."""
    scale: Scale = Scale.LINEAR
    short: str = ""
    """What stands there, with the unit, where the label has no room."""

    @property
    def shown(self) -> ShownUnit:
        """The unit that is written, and how many of it one of the plotted values is."""
        return UNITS.on_axis(self.unit) if self.unit in CHOICES else ShownUnit(self.unit, self.factor)

    @property
    def text(self) -> str:
        """Label and unit."""
        return self._with_unit(self.label)

    @property
    def short_text(self) -> str:
        """Text for little room: a short label, or the unit alone."""
        return self._with_unit(self.short) if self.short else self.shown.name

    def _with_unit(self, label: str) -> str:
        unit = self.shown.name
        return f"{label} ({unit})" if label and unit else label or unit


FREQUENCY = PlotAxis("Frequency", "Hz")
LOG_FREQUENCY = PlotAxis("Frequency", "Hz", scale=Scale.LOGARITHMIC)
TIME = PlotAxis("Time", "s")
_LINE_DISTANCE = 1.25
"""From one label to that above it, in heights of the font."""
_MINOR = 0.01
"""Distance reported for ticks without a number."""
_WIDE = "2000"
"""A label and the room beside it, on a logarithmic axis across."""


class AxisItem(pg.AxisItem):  # type: ignore[misc] # untyped library
    """An axis of a plot; in logarithmic mode positions are powers of ten."""

    def __init__(self, orientation: str, axis: PlotAxis) -> None:
        super().__init__(orientation)
        self._blankness = Blankness.WRITTEN
        self.levels: tuple[list[float], ...] = ()
        """Places of the ticks that were painted last, major ones first."""
        self.enableAutoSIPrefix(False)
        self.setLabel(axis.text)
        self._axis = axis
        UNITS.on_change(self._show_other_unit)
        # Painted when it changes, and copied otherwise: its text is the dearest part of a frame.
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)

    @property
    def axis(self) -> PlotAxis:
        """What it shows."""
        return self._axis

    def show_unit(self, axis: PlotAxis) -> None:
        """Change what the axis shows."""
        self._axis = axis
        self._show_other_unit()

    def _show_other_unit(self) -> None:
        # pyqtgraph takes the label of a closed plot away.
        if self.label is not None:
            self._fit_label()
            self.update()

    def resizeEvent(self, event: QGraphicsSceneResizeEvent | None = None) -> None:
        """Write as much of the label as there is room for."""
        # pyqtgraph calls this before the item is whole.
        if getattr(self, "_axis", None) is not None and self.label is not None:
            self._fit_label()
        super().resizeEvent(event)

    def paint(self, painter: QPainter, *_: object) -> None:
        """Draw at once: pyqtgraph's way, by a QPicture, looks for the font again with every label."""
        self.levels = ()
        specs = self.generateDrawSpecs(painter)
        if specs is not None:
            self.drawPicture(painter, *specs)

    def show_nothing(self) -> None:
        """Leave numbers and label to the axis of the plot below."""
        self.setStyle(showValues=False)
        self.showLabel(False)

    def blank(self, blankness: Blankness) -> None:
        """Write no numbers while there is nothing that they could be about."""
        if blankness is not self._blankness:
            self._blankness = blankness
            self.update()

    def labelString(self) -> str:
        """Show units of files as they are written: pyqtgraph takes the label as HTML."""
        style = "; ".join(f"{name}: {value}" for name, value in self.labelStyle.items())
        return f"<span style='{style}'>{escape(printable(self.labelText))}</span>"

    def showLabel(self, show: bool = True) -> None:  # noqa: FBT001, FBT002 - pyqtgraph's own
        """Show the label or not; to write another text, which shows it, does not count."""
        if not getattr(self, "_is_fitting", False):
            self._is_labelled = show
        super().showLabel(show and self._is_labelled)

    def _fit_label(self) -> None:
        room = self.size().height() if self._is_upright else self.size().width()
        metrics = QFontMetricsF(self.label.font())
        texts = (self._axis.text, self._axis.short_text, "")
        text = next(each for each in texts if metrics.horizontalAdvance(each) <= room or not each)
        if text != self.labelText:
            self._is_fitting = True
            self.setLabel(text)
            self._is_fitting = False

    @property
    def _is_upright(self) -> bool:
        return self.orientation in ("left", "right")

    def tickValues(self, low: float, high: float, size: float) -> list[tuple[float, list[float]]]:
        """Choose the places of ticks: major ones carry a label, minor ones do not."""
        found = self._ticks(low, high, size)
        self.levels = tuple([each for each in places if low <= each <= high] for _, places in found)
        return found

    def _ticks(self, low: float, high: float, size: float) -> list[tuple[float, list[float]]]:
        if not self.logMode:
            factor = self._axis.shown.per_si
            # One labelled level alone: each line of a grid costs time in every frame.
            levels = super().tickValues(low * factor, high * factor, size)
            step, values = next((each for each in levels if len(each[1]) > 1), levels[-1])
            if self._is_upright:
                step, values = thinned(step, values, self._most_labels(size))
            return [(step / factor, [value / factor for value in values])]
        shift = log10(self._axis.shown.per_si)
        ticks = logarithmic_ticks(low + shift, high + shift)
        if len(ticks[0][1]) > self._most_labels(size):
            ticks = [thinned(1.0, ticks[0][1], self._most_labels(size)), *ticks[1:]]
        return [(step, [value - shift for value in values]) for step, values in ticks]

    def tickStrings(self, values: Sequence[float], scale: float, spacing: float) -> list[str]:
        """Write the labels of ticks."""
        if self._blankness is Blankness.BLANK or (self.logMode and spacing == _MINOR):
            return [""] * len(values)
        if not self.logMode:
            factor = self._axis.shown.per_si
            return list(super().tickStrings([v * factor for v in values], scale, spacing * factor))
        factor = self._axis.shown.per_si
        return [number_text(10**value * factor) for value in values]

    def _most_labels(self, size: float) -> int:
        """How many labels find room above or beside one another."""
        metrics = QFontMetricsF(self.font())
        each = _LINE_DISTANCE * metrics.height() if self._is_upright else metrics.horizontalAdvance(_WIDE)
        return max(2, int(size / each))


def thinned(step: float, values: Sequence[float], most: int) -> tuple[float, list[float]]:
    """Leave out ticks between multiples of a larger step, until no more than ``most`` are left.

    One number alone says no scale: the outermost two of the step before are kept then.
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
    """Places of ticks between two powers of ten: 1-2-5 over decades, evenly spaced numbers within one."""
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
    """Powers of round numbers at equal distances."""
    rough = (high - low) / 6
    decade = 10 ** floor(log10(rough))
    step = next(m * decade for m in (1, 2, 5, 10) if m * decade >= rough)
    edge = 1e-9  # An end that is a round number except for rounding gets its tick.
    first, last = ceil(low / step - edge), floor(high / step + edge)
    return [log10(n * step) for n in range(first, last + 1) if n > 0]


def number_text(value: float) -> str:
    """Write a number for a tick: 10, 100, 1k, 20k; powers of ten where zeros would be counted."""
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
"""Over the curves: an area that they fill is read by it."""
_OPACITY = 0.25
"""Opacity of the lines that are labelled; each level after them has a part of it."""
_APART = 20.0
"""Pixels from line to line; lines that are closer are fainter."""


class Grid(pg.UIGraphicsItem):  # type: ignore[misc] # untyped library
    """Lines over the whole picture.

    pyqtgraph lets the axes draw them. These keep a copy of what they paint, which would be as large
    as the picture, twice, and be overlaid on it in every frame.
    """

    def __init__(self, across: AxisItem, up: AxisItem) -> None:
        super().__init__()
        self._across, self._up = across, up
        self._colour = QColor()
        self.setZValue(_ABOVE)

    def dress(self, theme: Theme) -> None:
        """Draw in other colours."""
        self._colour = QColor(theme.line)
        self.update()

    def paint(self, painter: QPainter, *_: object) -> None:
        """Draw the lines of the ticks that the axes have painted just before."""
        to_pixels = painter.transform()
        seen = to_pixels.mapRect(self.boundingRect())
        painter.resetTransform()
        for level, places in enumerate(self._across.levels):
            painter.setPen(self._shade(level, seen.width() / (len(places) + 1)))
            columns = (place * to_pixels.m11() + to_pixels.m31() for place in places)
            painter.drawLines([QLineF(at, seen.top(), at, seen.bottom()) for at in columns])
        for level, places in enumerate(self._up.levels):
            painter.setPen(self._shade(level, seen.height() / (len(places) + 1)))
            rows = (place * to_pixels.m22() + to_pixels.m32() for place in places)
            painter.drawLines([QLineF(seen.left(), at, seen.right(), at) for at in rows])

    def _shade(self, level: int, apart: float) -> QColor:
        shade = QColor(self._colour)
        shade.setAlphaF(_OPACITY / (level + 1) * min(1.0, apart / _APART))
        return shade
