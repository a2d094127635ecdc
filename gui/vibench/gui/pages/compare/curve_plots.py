"""Two plots over one frequency axis: the curves with their bounds, and the difference of two of them."""

from math import isfinite, log10

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QAbstractItemView, QSplitter, QTableWidgetItem, QVBoxLayout, QWidget

from vibench.analysis import Curve, CurveDifference, CurveOrigin, curve_peaks, readings

from ...plots.axis import LOG_FREQUENCY, PlotAxis, Scale
from ...plots.line_style import GUIDE, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled
from ...widgets.read_table import ReadTable
from ...widgets.theme import Theme

MAGNITUDE = PlotAxis("Motion of m0 over base, |x / U|", short="|x / U|", scale=Scale.LOGARITHMIC)
DIFFERENCE = PlotAxis("Difference", "dB")
_MARKER = LineStyle(lambda theme: theme.accent)
_BAND, _BAND_COLUMNS = 0.16, 300
_DOTS = {CurveOrigin.MEASURED: 10, CurveOrigin.SIMULATED: 6}
_OTHER_DOTS = 4


class CurvePlots(QWidget):
    """The picture of a comparison, with two markers that can be moved."""

    markers_moved = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.magnitudes = Plot("Curves over frequency", LOG_FREQUENCY, MAGNITUDE, theme).with_hint(
            "Add recordings, or lay a prediction of the Simulate page over them: "
            "their curves appear here, and their peaks below."
        )
        self.differences = Plot("Difference over frequency", LOG_FREQUENCY, DIFFERENCE, theme).with_hint(
            "Choose a curve and what it is compared with, at the left."
        )
        self.differences.always_numbered().setXLink(self.magnitudes)
        # One frequency axis for both: the lower one's.
        self.magnitudes.across.show_nothing()
        splitter = QSplitter(Qt.Orientation.Vertical)
        splitter.setAccessibleName("Curves and their difference")
        splitter.addWidget(self.magnitudes)
        splitter.addWidget(self.differences)
        splitter.setSizes([500, 170])
        filled(QVBoxLayout(self), splitter, margin=0)
        self._marker_hz: list[float] = [100.0, 300.0]
        self._are_marked = False
        self._lines: list[tuple[pg.InfiniteLine, pg.InfiniteLine]] = []

    @property
    def markers_hz(self) -> tuple[float, ...]:
        """Frequencies of the markers, none when they are hidden."""
        return tuple(sorted(self._marker_hz)) if self._are_marked else ()

    def show_curves(
        self, curves: tuple[tuple[Curve, LineStyle], ...], difference: CurveDifference | None
    ) -> None:
        """Draw anew."""
        for plot in (self.magnitudes, self.differences):
            plot.wipe()
        for curve, line_style in curves:
            self._draw(curve, line_style)
        self.differences.level(GUIDE, 0.0)
        if difference is not None:
            line = self.differences.curve(curve_style(0))
            line.setData(difference.frequency_hz, difference.decibel, connect="finite")
        self._add_markers()

    def show_markers(self, are_shown: bool) -> None:  # noqa: FBT001 - as Qt's own toggled(bool)
        """Show or hide the markers; they come into what is in sight."""
        self._are_marked = are_shown
        low, high = self.magnitudes.getViewBox().viewRange()[0]
        if are_shown and not all(low <= log10(each) <= high for each in self._marker_hz):
            self._marker_hz = [10 ** (low + (high - low) * share) for share in (1 / 3, 2 / 3)]
        self._place_markers()

    def put_marker(self, number: int, frequency_hz: float) -> None:
        """Move a marker."""
        self._marker_hz[number] = frequency_hz
        self._place_markers()

    def _draw(self, curve: Curve, line_style: LineStyle) -> None:
        lone = curve.frequency_hz.size == 1
        if lone:
            self.magnitudes.dots(line_style, curve.name, size=_DOTS.get(curve.origin, _OTHER_DOTS)).setData(
                curve.frequency_hz, curve.magnitude
            )
            return
        if np.isfinite(curve.relative_sd).any():
            shade = LineStyle(line_style.colour, Dash.SOLID, _BAND)
            self.magnitudes.band(shade, curve.name).set_data(*curve.band(_BAND_COLUMNS))
        line = self.magnitudes.curve(line_style, curve.name)
        line.setData(curve.frequency_hz, curve.magnitude, connect="finite")

    def _add_markers(self) -> None:
        self._lines = []
        for number in range(2):
            pair = tuple(
                plot.upright(_MARKER, self._marker_hz[number]) for plot in (self.magnitudes, self.differences)
            )
            for line in pair:
                line.setMovable(True)
                line.sigPositionChanged.connect(
                    lambda moved, number=number: self._moved(number, moved.value())
                )
            self._lines.append((pair[0], pair[1]))
        self._place_markers()

    def _place_markers(self) -> None:
        for number, pair in enumerate(self._lines):
            for line in pair:
                line.setVisible(self._are_marked)
                line.setValue(log10(self._marker_hz[number]))
        self.markers_moved.emit()

    def _moved(self, number: int, place: float) -> None:
        if not self._are_marked or abs(log10(self._marker_hz[number]) - place) < 1e-12:
            return
        self._marker_hz[number] = 10**place
        self._place_markers()


PEAK_HEADINGS = (
    "Curve",
    "Peak at (Hz)",
    "|x / U|",
    "±",
    "Width at -3 dB (Hz)",
    "Damping ratio if linear (%)",
)

_LEAST_LETTERS = 12
"""Of a column; in a small window the others are scrolled to."""


class NumberTable(ReadTable):
    """A table to read and to copy, with other headings each time; names take the room that is left."""

    def __init__(self, name: str, hint: str) -> None:
        super().__init__(name, PEAK_HEADINGS[:1], hint)
        self.setShowGrid(True)
        self.horizontalHeader().setMinimumSectionSize(_LEAST_LETTERS * self.fontMetrics().averageCharWidth())
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectItems)

    def show_numbers(self, headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
        """Show other numbers."""
        self.setColumnCount(len(headings))
        self.setHorizontalHeaderLabels(list(headings))
        self.show_rows(rows)
        for row in range(len(rows)):
            for column in range(1, len(headings)):
                item = self.item(row, column)
                if isinstance(item, QTableWidgetItem):
                    item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)


def peak_rows(curves: tuple[Curve, ...]) -> list[tuple[str, ...]]:
    """Write the peaks of curves."""
    return [
        (
            each.name,
            f"{peak.frequency_hz:.2f}",
            f"{peak.magnitude:.4g}",
            _number(2 * peak.relative_sd * peak.magnitude, ".2g"),
            "–" if peak.half_power_width_hz is None else f"{peak.half_power_width_hz:.3g}",
            "–" if peak.damping_ratio is None else f"{100 * peak.damping_ratio:.3g}",
        )
        for each in curves
        for peak in curve_peaks(each)
    ]


def marker_headings(markers_hz: tuple[float, ...]) -> tuple[str, ...]:
    """Write where the markers stand."""
    at = tuple(f"|x / U| at {each:.2f} Hz" for each in markers_hz)
    return ("Curve", *at, *(("Second over first (dB)",) if len(at) == 2 else ()))


def marker_rows(curves: tuple[Curve, ...], markers_hz: tuple[float, ...]) -> list[tuple[str, ...]]:
    """Read curves at the markers."""
    if not markers_hz:
        return []
    return [
        (each.name, *(_number(value, ".4g") for value in each.magnitudes), _number(each.decibel, "+.2f"))
        for each in readings(curves, markers_hz)
    ]


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if isfinite(value) else "–"
