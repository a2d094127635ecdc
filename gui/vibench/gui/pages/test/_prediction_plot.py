"""What the specimen is predicted to do: Response I and II over frequency, and where it collides."""

import numpy as np

from vibench.analysis import Foresight

from ...plots import FREQUENCY, Axis, Dash, Ink, Plot, Scale, trace
from ...widgets import Theme

COLLISION = Ink(lambda theme: theme.traces[3], filled=0.18)


class PredictionPlot(Plot):
    """Simulated, and labelled so: dashed lines, the model in the legend, collision regions as stripes."""

    def __init__(self, theme: Theme) -> None:
        up = Axis("Response", "x / A0", scale=Scale.LOGARITHMIC)
        super().__init__("Predicted response and collision regions", FREQUENCY, up, theme)
        self.with_legend()
        self.with_hint("The specimen is being simulated under this test.")
        self._first = self.curve(Ink(lambda theme: theme.predicted, Dash.DASHED), "Response I, simulated")
        self._second = self.curve(Ink(lambda theme: theme.traces[0], Dash.DOTTED), "Response II, simulated")
        self._linear = self.curve(trace(2, Dash.DOTTED), "without contact")
        self._stripes = self.stripes(COLLISION)

    def show_foresight(self, seen: Foresight | None) -> None:
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
