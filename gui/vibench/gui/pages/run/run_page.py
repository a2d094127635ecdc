"""The Run page: arm, start and watch a test; plots show the newest samples."""

from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFormLayout,
    QGroupBox,
    QLabel,
    QSizePolicy,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition.engine import DRIVING, EngineClient, EngineState, EngineStatus, RunStatus, TwinSwitch
from vibench.acquisition.plan import EXCITATION_KINDS, Family, Measurement
from vibench.acquisition.recording import REJECTED
from vibench.acquisition.rig import channels_of
from vibench.analysis.live import OVER_SHARE, Level, LevelVerdict, LiveView

from ...engine_link import find_measurement
from ...forms.editor import Choice
from ...forms.quantity_edit import LineField
from ...page.app_context import AppContext
from ...page.page import DisplayedResult, Page, SideAndPicture
from ...page.user_actions import UserActions
from ...widgets.boxes import (
    ProgressBar,
    column,
    fill_box,
    label_for,
    paint_hint,
    push_button,
    row,
    splitter,
)
from ...widgets.notice import FILES, RUN, clock, outcome_text
from ...widgets.theme import Theme, Tone
from ...widgets.units import SentenceLabel
from .live_plots import (
    USUAL_SPAN_S,
    HiddenMotionPlot,
    PortraitPlot,
    SpectrumPlot,
    SweepPlot,
    TimeHistoryPlots,
    TransmissibilityPlot,
    channel_word,
    sweep_envelope,
    sweep_history,
)

_ROW = 1.9
"""Height of the meter of one channel, in font heights."""
_WORDS = {LevelVerdict.OVER: "✖ over", LevelVerdict.GOOD: "", LevelVerdict.QUIET: "⚠ quiet"}


class LevelMeters(QWidget):
    """Level meters, one row per channel, with peak and limit."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._rows: tuple[tuple[str, Level], ...] = ()
        self.setAccessibleName("Level meters")
        self.setToolTip(f"Peak of each channel as a share of its full scale; red above {OVER_SHARE:.0%}")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_view(self, view: LiveView) -> None:
        """Show the newest levels of all channels."""
        words = [channel_word(channel.role) for channel in view.channels]
        rows = tuple(zip(words, view.levels, strict=False))
        if len(rows) != len(self._rows):
            self.updateGeometry()
        self._rows = rows
        text = ", ".join(f"{word} {level.held_share:.0%} {_WORDS[level.verdict]}" for word, level in rows)
        self.setAccessibleDescription(text)
        self.update()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self._theme = theme
        self.update()

    def sizeHint(self) -> QSize:
        """Return the size that fits the number of channels, but at least the size for four channels."""
        height = self.fontMetrics().height()
        return QSize(12 * height, round(_ROW * height * max(4, len(self._rows))))

    def minimumSizeHint(self) -> QSize:
        """Return the smallest size that shows the text."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the level meter of every channel."""
        painter = QPainter(self)
        if not self._rows:
            paint_hint(painter, self.rect(), "Channel levels appear while a test runs.", self._theme.muted)
        row_height = _ROW * self.fontMetrics().height()
        for number, (word, level) in enumerate(self._rows):
            self._paint_row(painter, QRectF(0, number * row_height, self.width(), row_height), word, level)

    def _paint_row(self, painter: QPainter, area: QRectF, word: str, level: Level) -> None:
        text_height = self.fontMetrics().height()
        ink = self._theme.text if self.isEnabled() else self._theme.muted
        painter.setPen(QColor(ink))
        line = QRectF(area.left(), area.top(), area.width(), text_height)
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft, word)
        text = f"{_WORDS[level.verdict]}  {100 * level.held_share:.1f} %"
        painter.drawText(line, Qt.AlignmentFlag.AlignRight, text)
        bar = QRectF(area.left(), area.top() + text_height + 1, area.width(), 0.45 * text_height)
        painter.fillRect(bar, QColor(self._theme.raised))
        tone = Tone.DANGER if level.verdict is LevelVerdict.OVER else Tone.GOOD
        used = QRectF(bar)
        used.setWidth(bar.width() * min(level.peak_share, 1.0))
        painter.fillRect(used, QColor(self._theme.tones[tone].ground if self.isEnabled() else ink))
        danger = self._theme.tones[Tone.DANGER].ground
        for share, colour in ((level.held_share, ink), (OVER_SHARE, danger)):
            mark = QRectF(bar.left() + bar.width() * min(share, 1.0) - 1, bar.top(), 2, bar.height())
            painter.fillRect(mark, QColor(colour))


