"""Four pictures of a simulation: responses, exponents, similarity, and the motion itself."""

from collections.abc import Callable
from functools import partial
from math import log10

import numpy as np
import pyqtgraph as pg
from PySide6.QtWidgets import QGridLayout, QWidget

from vibench.analysis import SIMILARITY_THRESHOLD
from vibench.analysis.simulation.progress import SimulationProgress

from ...plots.axis import LOG_FREQUENCY, PlotAxis, Scale
from ...plots.line_style import GUIDE, LIMIT, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.theme import Theme

RESPONSE = PlotAxis("Motion of m0 over base, |x / U|", short="|x / U|", scale=Scale.LOGARITHMIC)
LARGEST_EXPONENT = PlotAxis("Largest Lyapunov exponent", "1/s", short="Exponent")
DIFFERENCE = PlotAxis("Difference of log Response I", short="Difference", scale=Scale.LOGARITHMIC)
RUN_TIME = PlotAxis("Time, to the end of the run", "ms", factor=1e3)
DISPLACEMENT = PlotAxis("Displacement", "m")
_COLLIDING = LineStyle(lambda theme: theme.muted, filled=0.14)
_EDGE = LineStyle(lambda theme: theme.muted, Dash.DOTTED)
_HINTS = (
    "Responses I and II of every model, as they are found.",
    "The motion of the masses at the frequency given under Signal.",
    "Largest Lyapunov exponents: choose them under Exponent in the scene.",
    "How far the two models differ, where both are known.",
)
_SMALLEST = 1e-6
"""Equal curves have no logarithm: they are drawn at the foot of the axis."""


class AnswerPlots(QWidget):
    """Drawn anew from the course of a simulation, as often as it grows."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.responses = Plot("Responses over frequency", LOG_FREQUENCY, RESPONSE, theme)
        self.exponents = Plot("Exponent over frequency", LOG_FREQUENCY, LARGEST_EXPONENT, theme)
        self.likeness = Plot("Difference of the two models over frequency", LOG_FREQUENCY, DIFFERENCE, theme)
        self.motion = Plot("Motion over time", RUN_TIME, DISPLACEMENT, theme)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for number, (plot, hint) in enumerate(zip(self.plots, _HINTS, strict=True)):
            plot.with_legend().with_hint(hint)
            layout.addWidget(plot, number // 2, number % 2)
            layout.setRowStretch(number // 2, 1)
            layout.setColumnStretch(number % 2, 1)

    @property
    def plots(self) -> tuple[Plot, ...]:
        """All four, row by row."""
        return (self.responses, self.motion, self.exponents, self.likeness)

    def show_progress(self, progress: SimulationProgress | None) -> None:
        """Draw what is there."""
        for step in self.steps(progress):
            step()

    def steps(self, progress: SimulationProgress | None) -> list[Callable[[], None]]:
        """Draw what is there picture by picture: together they take longer than a frame has."""
        draws = (self._responses, self._motion, self._exponents, self._likeness)
        return [
            partial(_draw_anew, plot, draw, progress) for plot, draw in zip(self.plots, draws, strict=True)
        ]

    def _responses(self, progress: SimulationProgress) -> None:
        for number, model in enumerate(progress.models):
            self._responses_of(progress, model, number)
        low, high = progress.smallest_and_largest_response
        if high > 0.0:
            self.responses.setYRange(log10(low) - 0.1, log10(high) + 0.1, padding=0.0)

    def _responses_of(self, progress: SimulationProgress, model: str, number: int) -> None:
        if number == 0:
            bands_hz = progress.collision_bands_hz(model)
            self.responses.stripes(_COLLIDING).show_bands(bands_hz)
            self.responses.rules(_EDGE).show_at(low_hz for low_hz, _ in bands_hz[1:])
            if bands_hz:
                self.responses.upright(_EDGE, bands_hz[0][0], f"impacts, {model}")
        elsewhere_hz, elsewhere = progress.other_motions(model)
        if elsewhere_hz.size:
            dots = self.responses.dots(curve_style(number), f"other starts, {model}", size=5)
            dots.setData(elsewhere_hz, elsewhere)
        for name, label, dash in (
            ("response_i", "Response I", Dash.SOLID),
            ("response_ii", "Response II", Dash.DOTTED),
        ):
            frequency_hz, values = progress.column(model, name)
            if frequency_hz.size:
                line = self.responses.curve(curve_style(number, dash), f"{label}, {model}")
                _draw(line, frequency_hz, values)

    def _exponents(self, progress: SimulationProgress) -> None:
        for number, model in enumerate(progress.models):
            frequency_hz, values = progress.column(model, "lyapunov_per_s")
            if np.isfinite(values).any():
                _draw(self.exponents.curve(curve_style(number), model), frequency_hz, values)
                if number == 0:
                    self.exponents.level(GUIDE, 0.0)

    def _motion(self, progress: SimulationProgress) -> None:
        for number, signal in enumerate(progress.signals):
            time_s = signal.time_s - signal.time_s[0]
            line = self.motion.curve(curve_style(number), f"x, {signal.model}, {signal.frequency_hz:g} Hz")
            line.setData(time_s, signal.displacement_m)
            line = self.motion.curve(curve_style(number, Dash.DOTTED), f"p = y - z, {signal.model}")
            line.setData(time_s, signal.relative_m)
        if progress.signals:
            lower_m, upper_m = progress.signals[0].gaps_m
            stops_m = [each for each in (upper_m, -lower_m) if np.isfinite(each)]
            for stop_m in stops_m:
                self.motion.level(LIMIT, stop_m, "stop")
            reach_m = max(*np.abs(stops_m), progress.largest_signal_m)
            self.motion.setYRange(-1.1 * reach_m, 1.1 * reach_m, padding=0.0)

    def _likeness(self, progress: SimulationProgress) -> None:
        found = progress.similarity()
        if found is None:
            return
        name = f"{100 * found.rate:.0f} % similar ({100 * found.low:.0f} to {100 * found.high:.0f} %)"
        shown = np.maximum(found.difference, _SMALLEST)
        _draw(self.likeness.curve(curve_style(2), name), found.frequency_hz, shown)
        self.likeness.level(LIMIT, SIMILARITY_THRESHOLD, "limit")


def _draw_anew(
    plot: Plot, draw: Callable[[SimulationProgress], None], progress: SimulationProgress | None
) -> None:
    plot.wipe()
    if progress is not None:
        draw(progress)


def _draw(
    line: pg.PlotDataItem,
    frequency_hz: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
    values: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
) -> None:
    line.setData(frequency_hz, values, connect="finite")
