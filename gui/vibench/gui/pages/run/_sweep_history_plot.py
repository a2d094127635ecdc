"""Responses against the frequency really played, with the prediction and its collision regions beneath."""

from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis import MeasurementPrediction
from vibench.analysis.live import LiveView

from ...plots import FREQUENCY, PREDICTED, Dash, LineStyle, Plot, PlotAxis, Scale, curve_style
from ...widgets import Theme, filled


class SweepHistoryPlot(QWidget):
    """Response I and II of a sine or a sweep as it goes."""

    title = "Response over frequency"
    tab = "Responses"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        up = PlotAxis("Response I, II", "x / A0", scale=Scale.LOGARITHMIC)
        self.plot = Plot("Response over frequency", FREQUENCY, up, theme).with_legend()
        self.plot.with_hint("A point every tenth of a second of a dwell or a sweep; the prediction beneath.")
        self._stripes = self.plot.stripes(LineStyle(lambda theme: theme.traces[3], filled=0.15))
        self._predicted = self.plot.curve(PREDICTED, "I, simulated")
        self._linear = self.plot.curve(curve_style(2, Dash.DOTTED), "linear, simulated")
        self._first = self.plot.dots(curve_style(3), "I, measured", 3)
        self._second = self.plot.dots(curve_style(0), "II, measured", 3)
        self._shown = 0
        filled(QVBoxLayout(self), self.plot, margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw all points so far."""
        history = view.history()
        if len(history.time_s) == self._shown:
            return
        self._shown = len(history.time_s)
        self._first.setData(history.frequency_hz, history.response_i)
        self._second.setData(history.frequency_hz, history.response_ii)

    def show_prediction(self, seen: MeasurementPrediction | None) -> None:
        """Lay a prediction beneath, or none."""
        self._stripes.show_bands(() if seen is None else seen.collision_bands_hz)
        if seen is None:
            self._predicted.clear()
            self._linear.clear()
            return
        found = seen.prediction
        self._predicted.setData(found.frequency_hz, found.response_i)
        self._linear.setData(found.frequency_hz, found.linear)

    def clear(self) -> None:
        """Forget the last run."""
        self._shown = 0
        self._first.clear()
        self._second.clear()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self.plot.retheme(theme)


class SweepEnvelopePlot(QWidget):
    """Extremes of m0's velocity against the frequency really played."""

    title = "Sweep envelope"
    tab = "Envelope"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.plot = Plot("Sweep envelope", FREQUENCY, PlotAxis("m0 velocity", "m/s"), theme).with_legend()
        self.plot.with_hint("Largest and smallest velocity of m0 while a sweep passes by.")
        self._stripes = self.plot.stripes(LineStyle(lambda theme: theme.traces[3], filled=0.15))
        self._upper = self.plot.curve(curve_style(3), "largest")
        self._lower = self.plot.curve(curve_style(0), "smallest")
        self._shown = 0
        filled(QVBoxLayout(self), self.plot, margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw all points so far, in the order of time."""
        history = view.history()
        if len(history.time_s) == self._shown:
            return
        self._shown = len(history.time_s)
        self._upper.setData(history.frequency_hz, history.upper)
        self._lower.setData(history.frequency_hz, history.lower)

    def show_prediction(self, seen: MeasurementPrediction | None) -> None:
        """Show where collisions are predicted."""
        self._stripes.show_bands(() if seen is None else seen.collision_bands_hz)

    def clear(self) -> None:
        """Forget the last run."""
        self._shown = 0
        self._upper.clear()
        self._lower.clear()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self.plot.retheme(theme)
