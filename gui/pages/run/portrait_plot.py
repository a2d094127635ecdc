"""Phase portrait of the newest periods, and the Poincaré section of the run so far."""

from PySide6.QtWidgets import QHBoxLayout, QWidget

from analysis.live.portrait import Portrait
from analysis.live.view import LiveView

from ...plots.axis import Axis
from ...plots.plot import Plot, trace
from ...theme import Theme

_ACROSS = Axis("m0 displacement", "µm", 1e6)
_UP = Axis("m0 velocity", "mm/s", 1e3)


class PortraitPlot(QWidget):
    """Orbit on the left, points once a drive period on the right."""

    title = "Phase portrait and Poincaré section"

    def __init__(self, theme: Theme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.orbit = Plot("Phase portrait of the newest periods", _ACROSS, _UP, theme)
        self.section = Plot("Poincaré section of the run so far", _ACROSS, _UP, theme)
        self._orbit = self.orbit.curve(trace(0))
        self._strobe = self.orbit.dots(trace(3), size=6)
        self._points = self.section.dots(trace(3), size=3)
        self._shown: Portrait | None = None
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.orbit, 1)
        layout.addWidget(self.section, 1)

    def show_view(self, view: LiveView) -> None:
        """Draw the newest periods."""
        found = view.portrait()
        if found is None or found is self._shown:
            return
        self._shown = found
        self._orbit.setData(found.orbit_displacement_m, found.orbit_velocity_m_per_s)
        self._strobe.setData(found.strobe_displacement_m, found.strobe_velocity_m_per_s)
        orbit = (found.orbit_displacement_m, found.orbit_velocity_m_per_s)
        across, up = ((float(values.min()), float(values.max())) for values in orbit)
        for plot in (self.orbit, self.section):
            plot.keep_in_view(across, up)
        self._points.setData(view.section.displacement_m, view.section.velocity_m_per_s)

    def clear(self) -> None:
        """Forget the last run."""
        for item in (self._orbit, self._strobe, self._points):
            item.clear()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self.orbit.retheme(theme)
        self.section.retheme(theme)
