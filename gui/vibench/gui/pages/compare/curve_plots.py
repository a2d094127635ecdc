"""Two plots with a common frequency axis: curves with their bounds, and the difference of two curves."""

from collections.abc import Callable
from functools import lru_cache
from math import isfinite

import numpy as np
from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QGuiApplication, QPainter, QPaintEvent, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFormLayout,
    QGroupBox,
    QListWidget,
    QListWidgetItem,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition import printable
from vibench.analysis import (
    AnalysisError,
    Curve,
    CurveDifference,
    CurveKind,
    CurveOrigin,
    curve_difference,
    curve_peaks,
    readings,
)

from ...forms.editor import Choice
from ...plots.axis import LOG_FREQUENCY, PlotAxis, Scale
from ...plots.line_style import GUIDE, Dash, LineStyle, curve_style, dashed_pen
from ...plots.plot import Plot
from ...plots.plot_stack import Markers
from ...widgets.boxes import fill_box, hint_in_list, label_for, plain_tip, splitter
from ...widgets.read_table import ReadTable
from ...widgets.theme import Theme
from ...widgets.units import UNITS, SentenceLabel

MAGNITUDE = PlotAxis("Motion of m0 over base, |x / U|", short="|x / U|", scale=Scale.LOGARITHMIC)
DIFFERENCE = PlotAxis("Difference", "dB")
_BAND, _BAND_COLUMNS = 0.16, 300
_DOTS = {CurveOrigin.MEASURED: 10, CurveOrigin.SIMULATED: 6}
_OTHER_DOTS = 4