SPANS_S = (0.05, 0.2, 1.0, 2.0, 5.0, 10.0)
"""Time ranges that can be chosen for the time histories [s]."""


class WatchCard(QGroupBox):
    """Box with progress, averages, impacts, time range, marks, and a switch for the live twin."""

    mark_wanted = Signal(str)
    reject_requested = Signal()
    """Emitted to exclude the current average of a noise test from all results."""
    twin_requested = Signal(object)

    def __init__(self, theme: Theme) -> None:
        super().__init__("Watch")
        self.progress = ProgressBar("Progress of the run", "no run yet")
        self.impacts = QLabel("0")
        self.impacts.setAccessibleName("Impacts so far")
        self.impacts.setProperty("rank", "title")
        self.impacts.setToolTip("Number of jumps in the acceleration of m0, computed from its sensor")
        self.meters = LevelMeters(theme)
        self.span = Choice(tip="Seconds in a time history", items=(f"{span_s:g} s" for span_s in SPANS_S))
        self.span.setCurrentIndex(SPANS_S.index(USUAL_SPAN_S))
        self.freeze = QCheckBox("Freeze the picture  (Space)")
        self.freeze.setToolTip("Freeze the plots; the recording continues")
        self.twin = QCheckBox("Live twin")
        self.twin.setToolTip(
            "Estimate the motion of m1 between its stops, and report changes of the specimen. The estimate "
            "runs in a separate process, so the measurement never waits for the estimate"
        )
        self.twin.clicked.connect(
            lambda is_on: self.twin_requested.emit(TwinSwitch.ON if is_on else TwinSwitch.OFF)
        )
        self._begun = 0
        self.averages = QLabel("–")
        self.averages.setToolTip("Averages of a noise test: number started, number planned")
        self.reject_button = push_button(
            "Reject this one", "Exclude the current average from all results", self.reject_requested.emit
        )
        self.mark = LineField("event")
        self.mark.setToolTip("Text of the mark in the recording")
        self.mark_button = push_button(
            "Mark  (M)", "Put a mark with this text at the next sample of the recording", self.wish_mark
        )
        self._lay_out()

    @property
    def span_s(self) -> float:
        """Time range of the time histories [s]."""
        return SPANS_S[self.span.currentIndex()]

    def wish_mark(self) -> None:
        """Ask the engine for a time mark in the recording, with the typed text."""
        self.mark_wanted.emit(self.mark.text().strip() or "event")

    def show_status(self, status: EngineStatus | None, averages: int) -> None:
        """Show the state of the run; ``averages`` is the planned number of averages for noise, else 0."""
        run = None if status is None else status.run
        is_running = status is not None and status.state in DRIVING
        self.mark_button.setEnabled(is_running)
        if run is None or not is_running or not averages:
            self._begun = 0
        else:
            # While an average settles, the status still contains the number of the previous average.
            self._begun = int(run.numbers.get("realisation", self._begun - 1)) + 1
        self.reject_button.setEnabled(self._begun > 0)
        self.averages.setText(f"{self._begun} of {averages}" if self._begun else "–")
        self.twin.setEnabled(status is not None and status.bench is not None)
        self.twin.setChecked(status is not None and status.twin is not None)
        if run is not None and is_running:
            self.progress.show_share(run.elapsed_s / max(run.total_s, 1e-9), _progress_text(run))
        elif self.progress.value():
            self.progress.setFormat("the last run has ended")

    def show_view(self, view: LiveView) -> None:
        """Show the impact count of the run and the levels of its channels."""
        self.impacts.setText(f"{view.impacts}")
        self.meters.show_view(view)

    def _lay_out(self) -> None:
        form = QFormLayout()
        averages = row((self.averages, 1), self.reject_button)
        for text, widget, field in (
            ("Impacts", self.impacts, self.impacts),
            ("Averages", self.averages, averages),
            ("Histories show", self.span, self.span),
        ):
            form.addRow(label_for(text, widget), field)
        self.mark.setAccessibleName("Text of the mark")
        marks = row((self.mark, 1), self.mark_button)
        fill_box(QVBoxLayout(self), self.progress, form, self.meters, self.freeze, self.twin, marks)


