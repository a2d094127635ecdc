"""Plots of a recording in the visible time range: signals, spectrogram and estimated motion of m1."""

from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF, QSignalBlocker, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QLabel, QTabWidget, QVBoxLayout, QWidget

from vibench.acquisition.recording import Recording
from vibench.acquisition.rig import RESPONSE_ROLES
from vibench.analysis.hidden_motion import LONGEST_VIEW_S, HiddenView, HiddenViewRequest, Numbers, hidden_view
from vibench.analysis.live import (
    DensityPicture,
    RecordingOverview,
    RowSpacing,
    SpectrogramRequest,
    recording_spectrogram,
)
from vibench.sim import shipped_specimens

from ...background import Background, LatestRequest
from ...forms.editor import Choice
from ...page.page import DisplayedResult
from ...plots.axis import FREQUENCY, LOG_FREQUENCY, TIME, PlotAxis
from ...plots.line_style import LIMIT, Dash, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import ElidedLabel, fill_box, label_for, row, tick_box
from ...widgets.theme import Theme
from ...widgets.units import SentenceLabel, plain_unit
from .recording_table import role_text
from .time_histories import RecordingTimeHistories

_WAIT_MS = 250
"""Delay from the last change of the visible range to the computation [ms]."""
CHOOSE = "Choose a recording in the list above."
Request = TypeVar("Request", bound=HiddenViewRequest | SpectrogramRequest)
Found = TypeVar("Found", bound=HiddenView | DensityPicture)


class _RangePicture(QWidget, Generic[Request, Found]):
    """Plot of the visible time range, computed while its tab is visible.

    Subclasses define `_request_for`, `_draw` and `_erase`.
    """

    plot: Plot
    caption: QLabel

    def __init__(
        self, name: str, background: Background, compute: Callable[[Request], Found], *plots: Plot
    ) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._recording: Recording | None = None
        self._view_s = (0.0, 0.0)
        self._request: object = None
        self.result = DisplayedResult(lambda: self._request, *plots)
        self._latest_request: LatestRequest[Request, Found] = LatestRequest(
            background, compute, self._show, lambda error: self._clear(str(error)), _WAIT_MS, self
        )

    @property
    def is_busy(self) -> bool:
        """Whether a plot is being computed."""
        return self._latest_request.is_busy

    def show_recording(self, recording: Recording | None, hint: str) -> None:
        """Show another recording, or no recording; ``hint`` is shown until there is a plot."""
        self._recording = recording
        self._latest_request.drop()
        self._clear(hint)

    def show_view(self, low_s: float, high_s: float) -> None:
        """If this tab is visible, compute the plot of a time range [s]."""
        self._view_s = (low_s, high_s)
        self._ask()

    def showEvent(self, event: QShowEvent) -> None:
        """Start the computation that was postponed while the tab was hidden."""
        super().showEvent(event)
        self._ask()

    def _ask(self) -> None:
        low_s, high_s = self._view_s
        if not self.isVisible() or self._recording is None or not high_s > low_s:
            return
        request = self._request_for(self._recording, low_s, high_s)
        if isinstance(request, str):
            self._latest_request.drop()
            self._clear(request)
            return
        self._request = request
        self.result.mark()
        self.caption.setText("estimating…")
        self._latest_request.ask(request)

    def _show(self, found: Found) -> None:
        self.result.show(found.request)
        self._draw(found)

    def _clear(self, hint: str) -> None:
        self.result.show(None)
        self.caption.setText("")
        self._erase(hint)

    def _request_for(self, recording: Recording, low_s: float, high_s: float) -> Request | str:
        """Return the request to compute a time range [s], or the reason why it cannot be computed."""
        raise NotImplementedError

    def _draw(self, found: Found) -> None:
        """Draw a computed result."""
        raise NotImplementedError

    def _erase(self, hint: str) -> None:
        """Show a hint instead of a result."""
        raise NotImplementedError


_RELATIVE = PlotAxis("p = y - z", "m", short="p")
_ANOTHER = "another file…"


