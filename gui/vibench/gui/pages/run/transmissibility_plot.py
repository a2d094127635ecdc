"""The transmission so far, with bounds, its coherence below, and the prediction dashed beneath."""

from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis import MeasurementPrediction
from vibench.analysis.live import LiveView

from ...plots.axis import FREQUENCY, PlotAxis, Scale
from ...plots.line_style import PREDICTED, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled
from ...widgets.theme import Theme
from .sweep_plots import show_predicted

MEASURED = "measured, 95 % bounds"


class TransmissibilityPlot(QWidget):
    """|x / U| over frequency."""

    title = "Transmission from base to m0"
    tab = "Transmission"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        up = PlotAxis("|x / U|", scale=Scale.LOGARITHMIC)
        self.magnitude = Plot("Transmission from base to m0", FREQUENCY, up, theme).with_legend()
        self.magnitude.with_hint("Response of m0 over motion of the base, with bounds, while a test runs.")
        self.coherence = Plot("Coherence", FREQUENCY, PlotAxis("Coherence", short="γ²"), theme)
        shade = LineStyle(lambda theme: theme.traces[0], filled=0.25)
        self._band = self.magnitude.band(shade, MEASURED)
        self._predicted = {
            "response_i": self.magnitude.curve(PREDICTED, "I under sines, simulated"),
            "linear": self.magnitude.curve(curve_style(2, Dash.DOTTED), "linear, simulated"),
        }
        self._measured = self.magnitude.curve(curve_style(0), MEASURED)
        self._coherence = self.coherence.curve(curve_style(0))
        self.coherence.setYRange(0, 1, padding=0.3)
        self.coherence.setXLink(self.magnitude)
        # One frequency axis for both: the lower one's.
        self.magnitude.across.show_nothing()
        filled(QVBoxLayout(self), (self.magnitude, 2), (self.coherence, 1), margin=0).setSpacing(1)

    def show_view(self, view: LiveView) -> None:
        """Draw what is known by now."""
        found = view.frequency_response()
        if found is None:
            return
        self._measured.setData(found.frequency_hz, found.magnitude)
        self._band.set_data(found.frequency_hz, found.magnitude_lower, found.magnitude_upper)
        self._coherence.setData(found.frequency_hz, found.coherence)

    def show_prediction(self, seen: MeasurementPrediction | None) -> None:
        """Lay a prediction beneath, or none."""
        show_predicted(self._predicted, seen)

    def clear(self) -> None:
        """Forget the last run."""
        for curve in (self._measured, self._coherence):
            curve.clear()
        self._band.set_data([], [], [])
