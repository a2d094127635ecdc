"""A sweep over the frequency really played, with the prediction and its collision regions beneath."""

from collections.abc import Mapping

import pyqtgraph as pg
from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis import MeasurementPrediction
from vibench.analysis.live import LiveView

from ...plots.axis import FREQUENCY, PlotAxis, Scale
from ...plots.line_style import PREDICTED, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled
from ...widgets.theme import Theme

Curves = Mapping[str, pg.PlotDataItem]
"""By the field that they show."""


def show_predicted(curves: Curves, seen: MeasurementPrediction | None) -> None:
    """Draw fields of a prediction over its frequencies, or none."""
    for name, curve in curves.items():
        if seen is None:
            curve.clear()
        else:
            curve.setData(seen.prediction.frequency_hz, getattr(seen.prediction, name))


class SweepPlot(QWidget):
    """Points of a sine or a sweep as it goes."""

    def __init__(self, tab: str, plot: Plot) -> None:
        super().__init__()
        self.title, self.tab, self.plot = plot.accessibleName(), tab, plot
        self._stripes = plot.stripes(LineStyle(lambda theme: theme.traces[3], filled=0.15))
        self.predicted: Curves = {}
        self.measured: Curves = {}
        self._shown = 0
        filled(QVBoxLayout(self), plot, margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw all points so far, in the order of time."""
        history = view.history()
        if len(history.time_s) == self._shown:
            return
        self._shown = len(history.time_s)
        for name, curve in self.measured.items():
            curve.setData(history.frequency_hz, getattr(history, name))

    def show_prediction(self, seen: MeasurementPrediction | None) -> None:
        """Lay a prediction beneath, and where it collides; or none."""
        self._stripes.show_bands(() if seen is None else seen.collision_bands_hz)
        show_predicted(self.predicted, seen)

    def clear(self) -> None:
        """Forget the last run."""
        self._shown = 0
        for curve in self.measured.values():
            curve.clear()


def sweep_history(theme: Theme) -> SweepPlot:
    """Make the plot of Responses I and II."""
    up = PlotAxis("Response I, II", "x / A0", scale=Scale.LOGARITHMIC)
    plot = Plot("Response over frequency", FREQUENCY, up, theme).with_legend()
    plot.with_hint("A point every tenth of a second of a dwell or a sweep; the prediction beneath.")
    made = SweepPlot("Responses", plot)
    made.predicted = {
        "response_i": plot.curve(PREDICTED, "I, simulated"),
        "response_ii": plot.curve(LineStyle(lambda theme: theme.traces[0], Dash.DOTTED), "II, simulated"),
        "linear": plot.curve(curve_style(2, Dash.DOTTED), "linear, simulated"),
    }
    made.measured = {
        "response_i": plot.dots(curve_style(3), "I, measured", 3),
        "response_ii": plot.dots(curve_style(0), "II, measured", 3),
    }
    return made


def sweep_envelope(theme: Theme) -> SweepPlot:
    """Make the plot of the extremes of m0's velocity."""
    plot = Plot("Sweep envelope", FREQUENCY, PlotAxis("m0 velocity", "m/s"), theme).with_legend()
    plot.with_hint("Largest and smallest velocity of m0 while a sweep passes by.")
    made = SweepPlot("Envelope", plot)
    made.measured = {
        "upper": plot.curve(curve_style(3), "largest"),
        "lower": plot.curve(curve_style(0), "smallest"),
    }
    return made