class HiddenMotionView(_RangePicture[HiddenViewRequest, HiddenView]):
    """Estimated motion p of m1 between its stops, with and without a contact model."""

    def __init__(self, theme: Theme, background: Background) -> None:
        plot = Plot("Hidden motion", TIME, _RELATIVE, theme).with_legend()
        super().__init__("Hidden motion", background, hidden_view, plot)
        self.plot = plot
        self.tracked = self.plot.curve(curve_style(0), "tracked")
        self.free = self.plot.curve(curve_style(1, Dash.DOTTED), "without a contact model")
        self._stops = [self.plot.level(LIMIT, nan, "stop") for _ in range(2)]
        self.caption = SentenceLabel(rank="second")
        self.specimen = Choice(
            "Specimen of the hidden motion",
            "Specimen whose springs, masses and stops are used for the estimate",
        )
        self.specimen.addItem("as the recording describes it", "")
        for name in shipped_specimens():
            self.specimen.addItem(name, name)
        self.specimen.addItem(_ANOTHER, "")
        self.specimen.activated.connect(self._choose_specimen)
        self.find_numbers = tick_box(
            "Find its parameters",
            "Estimate gaps, m1, springs, dampers and contact law from the visible collisions",
            lambda _is_on: self._ask(),
        )
        chosen = row(QLabel("Specimen"), self.specimen, self.find_numbers, 1)
        fill_box(QVBoxLayout(self), chosen, self.caption, (self.plot, 1)).setContentsMargins(0, 4, 0, 0)
        self._clear(CHOOSE)

    def _request_for(self, recording: Recording, low_s: float, high_s: float) -> HiddenViewRequest | str:
        if high_s - low_s > LONGEST_VIEW_S:
            return f"Zoom in to {LONGEST_VIEW_S:g} s or less: p oscillates at about 1 kHz."
        numbers = Numbers.FOUND if self.find_numbers.isChecked() else Numbers.AS_DESCRIBED
        return HiddenViewRequest(Path(recording.path), low_s, high_s, self.specimen.currentData(), numbers)

    def _choose_specimen(self, place: int) -> None:
        """Use another specimen; the last entry opens a file dialog and adds the chosen file to the list."""
        if self.specimen.itemText(place) == _ANOTHER:
            given, _ = QFileDialog.getOpenFileName(self, "Specimen", "", "Specimens (*.toml)")
            if given:
                self.specimen.insertItem(place, Path(given).name, given)
            self.specimen.setCurrentIndex(place if given else 0)
        self._ask()

    def _draw(self, found: HiddenView) -> None:
        self.plot.with_hint("")
        self.tracked.setData(found.time_s, found.p, connect="finite")
        self.free.setData(found.time_s, found.free_p, connect="finite")
        for line, place in zip(self._stops, found.stops_m, strict=True):
            self.plot.move_level(line, place)
        self.caption.setText(found.sentence)
        self.plot.setXRange(found.request.low_s, found.request.high_s, padding=0.0)

    def _erase(self, hint: str) -> None:
        for curve in (self.tracked, self.free):
            curve.setData([], [])
        for line in self._stops:
            self.plot.move_level(line, nan)
        self.plot.with_hint(hint)
        self.plot.viewport().update()


