"""The Maps page: kinds of motion over frequency and amplitude, and the motion at a chosen point.

The map is drawn while it is computed, at first on a coarse grid. Its visible part can be computed again on a
finer grid. A click shows the motion at that point. Base levels of recordings can be drawn over the map.
"""

from collections.abc import Callable
from functools import partial
from math import log10
from pathlib import Path

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from pyqtgraph.GraphicsScene.mouseEvents import MouseClickEvent
from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtWidgets import QLabel, QLayout, QVBoxLayout, QWidget

from vibench.analysis import recorded_response
from vibench.analysis.dynamics import MOTION_CLASSES, RecordedLevel
from vibench.analysis.prediction.progress import (
    MapPicture,
    MapRequest,
    MotionRequest,
    PartialResult,
    SettledMotion,
    Trouble,
    settled_motion,
)
from vibench.sim.background import Job, ignore

from ..forms.editor import Choice
from ..forms.model_form import ValidatedForm
from ..page.app_context import AppContext
from ..page.page import DisplayedResult, Page, SideAndPicture, Simulator
from ..plots.axis import FREQUENCY, TIME, PlotAxis, Scale
from ..plots.line_style import LineStyle, curve_style
from ..plots.plot import Plot
from ..widgets.boxes import column, fill_box, push_button, row, splitter, titled_box
from ..widgets.notice import MAPS, SIMULATE
from ..widgets.theme import Theme
from ..widgets.units import SentenceLabel

AMPLITUDE = PlotAxis("Base amplitude A0", "m", scale=Scale.LOGARITHMIC)
ON_TOP = LineStyle(lambda _theme: "#101010")
"""Style of marked points and levels on the map; map colours do not depend on the theme."""
HINT = "Kinds of motion over frequency and amplitude, drawn while computed. Click a point to see its motion."
UNKNOWN = (0, 0, 0, 0)
SHARPEST = 0.998
"""Upper end of the colour scale, as a quantile of the values; the lower end is one minus this quantile."""


class MapPlot(QWidget):
    """Plot of the map: frequency on the horizontal axis, base amplitude on the vertical axis."""

    picked = Signal(float, float)
    """Frequency [Hz] and base amplitude [m] of a point that was clicked."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.plot = Plot("Map of motions over frequency and amplitude", FREQUENCY, AMPLITUDE, theme)
        self.plot.with_hint(HINT)
        self.image = pg.ImageItem(axisOrder="row-major")
        self.plot.addItem(self.image)
        self._mark = self.plot.dots(ON_TOP, size=10)
        self.levels: list[pg.PlotDataItem] = []
        """Base levels of recordings, over frequency."""
        self._range: tuple[tuple[float, float], tuple[float, float]] | None = None
        self.plot.scene().sigMouseClicked.connect(self._click)
        fill_box(QVBoxLayout(self), self.plot, margin=0)

    @property
    def in_sight(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Visible ranges of frequency [Hz] and base amplitude [m]."""
        (left, right), (bottom, top) = self.plot.getViewBox().viewRange()
        return (left, right), (10.0**bottom, 10.0**top)

    def show_picture(self, picture: MapPicture, quantity: str) -> None:
        """Draw a complete or partial map; the axes change only if the map's limits have changed."""
        self.show_range(picture.frequency_hz, picture.amplitude_m)
        (left, right), (low, high) = picture.frequency_hz, picture.amplitude_m
        self.image.setImage(COLOURINGS[quantity](picture), autoLevels=False, levels=(0, 255))
        self.image.setRect(QRectF(left, log10(low), right - left, log10(high / low)))
        self.plot.with_hint("")

    def show_range(self, frequency_hz: tuple[float, float], amplitude_m: tuple[float, float]) -> None:
        """Set the visible ranges; a repeated call with the same ranges keeps the user's zoom."""
        if self._range != (frequency_hz, amplitude_m):
            self._range = (frequency_hz, amplitude_m)
            low, high = amplitude_m
            self.plot.setXRange(*frequency_hz, padding=0.0)
            self.plot.setYRange(log10(low), log10(high), padding=0.0)

    def clear(self) -> None:
        """Remove the map; the next map will set the axes to its own range."""
        self._range = None
        self.image.clear()
        self.plot.with_hint(HINT)

    def mark(self, frequency_hz: float, amplitude_m: float) -> None:
        """Mark the point whose motion is shown below."""
        self._mark.setData([frequency_hz], [amplitude_m])

    def show_level(self, level: RecordedLevel) -> None:
        """Draw the base level of a recording, over frequency, on the map."""
        self.levels.append(self.plot.curve(ON_TOP))
        self.levels[-1].setData(*np.array(level.pairs).T)

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
    # The last row is the colour of class -1, which means points that are not computed yet.
    return np.array([*colours, UNKNOWN], dtype=np.uint8)[picture.classes]