def _progress_text(run: RunStatus) -> str:
    left = f"{run.run_state.value.replace('_', ' ')}, {clock(run.total_s - run.elapsed_s)} left"
    return left if run.until is None else f"{left} at most; {run.until.sentence}"


_HINTS = {
    EngineState.CLOSED: "No bench is open. Open a bench on the Rig page (Ctrl+1).",
    EngineState.OPENING: "The bench is being opened.",
    EngineState.CHECKING: "The bench is being checked.",
    EngineState.FAULT: "The bench is not usable. Open it again on the Rig page (Ctrl+1).",
}


UNREAD = "Read to the end  (PgDn)"


class ArmCard(QGroupBox):
    """Buttons to arm, start, cancel and hold, with the description of the armed plan."""

    news = Signal()
    """Emitted when another plan was armed; its description must be shown from the beginning."""

    def __init__(self, actions: UserActions) -> None:
        super().__init__("What will happen")
        self.words = SentenceLabel(name="What will happen")
        self.arm_button = push_button(
            "A&rm…  (Ctrl+Return)", "Arm, and describe what will be played", actions.arm_test, "first"
        )
        self.cancel_button = push_button("Cancel", "Disarm; nothing was played", actions.disarm)
        self.start_button = push_button("▶ Start  (F5)", "Start the drive", actions.start, "first")
        self.hold_button = push_button("Hold", "Hold the run; the drive stays on", actions.hold_or_resume)
        fill_box(QVBoxLayout(self), self.words)
        self.buttons = column(
            self.arm_button, row(self.cancel_button, (self.start_button, 1)), self.hold_button
        )
        """Buttons, which do not scroll with the description."""
        self._armed: tuple[str, ...] = ()
        """Description of the armed plan; empty if nothing is armed."""
        self._read: tuple[str, ...] = ()
        """Description that the user has scrolled to the end, and therefore may have read."""

    @property
    def is_read(self) -> bool:
        """Whether the user has scrolled to the description's end; only then can the run be started."""
        words = self.words
        end = QPoint(0, words.height() - 1)
        is_whole = words.height() >= words.heightForWidth(words.width())
        if self._armed and is_whole and words.visibleRegion().contains(end):
            self._read = self._armed
        return self._read == self._armed

    def show_status(self, status: EngineStatus | None, test: str, reason: str) -> None:
        """Show the possible commands; ``reason`` says why the test cannot be armed, or is empty."""
        state = EngineState.CLOSED if status is None else status.state
        armed = None if status is None else status.armed
        is_armed = state is EngineState.ARMED and armed is not None
        words: tuple[str, ...] = ()
        if is_armed and armed is not None:
            left = f"Disarms itself in {armed.expires_in_s:.0f} s."
            words = (f"Campaign {armed.campaign}", *armed.lines)
            self._show_words("\n".join((*words, left)))
        elif state in DRIVING:
            self._show_words("Plan and limits cannot be changed during a run. STOP ramps down; Esc aborts.")
        else:
            self._show_words(_HINTS.get(state) or reason or f"Ready to arm: {test}")
        self.arm_button.setVisible(not is_armed and state not in DRIVING)
        self.arm_button.setEnabled(state is EngineState.READY and not reason)
        self.cancel_button.setVisible(is_armed)
        self.start_button.setVisible(is_armed)
        self.hold_button.setVisible(state in (EngineState.RUNNING, EngineState.HELD))
        self.hold_button.setText("Go on" if state is EngineState.HELD else "Hold")
        if words != self._armed:
            self._armed, self._read = words, ()
            if words:
                # Give Cancel the focus: the key press that armed the plan then cannot also start it.
                self.cancel_button.setFocus()
                self.news.emit()
        self.start_button.setEnabled(self.is_read)
        self.start_button.setText("▶ Start  (F5)" if self.is_read else UNREAD)

    def _show_words(self, text: str) -> None:
        if self.words.sentence != text:
            self.words.setText(text)


LAYOUT_ROUNDS = 4
"""Number of layout passes that Qt needs until the scroll range fits the wrapped text."""
LivePlot: TypeAlias = TransmissibilityPlot | SpectrumPlot | SweepPlot | PortraitPlot