_HIGHEST_HZ = (500.0, 1000.0, 2000.0, 5000.0, 20_000.0)
_USUAL = 2
_WIDTHS_HZ = (None, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Line spacings that users can choose [Hz]; None derives the spacing from the visible time range."""
_BAR_EM = 4
"""Width of the colour scale with its label, in font heights."""
_SHOWN_DB = 80.0
"""Range of the colour scale below the strongest spectral line [dB]."""


class SpectrogramView(_RangePicture[SpectrogramRequest, DensityPicture]):
    """Spectrogram: frequency over time; colours show the power spectral density in dB."""

    zoomed = Signal(float, float)
    """Emitted with the time range [s] after a zoom with the mouse."""

    def __init__(self, theme: Theme, background: Background) -> None:
        plots = {
            RowSpacing.LINEAR: Plot("Spectrogram", TIME, FREQUENCY, theme),
            RowSpacing.LOGARITHMIC: Plot("Spectrogram, logarithmic", TIME, LOG_FREQUENCY, theme),
        }
        super().__init__("Spectrogram", background, recording_spectrogram, *plots.values())
        self._plots = plots
        self.channel, self.spacing = Choice(), Choice(items=RowSpacing)
        self.highest = Choice(items=(f"{highest_hz:g} Hz" for highest_hz in _HIGHEST_HZ))
        self.highest.setCurrentIndex(_USUAL)
        self.line_width = Choice()
        for width_hz in _WIDTHS_HZ:
            self.line_width.addItem("automatic" if width_hz is None else f"{width_hz:g} Hz", width_hz)
        self.caption = ElidedLabel(rank="second")
        self._images = {spacing: _Image(plot) for spacing, plot in self._plots.items()}
        for plot in self._plots.values():
            plot.getViewBox().sigRangeChangedManually.connect(self._zoom)
        self._lay_out()
        for choice in (self.channel, self.spacing, self.highest, self.line_width):
            choice.currentIndexChanged.connect(lambda _index: self._ask())

    @property
    def plot(self) -> Plot:  # type: ignore[override] # the spacing selects one of two
        """Plot with the selected scale of the frequency axis."""
        return self._plots[self._spacing]

    @property
    def image(self) -> "_Image":
        """Image with the selected scale of the frequency axis."""
        return self._images[self._spacing]

    def show_recording(self, recording: Recording | None, hint: str) -> None:
        """Show another recording, or no recording, and list the recording's channels for selection."""
        super().show_recording(recording, hint)
        roles = () if recording is None else recording.roles
        if roles != tuple(self.channel.itemData(row) for row in range(self.channel.count())):
            with QSignalBlocker(self.channel):
                self.channel.clear()
                for role in roles:
                    self.channel.addItem(role_text(role), role)
                usual = RESPONSE_ROLES[0].value
                self.channel.setCurrentIndex(roles.index(usual) if usual in roles else len(roles) - 1)

    def retheme(self, theme: Theme) -> None:
        """Change the colours of the scales."""
        for image in self._images.values():
            image.retheme(theme)

    def _zoom(self, *_: object) -> None:
        low_s, high_s = self.plot.getViewBox().viewRange()[0]
        self.zoomed.emit(float(low_s), float(high_s))

    @property
    def _spacing(self) -> RowSpacing:
        return list(RowSpacing)[self.spacing.currentIndex()]

    def _ask(self) -> None:
        for spacing, plot in self._plots.items():
            plot.setVisible(spacing is self._spacing)
        if self.channel.count():
            super()._ask()

    def _request_for(self, recording: Recording, low_s: float, high_s: float) -> SpectrogramRequest | str:
        rate_hz = recording.sample_rate_hz
        return SpectrogramRequest(
            path=Path(recording.path),
            role=str(self.channel.currentData()),
            start=int(low_s * rate_hz),
            stop=int(np.ceil(high_s * rate_hz)),
            highest_hz=_HIGHEST_HZ[self.highest.currentIndex()],
            spacing=self._spacing,
            resolution_hz=self.line_width.currentData(),
        )

    def _draw(self, found: DensityPicture) -> None:
        self._images[found.request.spacing].show_picture(found)
        self.caption.setText(
            f"Hann windows of {1e3 * found.segment_s:.3g} ms, lines {found.resolution_hz:.3g} Hz wide, "
            f"all samples used"
        )

    def _erase(self, hint: str) -> None:
        for image in self._images.values():
            image.clear(hint)

    def _lay_out(self) -> None:
        bar = QHBoxLayout()
        for text, choice, tip in (
            ("Channel", self.channel, "Channel shown in the spectrogram"),
            ("Frequencies", self.spacing, "Scale of the vertical axis"),
            ("up to", self.highest, "Upper end of the frequency axis"),
            ("lines", self.line_width, "Spectral line width: narrow resolves frequency, wide resolves time"),
        ):
            choice.setToolTip(tip)
            fill_box(bar, label_for(text, choice, f"Spectrogram: {text.lower()}"), choice)
        bar.addWidget(self.caption, 1)
        plots = ((plot, 1) for plot in self._plots.values())
        fill_box(QVBoxLayout(self), bar, *plots).setContentsMargins(0, 4, 0, 0)


class _Image:
    def __init__(self, plot: Plot) -> None:
        self._plot = plot
        self.item = pg.ImageItem(axisOrder="row-major")
        plot.addItem(self.item)
        plot.setMouseEnabled(x=True, y=False)
        plot.read_more = self._level_at
        self.bar = pg.ColorBarItem(colorMap=pg.colormap.get("viridis"), interactive=False, width=14)
        self.bar.setImageItem(self.item, insert_in=plot.getPlotItem())
        self.bar.axis.setWidth(_BAR_EM * plot.fontMetrics().height())
        self.clear(CHOOSE)

    def clear(self, hint: str) -> None:
        """Clear the image and show a hint."""
        self.item.clear()
        self.bar.hide()
        self._plot.with_hint(hint)
        self._plot.viewport().update()

    def _level_at(self, across: float, up: float) -> str:
        if self.item.image is None:
            return ""
        place = self.item.mapFromParent(QPointF(across, up))
        rows, columns = self.item.image.shape
        row, column = int(np.floor(place.y())), int(np.floor(place.x()))
        if not (0 <= row < rows and 0 <= column < columns):
            return ""
        return f"{self.item.image[row, column]:.1f} {self.bar.axis.labelText}"

    def show_picture(self, found: DensityPicture) -> None:
        """Draw a spectrogram; its colours cover a fixed level range below the strongest spectral line."""
        bottom, top = map(self._plot.scales[1].position, found.frequency_hz)
        left, right = found.time_s
        self.item.setImage(found.decibel, autoLevels=False)
        self.item.setRect(QRectF(left, bottom, right - left, top - bottom))
        known = found.decibel[np.isfinite(found.decibel)]
        strongest = float(np.max(known)) if known.size else 0.0
        self.bar.setLevels((strongest - _SHOWN_DB, strongest))
        self.bar.axis.setLabel(f"dB re 1 ({plain_unit(found.unit)})²/Hz")
        self.bar.show()
        self._plot.with_hint("")
        self._plot.setXRange(left, right, padding=0.0)
        self._plot.setYRange(max(bottom, 0.0), top, padding=0.0)

    def retheme(self, theme: Theme) -> None:
        """Change the colours of the scale."""
        self.bar.axis.setPen(pg.mkPen(theme.line))
        self.bar.axis.setTextPen(pg.mkPen(theme.text))


class Pictures(QTabWidget):
    """Tabs that show the same time range of the same recording in different ways."""

    def __init__(self, theme: Theme, background: Background) -> None:
        super().__init__()
        self.setAccessibleName("Pictures of the recording")
        self.setDocumentMode(True)
        self.time_histories = RecordingTimeHistories(theme)
        self.spectrogram = SpectrogramView(theme, background)
        self.addTab(self.time_histories, "Tim&e")
        self.addTab(self.spectrogram, "&Spectrogram")
        self.hidden_motion = HiddenMotionView(theme, background)
        self.addTab(self.hidden_motion, "Hi&dden motion")
        self.time_histories.range_changed.connect(self._show_view)
        self.spectrogram.zoomed.connect(self.time_histories.show_range)

    def show_recording(self, overview: RecordingOverview | None, hint: str) -> None:
        """Show another recording, or no recording; ``hint`` explains empty plots."""
        recording = None if overview is None else overview.recording
        for picture in (self.spectrogram, self.hidden_motion):
            picture.show_recording(recording, hint)
        self.time_histories.show_recording(overview)
        self._show_view()

    def _show_view(self) -> None:
        for picture in (self.spectrogram, self.hidden_motion):
            picture.show_view(*self.time_histories.view_s)
