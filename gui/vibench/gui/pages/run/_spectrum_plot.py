"""The spectral density of every channel, each in its own unit."""

import numpy as np
import pyqtgraph as pg
from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis.live import LiveView

from ...plots import LOG_FREQUENCY, Plot, PlotAxis, Scale, curve_style
from ...widgets import Theme
from ._time_histories import channel_word

_UNITS = {"m s-2": "m/s²", "m s-1": "m/s"}
_LEAST = 1e-12


class SpectrumPlot(QWidget):
    """All channels over one frequency axis."""

    title = "Spectral density of every channel"
    tab = "Spectrum"

    def __init__(self, theme: Theme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        up = PlotAxis(
            "Amplitude density", "channel's unit / √Hz", scale=Scale.LOGARITHMIC, short="unit / √Hz"
        )
        self.plot = Plot("Spectral density of every channel", LOG_FREQUENCY, up, theme).with_legend()
        self.plot.with_hint("Spectra of all channels, of the newest seconds of a run.")
        self._curves: list[pg.PlotDataItem] = []
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.plot)

    def show_view(self, view: LiveView) -> None:
        """Draw what is known by now."""
        found = view.spectrum()
        if found is None:
            return
        for row in range(len(self._curves), len(view.channels)):
            channel = view.channels[row]
            name = f"{channel_word(channel.role)} ({_UNITS.get(channel.unit, channel.unit)})"
            self._curves.append(self.plot.curve(curve_style(row), name))
        for curve, density in zip(self._curves, found.amplitude_density, strict=False):
            curve.setData(found.frequency_hz[1:], np.maximum(density[1:], _LEAST))

    def clear(self) -> None:
        """Forget the last run."""
        for curve in self._curves:
            curve.clear()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self.plot.retheme(theme)
