"""The newest seconds of every channel, one time history each: smallest and largest sample of every column."""

import numpy as np
import pyqtgraph as pg
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis.live import LiveView, zigzag

from ...plots.axis import PlotAxis
from ...plots.line_style import curve_style
from ...plots.plot import Plot
from ...widgets.theme import Theme
from ...widgets.units import plain_unit

_WORDS = {
    "drive_voltage": "drive",
    "amplifier_voltage": "amplifier",
    "base_acceleration": "base",
    "m0_velocity": "m0",
}
_SHORT = {"amplifier_voltage": "amp."}


def channel_word(role: str) -> str:
    """Say a channel in a word."""
    return _WORDS.get(role, role.replace("_", " "))


def channel_axis(role: str, unit: str) -> PlotAxis:
    """Give a channel's axis: its word, in the unit that is shown."""
    return PlotAxis(channel_word(role), plain_unit(unit), short=_SHORT.get(role, channel_word(role)))


AGO = PlotAxis("Time before now", "s")
"""An axis that stands still: one that scrolls would be painted anew in every frame."""
LEAST_COLUMNS, MOST_COLUMNS = 500, 3000
"""Of a plot: as many as there are lines side by side; between fewer, room would stay empty."""
AXIS_EM, TIME_AXIS_EM = 4.0, 3
USUAL_SPAN_S = 2.0
"""What a plot shows at first."""


class TimeHistoryPlots(QWidget):
    """Plots over one time axis; they change with the channels of the run."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._curves: list[pg.PlotDataItem] = []
        self._span_s = 0.0
        self._channels: tuple[tuple[str, str], ...] = ()
        self.plots: list[Plot] = []
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(1)

    def show_channels(self, channels: tuple[tuple[str, str], ...]) -> None:
        """Have a plot for each channel, given by role and unit."""
        if channels != self._channels:
            self._build(channels)
            self._channels = channels

    def show_view(self, view: LiveView, span_s: float) -> None:
        """Draw the newest seconds."""
        self.show_channels(tuple((channel.role, channel.unit) for channel in view.channels))
        if not self.plots:
            return
        seen = view.time_histories(span_s, min(max(LEAST_COLUMNS, self.plots[0].columns), MOST_COLUMNS))
        if len(seen.time_s) == 0:
            return
        time_s = np.repeat(seen.time_s - seen.time_s[-1], 2)
        for row, plot in enumerate(self.plots):
            low, high = (np.asarray(edge[row], dtype=np.float64) for edge in (seen.low, seen.high))
            self._curves[row].setData(time_s, zigzag(low, high))
            known = np.isfinite(low)
            if known.any():
                plot.keep_in_view(up=(float(low[known].min()), float(high[known].max())))
            if span_s != self._span_s:
                plot.setXRange(-span_s, 0, padding=0)
        self._span_s = span_s

    def retheme(self, theme: Theme) -> None:
        """Make further plots in other colours."""
        self._theme = theme

    def _build(self, channels: tuple[tuple[str, str], ...]) -> None:
        """Have as many plots as channels; those that are there are used again, for a plot is slow to make."""
        for plot in self.plots[len(channels) :]:
            self._layout.removeWidget(plot)
            plot.deleteLater()
        del self.plots[len(channels) :], self._curves[len(channels) :]
        for row in range(len(self.plots), len(channels)):
            plot = Plot("Time history", AGO, channel_axis(*channels[row]), self._theme)
            plot.setXRange(-USUAL_SPAN_S, 0, padding=0)
            plot.up_em = AXIS_EM
            plot.follow_font()
            self._curves.append(plot.curve(curve_style(row)))
            self._layout.addWidget(plot, 1)
            self.plots.append(plot)
        for (role, unit), plot, curve in zip(channels, self.plots, self._curves, strict=True):
            curve.clear()
            plot.setAccessibleName(f"Time history of {channel_word(role)}")
            plot.with_hint(f"The newest seconds of {channel_word(role)}, while a test runs.")
            plot.up.show_unit(channel_axis(role, unit))
            is_last = plot is self.plots[-1]
            plot.across.setStyle(showValues=is_last)
            plot.across.showLabel(is_last)
        self._span_s = 0.0
        self._share_height()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep all plots equally high."""
        super().resizeEvent(event)
        self._share_height()

    def _share_height(self) -> None:
        """Give the last plot as much more as its time axis takes."""
        axis = TIME_AXIS_EM * self.fontMetrics().height()
        height = max(1, (self.height() - axis) // max(1, len(self.plots)))
        for place in range(len(self.plots)):
            self._layout.setStretch(place, height + (axis if place == len(self.plots) - 1 else 0))
        # At once: a layout that comes after the first picture has everything painted twice.
        self._layout.activate()
