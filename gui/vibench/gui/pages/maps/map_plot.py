"""The map as a picture: kinds of motion in colours, or one quantity; a click asks for the motion there."""

from collections.abc import Callable
from math import log10

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from pyqtgraph.GraphicsScene.mouseEvents import MouseClickEvent
from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from vibench.analysis.dynamics import MOTION_CLASSES, RecordedLevel
from vibench.analysis.simulation.map_request import MapPicture, SettledMotion

from ...plots.axis import FREQUENCY, TIME, PlotAxis, Scale
from ...plots.line_style import LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled, row
from ...widgets.theme import Theme
from ...widgets.units import SentenceLabel

AMPLITUDE = PlotAxis("Base amplitude A0", "m", scale=Scale.LOGARITHMIC)
ON_TOP = LineStyle(lambda _theme: "#101010")
"""Over the colours of a map, which are the same in every theme."""
HINT = "What motions there are; drawn as it is computed. A click shows the motion there."
UNKNOWN = (0, 0, 0, 0)
SHARPEST = 0.998
"""Quantile at either end beyond which colours are not spread."""


class MapPlot(QWidget):
    """Frequency across, amplitude up."""

    picked = Signal(float, float)
    """Frequency [Hz] and amplitude [m] of a point that somebody wants to see."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.plot = Plot("Map of motions over frequency and amplitude", FREQUENCY, AMPLITUDE, theme)
        self.plot.with_hint(HINT)
        self.image = pg.ImageItem(axisOrder="row-major")
        self.plot.addItem(self.image)
        self._mark = self.plot.dots(ON_TOP, size=10)
        self._levels = [self.plot.curve(ON_TOP)]
        self._range: tuple[tuple[float, float], tuple[float, float]] | None = None
        self.plot.scene().sigMouseClicked.connect(self._click)
        filled(QVBoxLayout(self), self.plot, margin=0)

    @property
    def in_sight(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Frequencies [Hz] and amplitudes [m] that the axes show."""
        (left, right), (bottom, top) = self.plot.getViewBox().viewRange()
        return (left, right), (10.0**bottom, 10.0**top)

    def show_picture(self, picture: MapPicture, quantity: str) -> None:
        """Draw a map as far as it has come; axes follow only when its edges are others."""
        self.show_range(picture.frequency_hz, picture.amplitude_m)
        (left, right), (low, high) = picture.frequency_hz, picture.amplitude_m
        self.image.setImage(COLOURINGS[quantity](picture), autoLevels=False, levels=(0, 255))
        self.image.setRect(QRectF(left, log10(low), right - left, log10(high / low)))
        self.plot.with_hint("")

    def show_range(self, frequency_hz: tuple[float, float], amplitude_m: tuple[float, float]) -> None:
        """Let the axes show these frequencies and amplitudes; again the same, they stay where they are."""
        if self._range != (frequency_hz, amplitude_m):
            self._range = (frequency_hz, amplitude_m)
            low, high = amplitude_m
            self.plot.setXRange(*frequency_hz, padding=0.0)
            self.plot.setYRange(log10(low), log10(high), padding=0.0)

    def clear(self) -> None:
        """Show no map; the axes show the whole of the next one, wherever they were."""
        self._range = None
        self.image.clear()
        self.plot.with_hint(HINT)

    def mark(self, frequency_hz: float, amplitude_m: float) -> None:
        """Show which point the motion is of."""
        self._mark.setData([frequency_hz], [amplitude_m])

    def show_level(self, level: RecordedLevel, number: int) -> None:
        """Lay a recording's level over the map."""
        while len(self._levels) <= number:
            self._levels.append(self.plot.curve(ON_TOP))
        frequency_hz, amplitude_m = np.array(level.pairs).T
        self._levels[number].setData(frequency_hz, amplitude_m)

    def _click(self, event: MouseClickEvent) -> None:
        box = self.plot.getViewBox()
        if event.button() is not Qt.MouseButton.LeftButton or not box.sceneBoundingRect().contains(
            event.scenePos()
        ):
            return
        place = box.mapSceneToView(event.scenePos())
        self.picked.emit(float(place.x()), 10.0 ** float(place.y()))


def _class_colours(picture: MapPicture) -> NDArray[np.uint8]:
    colours = [(*pg.mkColor(colour).getRgb()[:3], 255) for _, colour in MOTION_CLASSES]
    # The last row is what -1 finds: nothing known yet.
    return np.array([*colours, UNKNOWN], dtype=np.uint8)[picture.classes]


def _spread(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Spread numbers over the colours, from a low quantile to a high one."""
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, [1.0 - SHARPEST, SHARPEST]) if known.size else (0.0, 1.0)
    share = np.clip((values - low) / max(float(high - low), 1e-12), 0.0, 1.0)
    table = pg.colormap.get("viridis").getLookupTable(0.0, 1.0, 256, alpha=True)
    found = np.asarray(table, dtype=np.uint8)[(255.0 * np.nan_to_num(share)).astype(np.uint8)]
    found[~np.isfinite(values)] = UNKNOWN
    return found


COLOURINGS: dict[str, Callable[[MapPicture], NDArray[np.uint8]]] = {
    "kind of motion": _class_colours,
    "Response I": lambda picture: _spread(np.log10(picture.response_i)),
    "motions found": lambda picture: _spread(picture.motions),
}
"""What the colours of a map may say."""


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
