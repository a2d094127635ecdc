"""p of m1 between its stops as the live twin tells it, and a forecast that fades as its error grows."""

from functools import partial
from math import nan

import numpy as np
from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.acquisition.engine import EngineStatus, TwinStatus

from ...plots.axis import PlotAxis
from ...plots.line_style import LIMIT, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled
from ...widgets.theme import Colour, Theme
from ...widgets.units import SentenceLabel

_ACROSS = PlotAxis("Time from the newest sample", "ms", 1e3, short="t")
_UP = PlotAxis("p = y - z", "m", short="p")
_SHADES = 5
"""Of a forecast; the last one is nearly gone where its error is a quarter of the gap, and it ends."""
_WORTH_OF_GAP = 0.25
_AHEAD_S, _BACK_S = 0.025, 0.05
_HINT = "p of m1 between its stops, while a test runs and the live twin is on."


def _faded(number: int, theme: Theme) -> Colour:
    opacity = round(255 * (1.0 - number / _SHADES))
    return f"{theme.traces[1]}{opacity:02x}"


class HiddenMotionPlot(QWidget):
    """The newest 50 ms, what comes, and the numbers found."""

    title = "Hidden motion: m1 between its stops"
    tab = "Hidden motion"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.plot = Plot(self.title, _ACROSS, _UP, theme).with_hint(_HINT)
        self.told = self.plot.curve(curve_style(0))
        self.forecast = [
            self.plot.curve(LineStyle(partial(_faded, number), Dash.SOLID)) for number in range(_SHADES)
        ]
        self._stops = [self.plot.level(LIMIT, nan, "stop") for _ in range(2)]
        self.said = SentenceLabel(rank="second")
        self.said.setAccessibleName("What the live twin says")
        self._end = (0, -1)
        self.plot.setXRange(-_BACK_S, _AHEAD_S, padding=0)
        filled(QVBoxLayout(self), self.said, (self.plot, 1)).setContentsMargins(8, 4, 0, 0)
        self.clear()

    def show_status(self, status: EngineStatus | None) -> None:
        """Draw what the twin told last, if that is news."""
        twin = None if status is None else status.twin
        if twin is None:
            self.clear()
            return
        self.said.setText(_words(twin))
        if (twin.run_id, twin.end_sample) == self._end or not twin.p_m:
            return
        self._end = (twin.run_id, twin.end_sample)
        p = np.array([np.nan if each is None else each for each in twin.p_m])
        self.told.setData((np.arange(p.size) - p.size + 1) * twin.step_s, p, connect="finite")
        self._draw_forecast(twin)
        for line, place in zip(self._stops, twin.stops_m, strict=True):
            self.plot.move_level(line, place)
        reach = 1.15 * max(map(abs, twin.stops_m))
        self.plot.keep_in_view(up=(-reach, reach))

    def clear(self) -> None:
        """Show nothing: there is no twin, or another run begins."""
        for curve in (self.told, *self.forecast):
            curve.setData([], [])
        for line in self._stops:
            self.plot.move_level(line, nan)
        self.said.setText("The live twin is off.")
        self._end = (0, -1)

    def _draw_forecast(self, twin: TwinStatus) -> None:
        """Draw it in pieces, each as faint as its error is large."""
        p, error = np.array(twin.forecast_m), np.array(twin.forecast_error_m)
        time_s = np.arange(1, p.size + 1) * twin.step_s
        worth = _WORTH_OF_GAP * min(map(abs, twin.stops_m))
        shade = np.minimum(_SHADES * error / worth, _SHADES - 1).astype(int) if p.size else np.empty(0)
        for number, curve in enumerate(self.forecast):
            here = np.flatnonzero(shade == number)
            # A piece begins where the one before has ended.
            part = slice(max(here[0] - 1, 0), here[-1] + 1) if here.size else slice(0, 0)
            curve.setData(time_s[part], p[part])


def _words(twin: TwinStatus) -> str:
    numbers = "; ".join(f"{name} {value}" for name, value in twin.numbers[:3])
    parts = [twin.state, twin.sentence, numbers]
    if twin.missed_s:
        parts.append(f"{twin.missed_s:.1f} s were not looked at: the computer was too busy")
    return " · ".join(each for each in parts if each)
