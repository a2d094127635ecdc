"""Numbers beside the picture: the peaks of every curve, and the curves' values at the markers."""

from math import isfinite

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractItemView, QTableWidgetItem

from vibench.analysis import Curve, curve_peaks, readings

from ...widgets.read_table import ReadTable

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
