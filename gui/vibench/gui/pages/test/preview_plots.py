"""The signal as it will be played, and what the specimen is predicted to do with it."""

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QTableWidgetItem, QWidget

from vibench.acquisition.plan import LimitCheck, LimitSide, MeasurementPreview

from ...plots.axis import FREQUENCY, LOG_FREQUENCY, TIME, PlotAxis, Scale
from ...plots.bar_delegate import SHARE_ROLE, BarDelegate
from ...plots.line_style import Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...plots.signal_curve import SignalCurve
from ...widgets.boxes import filled
from ...widgets.read_table import ReadTable
from ...widgets.theme import Theme
from ...widgets.units import fitted_unit

if TYPE_CHECKING:
    from vibench.analysis import MeasurementPrediction

COLLISION = LineStyle(lambda theme: theme.traces[3], filled=0.18)


class PredictionPlot(Plot):
    """Simulated, and labelled so: dashed lines, the model in the legend, collision regions as stripes."""

    def __init__(self, theme: Theme) -> None:
        up = PlotAxis("Response", "x / A0", scale=Scale.LOGARITHMIC)
        super().__init__("Predicted response and collision regions", FREQUENCY, up, theme)
        self.with_legend()
        self.with_hint("The specimen is being simulated under this test.")
        self._first = self.curve(
            LineStyle(lambda theme: theme.predicted, Dash.DASHED), "Response I, simulated"
        )
        self._second = self.curve(
            LineStyle(lambda theme: theme.traces[0], Dash.DOTTED), "Response II, simulated"
        )
        self._linear = self.curve(curve_style(2, Dash.DOTTED), "without contact")
        self._stripes = self.stripes(COLLISION)

    def show_prediction(self, seen: "MeasurementPrediction | None") -> None:
        """Draw a prediction; None clears the plot."""
        if seen is None:
            for curve in (self._first, self._second, self._linear):
                curve.clear()
        else:
            found = seen.prediction
            self._first.setData(found.frequency_hz, np.asarray(found.response_i))
            self._second.setData(found.frequency_hz, np.asarray(found.response_ii))
            self._linear.setData(found.frequency_hz, np.asarray(found.linear))
        self._stripes.show_bands(() if seen is None else seen.collision_bands_hz)
        self.show_everything()


_FLOOR = 1e-5
"""Lines this far below the highest are numerical dust."""
_LEAST_HZ = 1.0
"""Nothing below is of interest: no shaker moves there."""
_LEAST_LINES = 9
"""Of text: less says nothing."""


class PreviewPlots(QWidget):
    """Two plots side by side; a zoom into the time signal shows its samples."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.time = Plot("Signal at the generator, in time", TIME, PlotAxis("Generator", "V"), theme)
        self.spectrum = Plot(
            "Spectrum of the signal",
            LOG_FREQUENCY,
            PlotAxis("Amplitude", "V", scale=Scale.LOGARITHMIC),
            theme,
        )
        for plot in (self.time, self.spectrum):
            plot.setMinimumHeight(_LEAST_LINES * self.fontMetrics().height())
        self._signal = SignalCurve(self.time, curve_style(0))
        self._lines = self.spectrum.curve(curve_style(0))
        filled(QHBoxLayout(self), (self.time, 1), (self.spectrum, 1), margin=0)

    def show_preview(self, seen: MeasurementPreview) -> None:
        """Draw another signal."""
        self.time.show_everything()
        self._signal.set_samples(seen.volts, seen.sample_rate_hz)
        floor_v = _FLOOR * float(np.max(seen.spectrum_v))
        self.spectrum.show_everything()
        shown = seen.spectrum_hz >= min(_LEAST_HZ, float(seen.spectrum_hz[-1]))
        self._lines.setData(seen.spectrum_hz[shown], np.maximum(seen.spectrum_v[shown], floor_v))


_USED = 0
_LEAST_LETTERS = 10
_SIGNS = {LimitSide.AT_MOST: "≤", LimitSide.AT_LEAST: "≥"}


class LimitTable(ReadTable):
    """One row a limit, the most used first."""

    def __init__(self) -> None:
        super().__init__("Predicted loads and limits", ("used", "quantity", "predicted", "limit"), wide=1)
        self.setItemDelegateForColumn(_USED, BarDelegate(self))
        # In a small window the limits are scrolled to: what they are of must be read in any.
        self.horizontalHeader().setMinimumSectionSize(_LEAST_LETTERS * self.fontMetrics().averageCharWidth())

    def show_checks(self, checks: tuple[LimitCheck, ...]) -> None:
        """Show what was held against the rig."""
        units = [fitted_unit(check.unit, check.limit) for check in checks]
        self.show_rows(
            [
                (
                    f"{100 * check.use:.1f} %",
                    f"{_mark(check)}{_short(check.what)}",
                    unit.text(check.value),
                    f"{_SIGNS[check.side]} {unit.text(check.limit)}",
                )
                for check, unit in zip(checks, units, strict=True)
            ],
            [f"{check.what}\nLimit from: {check.source}{_remedy(check)}" for check in checks],
        )
        for row, check in enumerate(checks):
            item = self.item(row, _USED)
            if isinstance(item, QTableWidgetItem):
                item.setData(SHARE_ROLE, float(check.use))
                item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)


def _remedy(check: LimitCheck) -> str:
    return "" if check.is_kept else f"\nTo do: {check.remedy}"


def _mark(check: LimitCheck) -> str:
    if check.is_kept:
        return ""
    return "✖ " if check.forbids else "⚠ "


def _short(what: str) -> str:
    return what.removeprefix("the ").replace("(at ", "(").replace("(about, at ", "(about, ").replace("_", " ")