def _spread(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return RGBA colours of values; the colour scale spans a low to a high quantile of the values."""
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
"""Quantities that the colours can show, with functions that compute the colours."""


RELATIVE = PlotAxis("p = y - z", "m", short="p")
DISPLACEMENT = PlotAxis("m0 displacement", "m", short="x")
LINE = PlotAxis("|x|", "m", scale=Scale.LOGARITHMIC)
SHOWN_PERIODS = 12
HIGHEST_MULTIPLE = 6.0


class MotionView(QWidget):
    """Three plots of a motion, side by side, with a summary in words."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.caption = SentenceLabel("A click on the map shows the motion at that point.")
        self.caption.setAccessibleName("Motion at the clicked point")
        self.plots = (
            Plot("Motion of m1 between its stops", TIME, RELATIVE, theme),
            Plot("Portrait", DISPLACEMENT, RELATIVE, theme),
            Plot("Spectrum of m0", FREQUENCY, LINE, theme),
        )
        self.curves = tuple(plot.with_hint("No motion yet.").curve(curve_style(0)) for plot in self.plots)
        fill_box(QVBoxLayout(self), self.caption, (row(*((plot, 1) for plot in self.plots)), 1), margin=0)

    def show_nothing(self, why: str) -> None:
        """Clear the plots and show the reason as text."""
        self.caption.setText(why)
        for curve in self.curves:
            curve.clear()

    def show_motion(self, motion: SettledMotion) -> None:
        """Draw the motion at one point of the map."""
        self.caption.setText(motion.text)
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


MAP_SHARE = 640
"""Height of the map in thousandths of the page's height; the plots of the motion get the remaining height."""
DIGITS = 5
"""Significant digits of the parameter ranges that a zoom writes into the form."""


class MapsPage(Page):
    """Page that computes one map at a time; starting another map cancels the running one."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.form: ValidatedForm[MapRequest] = ValidatedForm(MapRequest, "map", frozenset({"described"}))
        self.map = MapPlot(context.theme)
        self.motion = MotionView(context.theme)
        self.summary = SentenceLabel("Nothing has been computed yet.", name="Progress of the map")
        self.simulator = Simulator(self, context, self._grow, lambda: None, self.summary.setText)
        self.picture: MapPicture | None = None
        self._point: tuple[float, float] | None = None
        self._job: Job | None = None
        self._is_stale = False
        self._levels: list[RecordedLevel] = []
        self._mapped = DisplayedResult(lambda: self.form.value, self.map)
        self._moved = DisplayedResult(lambda: self._motion_request, self.motion)
        self.displayed_results = (self._mapped, self._moved)
        side = titled_box("Map", self.form)
        parts = SideAndPicture(context, MAPS, side, self._answer(), self._buttons())
        fill_box(QVBoxLayout(self), parts)
        self.form.changed.connect(self._validate)
        self.map.picked.connect(self.pick)
        context.comparison_requested.connect(self.add_recordings)
        self._validate()

    @property
    def is_done(self) -> bool:
        """Whether there is a complete map."""
        return self.picture is not None and not self.simulator.is_busy

    @property
    def _motion_request(self) -> MotionRequest | None:
        request = self.form.value
        if request is None or self._point is None:
            return None
        frequency_hz, amplitude_m = self._point
        return MotionRequest(
            **request.model_dump(include={"specimen", "model", "damping_time_s", "gap_m", "periods"}),
            described=request.described,
            frequency_hz=frequency_hz,
            amplitude_m=amplitude_m,
        )

    def refresh(self) -> None:
        """Draw the results that arrived since the last tick."""
        if self._is_stale and self.picture is not None:
            self._is_stale = False
            self.map.show_picture(self.picture, self.quantity.currentText())

    def begin(self) -> None:
        """Compute the map described by the form."""
        request = self.form.value
        if request is None:
            return
        self.picture = None
        self.map.clear()
        self._mapped.show(request)
        self._validate()
        self._compare_specimens()
        self.simulator.begin(request)

    def begin_in_sight(self) -> None:
        """Compute the visible part of the map, with as many points as the whole map."""
        request = self.form.value
        if request is None:
            return
        (left, right), (low, high) = self.map.in_sight
        edges = {"start_hz": max(left, 1e-3), "stop_hz": right, "lowest_m": low, "highest_m": high}
        rounded = {name: float(f"{value:.{DIGITS}g}") for name, value in edges.items()}
        self.form.form.show_content({**self.form.form.content(), **rounded})
        self.begin()

    def pick(self, frequency_hz: float, amplitude_m: float) -> None:
        """Compute and show the motion at a point of the map."""
        if self.form.value is None or frequency_hz <= 0.0:
            return
        self._point = (frequency_hz, amplitude_m)
        request = self._motion_request
        assert request is not None
        self.map.mark(frequency_hz, amplitude_m)
        self.motion.caption.setText("Following the motion…")
        self._open.setEnabled(True)
        self._validate()
        if self._job is not None:
            self._job.drop()
        self._job = self.context.background.ask(
            settled_motion, partial(self._show_motion, request), self._fail, request
        )

    def add_recordings(self, paths: object) -> None:
        """Draw the base levels of recordings on the map, if they have a level over frequency."""
        for path in paths if isinstance(paths, (list, tuple)) else ():
            # Ignore files without a level over frequency (noise, dwell); Compare reports unreadable files.
            self.context.background.ask(recorded_response, self._show_level, ignore, Path(path))

    def _show_level(self, level: RecordedLevel) -> None:
        self._levels.append(level)
        self.map.show_level(level)
        self._compare_specimens()

    def _compare_specimens(self) -> None:
        """Warn if the specimen of the map differs from that of a recording drawn on the map."""
        if (request := self.form.value) is not None:
            for difference in (each.difference(request.chosen_specimen) for each in self._levels):
                if difference:
                    self.context.warn(difference)

    def _grow(self, parts: tuple[PartialResult, ...]) -> None:
        for part in parts:
            match part:
                case MapPicture():
                    self.picture, self._is_stale = part, True
                    self.summary.setText(part.text)
                case Trouble():
                    self.context.warn(part.sentence)

    def _show_motion(self, request: MotionRequest, motion: SettledMotion) -> None:
        self.motion.show_motion(motion)
        self._moved.show(request)

    def _fail(self, error: BaseException) -> None:
        self.motion.show_nothing(str(error))
        self._moved.show(None)

    def _validate(self) -> None:
        wanted = self.form.value
        for button in (self._begin, self._finer):
            button.setEnabled(wanted is not None)
        if wanted is not None and self.picture is None:
            self.map.show_range((wanted.start_hz, wanted.stop_hz), (wanted.lowest_m, wanted.highest_m))
        for result in self.displayed_results:
            result.mark()

    def _recolour(self, *_: object) -> None:
        self._is_stale = True

    def _open_in_simulate(self) -> None:
        if self._point is not None:
            self.context.scene_requested.emit(*self._point)
            self.context.page_requested.emit(SIMULATE)

    def _buttons(self) -> QLayout:
        self._begin = push_button("&Map", "Start the computation in a separate process", self.begin, "first")
        self._finer = push_button("Fi&ner", "Compute only the visible range of the map", self.begin_in_sight)
        return row((self._begin, 1), (self._finer, 1), (self.simulator.cancel_button, 1))

    def _answer(self) -> QWidget:
        self.quantity = Choice("Quantity shown by the colours of the map", items=COLOURINGS)
        self.quantity.currentIndexChanged.connect(self._recolour)
        self._open = push_button(
            "&Open in Simulate",
            "Simulate a frequency range around this point, with error estimates",
            self._open_in_simulate,
        )
        self._open.setEnabled(False)
        legend = QLabel(" ".join(_legend_entry(*each) for each in MOTION_CLASSES))
        legend.setWordWrap(True)
        legend.setAccessibleName("Colours of the kinds of motion")
        below = row(self.quantity, (self.summary, 1), self._open)
        shares = (MAP_SHARE, 1000 - MAP_SHARE)
        answer = splitter("Map and motion", column(legend, (self.map, 1), below), self.motion, shares)
        answer.setChildrenCollapsible(False)
        return answer


def _legend_entry(name: str, colour: str) -> str:
    """Return a coloured square and a name; a frame makes a square in the background's colour visible."""
    unbroken = name.replace(" ", "&nbsp;").replace("-", "&#8209;")
    return f'<span style="background:{colour}; color:#808080">☐</span>&nbsp;{unbroken}&nbsp;&nbsp;'
