"""Phase portrait of the newest periods, and the Poincaré section of the run so far."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QHBoxLayout, QWidget

from vibench.analysis.live import LiveView, Portrait

from ...plots.axis import PlotAxis
from ...plots.line_style import curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled
from ...widgets.theme import Theme

_ACROSS = PlotAxis("m0 displacement", "m", short="x")
_UP = PlotAxis("m0 velocity", "m/s", short="v")


def extent(values: NDArray[np.floating]) -> tuple[float, float]:
    """Smallest and largest."""
    return float(values.min()), float(values.max())


class PortraitPlot(QWidget):
    """Orbit on the left, points once a drive period on the right."""

    title = "Phase portrait and Poincaré section"
    tab = "Phase portrait, Poincaré"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.orbit = Plot("Phase portrait of the newest periods", _ACROSS, _UP, theme)
        self.section = Plot("Poincaré section of the run so far", _ACROSS, _UP, theme)
        self.orbit.with_hint("The orbit of the newest periods of a sine.")
        self.section.with_hint("One point a drive period, of the run so far.")
        self._orbit = self.orbit.curve(curve_style(0))
        self._strobe = self.orbit.dots(curve_style(3), size=6)
        self._points = self.section.dots(curve_style(3), size=3)
        self._shown: Portrait | None = None
        filled(QHBoxLayout(self), (self.orbit, 1), (self.section, 1), margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw the newest periods."""
        found = view.portrait()
        if found is None or found is self._shown:
            return
        self._shown = found
        self._orbit.setData(found.orbit_displacement_m, found.orbit_velocity_m_per_s)
        self._strobe.setData(found.strobe_displacement_m, found.strobe_velocity_m_per_s)
        self.orbit.keep_in_view(extent(found.orbit_displacement_m), extent(found.orbit_velocity_m_per_s))
        section = view.section
        if section.displacement_m.size:
            self.section.keep_in_view(extent(section.displacement_m), extent(section.velocity_m_per_s))
        self._points.setData(section.displacement_m, section.velocity_m_per_s)

    def clear(self) -> None:
        """Forget the last run."""
        for item in (self._orbit, self._strobe, self._points):
            item.clear()
