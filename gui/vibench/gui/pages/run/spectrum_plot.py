"""The spectral density of every channel, each in its own unit."""

import numpy as np
import pyqtgraph as pg
from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis.live import LiveView

from ...plots.axis import LOG_FREQUENCY, PlotAxis, Scale
from ...plots.line_style import curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled
from ...widgets.theme import Theme
from ...widgets.units import UNITS
from .time_histories import channel_word

_LEAST = 1e-12


class SpectrumPlot(QWidget):
    """All channels over one frequency axis."""

    title = "Spectral density of every channel"
    tab = "Spectrum"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        label = "Amplitude density, channel's unit / √Hz"
        up = PlotAxis(label, scale=Scale.LOGARITHMIC, short="unit / √Hz")
        self.plot = Plot("Spectral density of every channel", LOG_FREQUENCY, up, theme).with_legend()
        self.plot.with_hint("Spectra of all channels, of the newest seconds of a run.")
        self._curves: list[pg.PlotDataItem] = []
        self._view: LiveView | None = None
        UNITS.on_change(self._draw_anew)
        filled(QVBoxLayout(self), self.plot, margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw what is known by now."""
        found = view.spectrum()
        if found is None:
            return
        self._view = view
        units = [UNITS.on_axis(channel.unit) for channel in view.channels]
        for row in range(len(self._curves), len(units)):
            name = f"{channel_word(view.channels[row].role)} ({units[row].name})"
            self._curves.append(self.plot.curve(curve_style(row), name))
        for curve, density, unit in zip(self._curves, found.amplitude_density, units, strict=False):
            curve.setData(found.frequency_hz[1:], unit.per_si * np.maximum(density[1:], _LEAST))

    def _draw_anew(self) -> None:
        """Draw in other units: the axis has that of each channel."""
        self.plot.wipe()
        self._curves.clear()
        if self._view is not None:
            self.show_view(self._view)

    def clear(self) -> None:
        """Forget the last run."""
        self._view = None
        for curve in self._curves:
            curve.clear()