class CurvePlots(QWidget):
    """Plots of a comparison, with two markers that the user can move."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.magnitudes = Plot("Curves over frequency", LOG_FREQUENCY, MAGNITUDE, theme).with_hint(
            "Add recordings, or a prediction from the Simulate page. Their peaks are listed below the curves."
        )
        self.differences = Plot("Difference over frequency", LOG_FREQUENCY, DIFFERENCE, theme).with_hint(
            "Select a curve and its reference on the left."
        )
        self.differences.keep_numbers().setXLink(self.magnitudes)
        # The lower plot labels the frequency axis for both plots.
        self.magnitudes.across.show_nothing()
        parts = splitter("Curves and their difference", self.magnitudes, self.differences, (500, 170))
        fill_box(QVBoxLayout(self), parts, margin=0)
        self.markers = Markers(100.0, 300.0, self)

    def show_curves(
        self, curves: tuple[tuple[Curve, LineStyle], ...], difference: CurveDifference | None
    ) -> None:
        """Draw curves and, if given, their difference."""
        for plot in (self.magnitudes, self.differences):
            plot.wipe()
        for curve, line_style in curves:
            self._draw(curve, line_style)
        self.differences.level(GUIDE, 0.0)
        if difference is not None:
            line = self.differences.curve(curve_style(0))
            line.setData(difference.frequency_hz, difference.decibel, connect="finite")
        self.markers.draw_in((self.magnitudes, self.differences))

    def _draw(self, curve: Curve, line_style: LineStyle) -> None:
        if curve.frequency_hz.size == 1:
            self.magnitudes.dots(line_style, curve.name, size=_DOTS.get(curve.origin, _OTHER_DOTS)).setData(
                curve.frequency_hz, curve.magnitude
            )
            return
        if np.isfinite(curve.relative_sd).any():
            shade = LineStyle(line_style.colour, Dash.SOLID, _BAND)
            self.magnitudes.band(shade, curve.name).set_data(*curve.band(_BAND_COLUMNS))
        line = self.magnitudes.curve(line_style, curve.name)
        line.setData(curve.frequency_hz, curve.magnitude, connect="finite")


PEAK_HEADINGS = (
    "Curve",
    "Peak at (Hz)",
    "|x / U|",
    "±",
    "Width at -3 dB (Hz)",
    "Damping ratio if linear (%)",
)


class NumberTable(ReadTable):
    """Read-only table with a variable number of columns; the first column takes the remaining width."""

    def __init__(self, name: str, hint: str) -> None:
        super().__init__(name, PEAK_HEADINGS[:1], hint)
        self.setShowGrid(True)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectItems)

    def show_numbers(self, headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
        """Replace the columns and rows of the table."""
        self.setColumnCount(len(headings))
        self.setHorizontalHeaderLabels(list(headings))
        self.show_rows(rows)
        for row in range(len(rows)):
            for column in range(1, len(headings)):
                item = self.item(row, column)
                if isinstance(item, QTableWidgetItem):
                    item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)


def peak_rows(curves: tuple[Curve, ...]) -> list[tuple[str, ...]]:
    """Return table rows with the peaks of curves."""
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
        for peak in _peaks(each)
    ]


# Cache the peaks: a chaotic curve has thousands of peaks, needed each time a curve is selected.
_peaks = lru_cache(maxsize=64)(curve_peaks)


def marker_headings(markers_hz: tuple[float, ...]) -> tuple[str, ...]:
    """Return column headings with the marker frequencies."""
    at = tuple(f"|x / U| at {each:.2f} Hz" for each in markers_hz)
    return ("Curve", *at, *(("Second over first (dB)",) if len(at) == 2 else ()))


def marker_rows(curves: tuple[Curve, ...], markers_hz: tuple[float, ...]) -> list[tuple[str, ...]]:
    """Return table rows with the values of curves at the markers."""
    if not markers_hz:
        return []
    return [
        (each.name, *(_number(value, ".4g") for value in each.magnitudes), _number(each.decibel, "+.2f"))
        for each in readings(curves, markers_hz)
    ]


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if isfinite(value) else "–"


_DASHES = {
    CurveOrigin.MEASURED: (Dash.SOLID, Dash.DOTTED),
    CurveOrigin.SIMULATED: (Dash.DASHED, Dash.DASH_DOTTED),
    CurveOrigin.PREDICTED: (Dash.LONG, Dash.DASH_DOT_DOTTED),
    CurveOrigin.STABLE: (Dash.SOLID, Dash.DOTTED),
    CurveOrigin.UNSTABLE: (Dash.DASHED, Dash.DASH_DOTTED),
    CurveOrigin.UNDECIDED: (Dash.LONG, Dash.DASH_DOT_DOTTED),
}
"""Dash patterns by origin of a curve: first for transmissibility or Response I, then for Response II."""
_SHOWN_FIRST = {CurveKind.TRANSMISSIBILITY, CurveKind.RESPONSE_I}
"""Kinds of curves visible at first; Response II is hidden, because without contact it equals Response I."""
_SWATCH = (28, 12)


class CurveList(QListWidget):
    """List of curves with check boxes; colour shows the source of a curve, dashes show its kind."""

    changed = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.setAccessibleName("Curves")
        self.setSelectionMode(QListWidget.SelectionMode.ExtendedSelection)
        self.setWordWrap(True)
        self._theme = theme
        self.curves: tuple[Curve, ...] = ()
        """All curves of the list, ticked or not."""
        self.itemChanged.connect(lambda _item: self.changed.emit())
        UNITS.on_change(self._show_units)

    def ticked_curves(self) -> tuple[tuple[Curve, LineStyle], ...]:
        """Return the ticked curves with their line styles."""
        return tuple(
            (each, self.line_style(each))
            for row, each in enumerate(self.curves)
            if self.item(row).checkState() is Qt.CheckState.Checked
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw a hint while the list is empty."""
        super().paintEvent(event)
        if not self.curves:
            hint_in_list(self, "No curves yet: add recordings, or overlay a simulation.")

    def line_style(self, curve: Curve) -> LineStyle:
        """Return the line style of a curve: its source gives the colour, its kind gives the dash pattern."""
        sources = list(dict.fromkeys(each.source for each in self.curves))
        first, second = _DASHES[curve.origin]
        dash = second if curve.response is CurveKind.RESPONSE_II else first
        return curve_style(sources.index(curve.source), dash)

    def replace_source(self, source: str, curves: tuple[Curve, ...]) -> None:
        """Replace the curves of one recording or prediction by new curves."""
        ticked = {each.name for each, _ in self.ticked_curves()}
        known = {each.name for each in self.curves}
        others = [each for each in self.curves if not _is_of(each, source)]
        place = next((n for n, each in enumerate(self.curves) if _is_of(each, source)), len(others))
        place = min(place, len(others))
        self.curves = (*others[:place], *curves, *others[place:])
        self._list(
            lambda each: each.name in ticked or (each.name not in known and each.response in _SHOWN_FIRST)
        )

    def remove_chosen(self) -> tuple[str, ...]:
        """Remove the selected curves; return the sources that have no curve left."""
        before = {each.source for each in self.curves}
        ticked = {each.name for each, _ in self.ticked_curves()}
        rows = {index.row() for index in self.selectedIndexes()}
        self.curves = tuple(each for row, each in enumerate(self.curves) if row not in rows)
        self._list(lambda each: each.name in ticked)
        return tuple(before - {each.source for each in self.curves})

    def tick(self, name: str, state: Qt.CheckState) -> None:
        """Show or hide the curve ``name``."""
        for row, each in enumerate(self.curves):
            if each.name == name:
                self.item(row).setCheckState(state)

    def retheme(self, theme: Theme) -> None:
        """Redraw the line samples of all curves in the colours of another theme."""
        self._theme = theme
        with QSignalBlocker(self):
            for row, each in enumerate(self.curves):
                self.item(row).setIcon(_swatch(self.line_style(each), theme))

    def _show_units(self) -> None:
        ticked = {each.name for each, _ in self.ticked_curves()}
        self._list(lambda each: each.name in ticked)

    def _list(self, is_ticked: Callable[[Curve], bool]) -> None:
        with QSignalBlocker(self):
            self.clear()
            for each in self.curves:
                item = QListWidgetItem(_name(each))
                item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
                wanted = is_ticked(each)
                item.setCheckState(Qt.CheckState.Checked if wanted else Qt.CheckState.Unchecked)
                item.setToolTip(plain_tip(UNITS.convert(each.note)))
                item.setIcon(_swatch(self.line_style(each), self._theme))
                self.addItem(item)
        self.changed.emit()


