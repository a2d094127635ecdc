"""The motion at one point of a map: over time, its portrait, and its spectrum."""

from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis.simulation.map_request import SettledMotion

from ...plots.axis import FREQUENCY, TIME, PlotAxis, Scale
from ...plots.line_style import curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled, row
from ...widgets.theme import Theme
from ...widgets.units import SentenceLabel

RELATIVE = PlotAxis("p = y - z", "m", short="p")
DISPLACEMENT = PlotAxis("m0 displacement", "m", short="x")
LINE = PlotAxis("|x|", "m", scale=Scale.LOGARITHMIC)
SHOWN_PERIODS = 12
HIGHEST_MULTIPLE = 6.0
"""Of the drive frequency: the end of the spectrum."""


class MotionView(QWidget):
    """Three plots side by side, and what they show in words."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.said = SentenceLabel("A click on the map shows the motion there.")
        self.said.setAccessibleName("The motion at the point that was clicked")
        self.plots = (
            Plot("Motion of m1 between its stops", TIME, RELATIVE, theme),
            Plot("Portrait", DISPLACEMENT, RELATIVE, theme),
            Plot("Spectrum of m0", FREQUENCY, LINE, theme),
        )
        self.curves = tuple(plot.with_hint("No motion yet.").curve(curve_style(0)) for plot in self.plots)
        filled(QVBoxLayout(self), self.said, (row(*((plot, 1) for plot in self.plots)), 1), margin=0)

    def show_nothing(self, why: str) -> None:
        """Show no motion, and say why."""
        self.said.setText(why)
        for curve in self.curves:
            curve.clear()

    def show_motion(self, motion: SettledMotion) -> None:
        """Draw another motion."""
        self.said.setText(motion.said)
        shown = motion.time_s <= SHOWN_PERIODS / motion.frequency_hz
        is_low = (motion.line_hz > 0.0) & (motion.line_hz < HIGHEST_MULTIPLE * motion.frequency_hz)
        data = (
            (motion.time_s[shown], motion.relative_m[shown]),
            (motion.displacement_m, motion.relative_m),
            (motion.line_hz[is_low], motion.line_m[is_low]),
        )
        for plot, curve, (across, up) in zip(self.plots, self.curves, data, strict=True):
            curve.setData(across, up)
            plot.show_everything()