class RunPage(Page):
    """Page that displays the engine's run; the page itself keeps no data of the run."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        theme = context.theme
        self._view: LiveView | None = None
        self._ended: Path | None = None
        self._drawn: tuple[int, int, int, float] | None = None
        self._was_driving = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.arm_card = ArmCard(UserActions(context, self))
        self.watch_card = WatchCard(theme)
        self.time_histories = TimeHistoryPlots(theme)
        self.frequency_response = TransmissibilityPlot(theme)
        self.spectrum = SpectrumPlot(theme)
        self.history = sweep_history(theme)
        self.envelope = sweep_envelope(theme)
        self.portrait = PortraitPlot(theme)
        self.hidden_motion = HiddenMotionPlot(theme)
        self.left_tabs, self.right_tabs = QTabWidget(), QTabWidget()
        self.look_button = push_button(
            "Look at the recording", "Show the last recording on the Files page", self._look
        )
        self.summary = SentenceLabel(name="How the last run ended")
        card = self.watch_card
        self._result = DisplayedResult(
            lambda: self._wanted_view, self.time_histories, card.impacts, card.meters, *self._pictures
        )
        self.displayed_results = (self._result,)
        self._lay_out()
        self._connect()
        self._show_channels()

    @property
    def is_done(self) -> bool:
        """Whether a recording was made since the window opened."""
        return self._ended is not None

    def refresh(self) -> None:
        """Draw the newest samples, unless the user has frozen the plots."""
        status = self.context.bridge.status
        measurement = self.context.selection.measurement
        test, reason = "", "The test is not complete; see the Test page (Ctrl+2)."
        if measurement is not None:
            kind = EXCITATION_KINDS[measurement.excitation.kind]
            test, reason = f"{measurement.name} ({kind.label})", ""
        self.arm_card.show_status(status, test, reason)
        if self.context.bridge.is_driving and not self._was_driving:
            # The button with the focus was just hidden. Otherwise Qt would move the focus to the next list.
            self.setFocus()
        self._was_driving = self.context.bridge.is_driving
        played = self._measurement
        self.watch_card.show_status(status, 0 if played is None else played.excitation.stretches)
        if not self.watch_card.freeze.isChecked() and self.hidden_motion.isVisible():
            self.hidden_motion.show_status(status)
        view = self.context.bridge.view
        self._result.mark()
        if view is None or self.watch_card.freeze.isChecked():
            return
        if view is not self._view:
            self._begin(view)
        tabs_shown = (self.left_tabs.currentIndex(), self.right_tabs.currentIndex())
        wanted = (view.next_sample, *tabs_shown, self.watch_card.span_s)
        if wanted == self._drawn:
            return
        self._drawn = wanted
        self.watch_card.show_view(view)
        self.time_histories.show_view(view, self.watch_card.span_s)
        for tabs in (self.left_tabs, self.right_tabs):
            shown = tabs.currentWidget()
            if isinstance(shown, LivePlot):
                shown.show_view(view)

    @property
    def _wanted_view(self) -> LiveView | None:
        """The newest run or, while the plots are frozen or hidden, the run that they show."""
        view = self.context.bridge.view
        is_frozen = view is not None and self.watch_card.freeze.isChecked()
        return self._view if is_frozen or not self.isVisible() else view

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Freeze with Space, mark with M, scroll with PgDn, unless the focused widget uses the key."""
        bar = self._parts.side.verticalScrollBar()
        match event.key():
            case Qt.Key.Key_PageDown | Qt.Key.Key_PageUp:
                step = bar.pageStep() if event.key() == Qt.Key.Key_PageDown else -bar.pageStep()
                bar.setValue(bar.value() + step)
            case Qt.Key.Key_Space:
                self.watch_card.freeze.toggle()
            case Qt.Key.Key_M if event.modifiers() == Qt.KeyboardModifier.NoModifier:
                self.watch_card.wish_mark()
            case _:
                super().keyPressEvent(event)

    @property
    def _pictures(self) -> tuple[LivePlot, ...]:
        return self.frequency_response, self.spectrum, self.history, self.envelope, self.portrait

    def _begin(self, view: LiveView) -> None:
        """Clear the plots, show the run's prediction, and select the plots for its excitation."""
        self._view = view
        self._result.show(view)
        measurement = self._measurement
        prediction = self.context.selection.prediction
        if prediction is not None and (
            measurement is None or prediction.measurement.excitation != measurement.excitation
        ):
            prediction = None
        for picture in self._pictures:
            picture.clear()
        for shown_beside in (self.frequency_response, self.history, self.envelope):
            shown_beside.show_prediction(prediction)
        if measurement is not None:
            for plot in (self.history.plot, self.envelope.plot, self.frequency_response.magnitude):
                # Fix the range, because samples of an earlier check outside the band would compress the plot.
                plot.setXRange(*measurement.excitation.band_hz, padding=0.03)
        has_a_band = measurement is None or measurement.excitation.family is Family.NOISE
        self.left_tabs.setCurrentWidget(self.frequency_response if has_a_band else self.history)
        self.right_tabs.setCurrentWidget(self.spectrum if has_a_band else self.portrait)

    def _show_end(self, path: Path) -> None:
        self._ended = path
        status = self.context.bridge.status
        rows = () if status is None else status.rows
        outcome = next((outcome_text(row.state, row.reason) for row in rows if row.file == str(path)), "")
        self.summary.setText(f"Last run: {path.name}, {outcome}")
        self.look_button.show()

    def _show_channels(self) -> None:
        """Create the plots before a run, because creating them during the run would delay the display."""
        rig = self.context.selection.rig
        if rig is not None:
            self.time_histories.show_channels(
                tuple((each.role.value, each.unit) for each in channels_of(rig))
            )

    def _look(self) -> None:
        if self._ended is not None:
            self.context.recording_requested.emit(self._ended)
            self.context.page_requested.emit(FILES)

    def _mark(self, text: str) -> None:
        if self.context.bridge.state in (EngineState.RUNNING, EngineState.HELD):
            self.context.bridge.order(EngineClient.mark, text)

    @property
    def _measurement(self) -> Measurement | None:
        status = self.context.bridge.status
        run = None if status is None else status.run
        return None if run is None else find_measurement(self.context.bridge.campaign, run.name)

    def _reject(self) -> None:
        played, view = self._measurement, self.context.bridge.view
        if played is not None and view is not None:
            view.leave_out(played.excitation.playing_s / played.excitation.stretches)
            self._mark(REJECTED)

    def _turn_twin(self, switch: TwinSwitch) -> None:
        self.context.bridge.order(EngineClient.turn_twin, switch)
        if switch is TwinSwitch.ON:
            self.right_tabs.setCurrentWidget(self.hidden_motion)

    def _is_armed_read(self) -> bool:
        """Return whether the description was read, after finishing the layout of a new description."""
        self.refresh()
        for _ in range(LAYOUT_ROUNDS):
            QCoreApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)
        return self.arm_card.is_read

    def _connect(self) -> None:
        self.arm_card.news.connect(lambda: self._parts.side.verticalScrollBar().setValue(0))
        self.context.is_armed_read = self._is_armed_read
        self.watch_card.mark_wanted.connect(self._mark)
        self.watch_card.reject_requested.connect(self._reject)
        # Redraw at once: before the next tick, the plots of a finished run would seem to show this run.
        self.watch_card.freeze.toggled.connect(lambda _: self.refresh())
        self.watch_card.twin_requested.connect(self._turn_twin)
        self.context.recording_made.connect(self._show_end)
        self.context.selection.rig_changed.connect(self._show_channels)

    def _lay_out(self) -> None:
        left = column(self.arm_card, self.watch_card, self.summary, self.look_button, 1)
        self.look_button.hide()
        for tabs, name, pictures in (
            (self.left_tabs, "Pictures on the left", (self.frequency_response, self.history, self.envelope)),
            (self.right_tabs, "Pictures on the right", (self.spectrum, self.portrait, self.hidden_motion)),
        ):
            tabs.setAccessibleName(name)
            tabs.setDocumentMode(True)
            for picture in pictures:
                picture.setAccessibleName(picture.title)
                tabs.setTabToolTip(tabs.addTab(picture, picture.tab), picture.title)
        across = Qt.Orientation.Horizontal
        below = splitter("Pictures", self.left_tabs, self.right_tabs, (500, 500), across)
        right = splitter("Time histories and pictures", self.time_histories, below, (600, 400))
        right.setStretchFactor(0, 3)
        right.setStretchFactor(1, 2)
        self._parts = SideAndPicture(self.context, RUN, left, right, self.arm_card.buttons)
        fill_box(QVBoxLayout(self), self._parts)