def _name(each: Curve) -> str:
    return printable(UNITS.convert(each.name))


def _is_of(each: Curve, source: str) -> bool:
    """Return whether a curve belongs to a source; steps up and steps down of a recording are two sources."""
    return each.source == source or each.source in (f"{source} up", f"{source} down")


def _swatch(line_style: LineStyle, theme: Theme) -> QPixmap:
    ratio = QGuiApplication.primaryScreen().devicePixelRatio()
    picture = QPixmap(QSize(*_SWATCH) * ratio)
    picture.setDevicePixelRatio(ratio)
    picture.fill(QColor(theme.base))
    painter = QPainter(picture)
    painter.setPen(dashed_pen(line_style.colour(theme), 2, line_style.dash))
    painter.drawLine(1, _SWATCH[1] // 2, _SWATCH[0] - 1, _SWATCH[1] // 2)
    painter.end()
    return picture


def _caution(curve: Curve, reference: Curve) -> str:
    """Return a warning if base levels differ, because with contact the response depends on the level."""
    levels = (curve.level_m, reference.level_m)
    if levels[0] == levels[1]:
        return ""
    texts = ["as driven" if each is None else f"{1e6 * each:.4g} µm" for each in levels]
    return f". ⚠ Base levels: {texts[0]} and {texts[1]}; with contact, the response depends on the level"


_NOBODY = "– nothing –"


class PairBox(QGroupBox):
    """Two lists to choose a curve and its reference; by default the second and the first visible curve."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__("Difference in dB")
        self._curves: dict[str, Curve] = {}
        self._curve, self._reference, self.summary = Choice(), Choice(), SentenceLabel(rank="second")
        form = QFormLayout(self)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for text, choice in (("C&urve", self._curve), ("Ov&er", self._reference)):
            choice.setMinimumContentsLength(16)
            choice.currentIndexChanged.connect(lambda _index: self.changed.emit())
            form.addRow(label_for(text, choice, f"Difference: {text.replace('&', '').lower()}"), choice)
        form.addRow(self.summary)

    def offer(self, curves: tuple[Curve, ...], shown: tuple[Curve, ...]) -> None:
        """Offer these curves for selection; keep the present selection if possible."""
        self._curves = {_name(each): each for each in curves}
        names = list(self._curves)
        for place, box in enumerate((self._reference, self._curve)):
            if names == [box.itemText(number) for number in range(1, box.count())]:
                continue
            chosen = box.currentText()
            default = _name(shown[place]) if len(shown) > 1 else _NOBODY
            box.replace_items([_NOBODY, *names], chosen if chosen in names else default)

    def pair(self) -> tuple[Curve, Curve] | None:
        """Return the selected curve and its reference; None unless they are two different curves."""
        curve, reference = (self._curves.get(box.currentText()) for box in (self._curve, self._reference))
        return None if curve is None or reference is None or curve is reference else (curve, reference)

    def difference(self) -> CurveDifference | None:
        """Return the difference of the two curves, and describe it; None if the curves cannot be compared."""
        pair = self.pair()
        self.summary.setText("")
        if pair is None:
            return None
        try:
            found = curve_difference(*pair)
        except AnalysisError as error:
            self.summary.setText(str(error))
            return None
        self.summary.setText(
            f"Median {found.median_abs_db:.2g} dB, root mean square {found.rms_db:.2g} dB{_caution(*pair)}"
        )
        return found
