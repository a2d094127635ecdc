"""Time histories of a recording, one plot per channel; only the visible time range is drawn."""

from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import QLabel

from vibench.acquisition.recording import ChannelHeader, Recording
from vibench.analysis.live import RecordingOverview, zigzag

from ...plots.axis import TIME, PlotAxis
from ...plots.line_style import LIMIT, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...plots.plot_stack import AXIS_EM, Markers, PlotStack
from ...widgets.theme import Theme
from ...widgets.units import plain_unit
from .recording_table import role_text

LEAST_SAMPLES = 8
_STEP, _ZOOM = 0.2, 0.6
_LEAST_EM = 3
SEGMENT = LineStyle(lambda theme: theme.muted, Dash.DOTTED)
_MOST_KEPT = 12
"""Largest number of plots kept for reuse; creating a plot takes ten times as long as drawing it."""
_LABEL_AT = 0.1
"""Vertical position of segment names relative to the plot; low, because the channel name is at the top."""
_NAMED_SHARE = 0.08
"""Length of the shortest segment that is named, relative to the recording."""


@dataclass(eq=False)
class _TimeHistory:
    role: str
    plot: Plot
    curve: pg.PlotDataItem


class RecordingTimeHistories(PlotStack):
    """Plots over a common time axis. Wheel, + and - zoom; arrow keys and dragging scroll; Home shows all."""

    range_changed = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__(theme)
        self.setAccessibleName("Time histories of the recording")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._overview: RecordingOverview | None = None
        self._histories: list[_TimeHistory] = []
        self._kept: dict[tuple[str, str], _TimeHistory] = {}
        self.markers = Markers(0.0, 0.0, self)
        # One move of the view may change the range several times: draw only after the last change.
        self._later = QTimer(self, interval=0, singleShot=True)
        self._later.timeout.connect(self._draw)

    def prepare(self, channel: ChannelHeader) -> None:
        """Create the plot of a channel; creating all plots at once would block the event loop."""
        self._history_of(channel)

    def show_recording(self, overview: RecordingOverview | None) -> None:
        """Show a recording over its whole length; None clears the plots."""
        for history in self._histories:
            self._layout.removeWidget(history.plot)
            history.plot.hide()
        self._histories, self.plots = [], ()
        self._overview = overview
        if overview is None or overview.recording.samples == 0:
            return
        self._histories = [self._history_of(channel) for channel in overview.recording.channels]
        self.plots = tuple(history.plot for history in self._histories)
        for number, history in enumerate(self._histories):
            self._begin(history, number, overview.recording)
        self._forget_others()
        self._mark_segments(overview)
        self._mark_overloads(overview)
        self.markers.draw_in(self.plots)
        for number, share in enumerate((1 / 3, 2 / 3)):
            self.markers.move(number, share * overview.recording.duration_s)
        self._label_last()
        self.show_all()
        self._draw()

    @property
    def view_s(self) -> tuple[float, float]:
        """Visible time range since the first sample [s]."""
        if not self._histories or self._overview is None:
            return (0.0, 0.0)
        low, high = self._histories[0].plot.getViewBox().viewRange()[0]
        return (max(0.0, float(low)), min(float(high), self._overview.recording.duration_s))

    def show_all(self) -> None:
        """Show the time histories over the whole recording."""
        if self._overview is not None:
            self.show_range(0.0, self._overview.recording.duration_s)

    def show_range(self, low_s: float, high_s: float) -> None:
        """Show the time histories in a time range [s]."""
        if self._histories:
            self._histories[0].plot.setXRange(low_s, high_s, padding=0.0)

    def zoom(self, factor: float) -> None:
        """Scale the visible range by ``factor`` about its centre."""
        low_s, high_s = self.view_s
        half_s = 0.5 * factor * (high_s - low_s)
        middle_s = 0.5 * (low_s + high_s)
        self.show_range(middle_s - half_s, middle_s + half_s)

    def move(self, share: float) -> None:  # type: ignore[override] # moves the visible time range
        """Move the visible range to later times, by the fraction ``share`` of its width."""
        low_s, high_s = self.view_s
        step_s = share * (high_s - low_s)
        self.show_range(low_s + step_s, high_s + step_s)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Redraw the time histories for the new width."""
        super().resizeEvent(event)
        self._later.start()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move and zoom the visible time range with keys."""
        match event.key():
            case Qt.Key.Key_Left:
                self.move(-_STEP)
            case Qt.Key.Key_Right:
                self.move(_STEP)
            case Qt.Key.Key_Plus | Qt.Key.Key_Equal | Qt.Key.Key_Up:
                self.zoom(_ZOOM)
            case Qt.Key.Key_Minus | Qt.Key.Key_Down:
                self.zoom(1 / _ZOOM)
            case Qt.Key.Key_Home | Qt.Key.Key_A:
                self.show_all()
            case _:
                super().keyPressEvent(event)
                return
        event.accept()

    def _history_of(self, channel: ChannelHeader) -> _TimeHistory:
        """Return a channel's plot; reuse a plot of an earlier recording if possible."""
        kind = (channel.role, channel.unit)
        if kind not in self._kept:
            up = PlotAxis("", plain_unit(channel.unit))
            plot = Plot(f"{role_text(channel.role)} over time", TIME, up, self._theme, self)
            plot.setMouseEnabled(x=True, y=False)
            plot.setFocusProxy(self)
            title = QLabel(role_text(channel.role), plot)
            title.setTextFormat(Qt.TextFormat.PlainText)
            title.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            title.setBackgroundRole(QPalette.ColorRole.Base)
            title.setAutoFillBackground(True)
            title.move(round((plot.up_em + 1) * self.fontMetrics().height()), 2)
            plot.getViewBox().sigXRangeChanged.connect(self._on_range)
            self._kept[kind] = _TimeHistory(channel.role, plot, plot.curve(curve_style(0)))
        return self._kept[kind]

    def _begin(self, history: _TimeHistory, number: int, recording: Recording) -> None:
        """Set position and limits of a plot for a recording, without drawing the signal."""
        plot, is_last = history.plot, number == len(recording.channels) - 1
        plot.wipe()
        history.curve = plot.curve(curve_style(number))
        em = self.fontMetrics().height()
        plot.setMinimumHeight(_LEAST_EM * em + (AXIS_EM * em if is_last else 0))
        box = plot.getViewBox()
        box.setXLink(None)
        least_s = LEAST_SAMPLES / recording.sample_rate_hz
        box.setLimits(xMin=0.0, xMax=recording.duration_s, minXRange=least_s)
        box.enableAutoRange(x=False, y=False)
        if number:
            box.setXLink(self._histories[0].plot.getViewBox())
        self._layout.addWidget(plot, 1)
        plot.show()

    def _forget_others(self) -> None:
        """If more plots are kept than allowed, delete plots that this recording does not use."""
        for kind, history in list(self._kept.items()):
            if len(self._kept) > _MOST_KEPT and history not in self._histories:
                del self._kept[kind]
                history.plot.deleteLater()

    def _mark_segments(self, overview: RecordingOverview) -> None:
        """Draw a line at the start of each segment; the first plot also names long segments."""
        recording = overview.recording
        begun_s = [each.first_sample / recording.sample_rate_hz for each in recording.segments]
        for history in self._histories:
            history.plot.rules(SEGMENT).show_at(begun_s)
        for segment, at_s in zip(recording.segments, begun_s, strict=True):
            if segment.stop - segment.start > _NAMED_SHARE * recording.samples:
                label = segment.label.replace("_", " ")
                self._histories[0].plot.upright(SEGMENT, at_s, label, _LABEL_AT)

    def _mark_overloads(self, overview: RecordingOverview) -> None:
        rate_hz = overview.recording.sample_rate_hz
        for history in self._histories:
            history.plot.stripes(LIMIT).show_bands(
                (each.first_sample / rate_hz, (each.last_sample + 1) / rate_hz)
                for each in overview.recording.overloads
                if each.channel == history.role
            )

    def _on_range(self, view: pg.ViewBox, _range: object) -> None:
        if not self._histories or view is not self._histories[0].plot.getViewBox():
            return
        self._later.start()
        self.range_changed.emit()

    def _draw(self) -> None:
        if self._overview is None or not self._histories:
            return
        rate_hz = self._overview.recording.sample_rate_hz
        low_s, high_s = self.view_s
        start, stop = int(low_s * rate_hz), int(np.ceil(high_s * rate_hz)) + 1
        columns = max(100, self._histories[0].plot.columns)
        picture = self._overview.picture([history.role for history in self._histories], start, stop, columns)
        for row, history in enumerate(self._histories):
            low, high = picture.low[row], picture.high[row]
            if picture.samples_per_column > 1:
                history.curve.setData(np.repeat(picture.time_s, 2), zigzag(low, high), connect="finite")
            else:
                history.curve.setData(picture.time_s, low, connect="finite")
            known = low[np.isfinite(low)], high[np.isfinite(high)]
            if known[0].size:
                bottom, top = float(known[0].min()), float(known[1].max())
                height = (top - bottom) or 1e-9
                # Leave space for the channel name at the top, so that it does not cover the signal.
                history.plot.setYRange(bottom - 0.06 * height, top + 0.3 * height, padding=0.0)
