"""State of the rig by symbol, word and colour, with the STOP button; visible on every page."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtGui import QAccessible, QAccessibleEvent, QGuiApplication, QResizeEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPlainTextEdit, QPushButton, QSizePolicy

from vibench.acquisition.engine import EngineState, EngineStatus, RunStatus

from ..widgets.boxes import ElidedLabel, fill_box, keep_space, push_button, set_tone
from ..widgets.notice import Notice, NoticeKind, clock
from ..widgets.theme import Tone
from ..widgets.units import SentenceLabel


class StatusField(StrEnum):
    """Fields of the status line, from left to right."""

    RIG = "rig"
    OVERRUNS = "overruns"
    CLIPPED = "clipped"
    DISK = "disk"
    FILE = "file"
    FRAMES = "frames"


class StatusLine(QFrame):
    """Status line; a field that needs attention has a symbol and a colour."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("statusLine")
        self.setAccessibleName("Status line")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 3, 10, 3)
        layout.setSpacing(18)
        self.labels: dict[StatusField, ElidedLabel] = {}
        for field in StatusField:
            label = ElidedLabel()
            label.setAccessibleName(f"Status: {field.value}")
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            self.labels[field] = label
            layout.addWidget(label)
        frames = self.labels[StatusField.FRAMES]
        frames.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._fit()
        # The field with the file name takes the remaining width and is the first to shrink.
        self.labels[StatusField.FILE].setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout.setStretchFactor(self.labels[StatusField.FILE], 1)

    def changeEvent(self, event: QEvent) -> None:
        """Apply a change of the font at once."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange and self.labels:
            self._fit()

    def _fit(self) -> None:
        """Give the last field its largest width, so that other fields do not move when numbers change."""
        frames = self.labels[StatusField.FRAMES]
        frames.setMinimumWidth(frames.fontMetrics().horizontalAdvance("00 fps, latency 0000 ms "))

    def explain(self, field: StatusField, text: str) -> None:
        """Set the tooltip of a field of the status line."""
        if self.labels[field].toolTip() != text:
            self.labels[field].setToolTip(text)

    def show_fields(
        self, texts: Mapping[StatusField, str], marked: frozenset[StatusField] = frozenset()
    ) -> None:
        """Show a text in each field of the status line; ``marked`` are the fields that need attention."""
        for field, label in self.labels.items():
            text = texts.get(field, "")
            tone = Tone.CAUTION.value if field in marked else ""
            shown = f"⚠ {text}" if tone else text
            if label.text() != shown:
                label.setText(shown)
                if field is not StatusField.FRAMES:
                    label.setToolTip(shown)
            set_tone(label, tone)


@dataclass(frozen=True)
class StateIndicator:
    """Symbol, word, colour and details with which the banner shows a state."""

    symbol: str
    word: str
    tone: Tone
    detail: str = ""
    """Text that changes while the state lasts, such as elapsed time and drive level."""
    is_ramping: bool = False
    """Whether the drive is already ramping down; STOP can then only shorten the ramp."""


STOP_TEXT, AT_ONCE_TEXT = "■ STOP: ramp down   (Esc: abort)", "■ STOP: at once   (Esc: abort)"
CLOSED = StateIndicator("○", "NO BENCH", Tone.CALM, "Open a bench on the Rig page")


class Banner(QFrame):
    """Banner with state and STOP; a change of state is announced to screen readers."""

    stop_requested = Signal()
    """Emitted to ramp down as planned; a second press, during the ramp, requests the fastest ramp."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("banner")
        self.setAccessibleName("State of the rig")
        self.indicator = CLOSED
        self._label = QLabel()
        self._label.setObjectName("engine_state")
        self._detail = ElidedLabel()
        self._detail.setAccessibleName("Details of the state")
        self._detail.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._stop = QPushButton(STOP_TEXT)
        self._stop.setObjectName("stop")
        self._stop.setAccessibleName("Stop")
        self._stop.setToolTip(
            "A click ramps the drive down as planned; Esc uses the fastest ramp of the shaker.\n"
            "This is not an emergency stop: in an emergency, switch the amplifier off."
        )
        self._stop.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._stop.clicked.connect(self.stop_requested)
        layout = fill_box(QHBoxLayout(self), self._label, (self._detail, 1), self._stop)
        layout.setContentsMargins(10, 6, 10, 6)
        self._fit()
        self._paint()

    def changeEvent(self, event: QEvent) -> None:
        """Apply a change of font or style sheet at once."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._fit()

    def _fit(self) -> None:
        """Give STOP the width of its longest text, so that the button does not move under the pointer."""
        shown, widths = self._stop.text(), []
        for text in (STOP_TEXT, AT_ONCE_TEXT):
            self._stop.setText(text)
            widths.append(self._stop.sizeHint().width())
        self._stop.setText(shown)
        self._stop.setMinimumWidth(max(widths))

    def show_indicator(self, indicator: StateIndicator) -> None:
        """Show a state of the rig; if the state has not changed, nothing is repainted."""
        if indicator == self.indicator:
            return
        announced = indicator.word != self.indicator.word
        self.indicator = indicator
        self._paint()
        if announced:
            QAccessible.updateAccessibility(QAccessibleEvent(self._label, QAccessible.Event.Alert))

    def _paint(self) -> None:
        indicator = self.indicator
        self._label.setText(f"{indicator.symbol}  {indicator.word}")
        self._label.setAccessibleName(f"State: {indicator.word}")
        self._detail.setText(indicator.detail)
        self._stop.setText(AT_ONCE_TEXT if indicator.is_ramping else STOP_TEXT)
        set_tone(self._label, indicator.tone.value)


OPENING = StateIndicator("◌", "OPENING", Tone.CALM, "Looking for the instruments")
_INDICATORS = {
    EngineState.CLOSED: CLOSED,
    EngineState.OPENING: OPENING,
    EngineState.READY: StateIndicator("●", "READY", Tone.GOOD),
    EngineState.ARMED: StateIndicator("▲", "ARMED", Tone.CAUTION),
    EngineState.RUNNING: StateIndicator("▶", "RUNNING", Tone.ACTIVE),
    EngineState.HELD: StateIndicator("❚❚", "HELD", Tone.CAUTION),
    EngineState.RAMPING_DOWN: StateIndicator("▼", "RAMPING DOWN", Tone.CAUTION, is_ramping=True),
    EngineState.CHECKING: StateIndicator("◍", "CHECKING", Tone.ACTIVE, "A small sine plays for some seconds"),
    EngineState.FAULT: StateIndicator(
        "✖", "FAULT", Tone.DANGER, "Silent; open the bench again on the Rig page"
    ),
}
NEXT_STEPS = {
    EngineState.CLOSED: "Next: Alt+O on the Rig page opens the bench chosen there. F1 lists all keys.",
    EngineState.OPENING: "The bench is being opened.",
    EngineState.READY: "Next: Ctrl+Return arms the test of the Test page (Ctrl+2). F6 checks the bench.",
    EngineState.CHECKING: "The bench is being checked.",
    EngineState.ARMED: "Next: F5 starts the plan shown on the Run page; Cancel there disarms it.",
    EngineState.RUNNING: "STOP ramps down as planned; Esc aborts from every page.",
    EngineState.HELD: "The drive may be on. Press 'Go on' (Run page); STOP ramps down, Esc aborts.",
    EngineState.RAMPING_DOWN: "Ramping down; Esc aborts.",
    EngineState.FAULT: "See Details for the cause. Open the bench again on the Rig page (Ctrl+1).",
}
_BYTES_PER_SAMPLE = 4
_LITTLE_ROOM_S = 3600.0


ORDERED = "Limits, folder and instruments are being checked"


def indicator_of(status: EngineStatus | None, is_ordering: bool) -> StateIndicator:  # noqa: FBT001 - a state
    """Return the indicator of the engine's state; ``is_ordering`` is True while a command is running."""
    if status is None:
        return OPENING if is_ordering else CLOSED
    if is_ordering and status.state in (EngineState.READY, EngineState.ARMED):
        return replace(_INDICATORS[status.state], symbol="◌", detail=ORDERED)
    return replace(_INDICATORS[status.state], detail=_detail(status))


def _detail(status: EngineStatus) -> str:
    match status.state:
        case EngineState.READY if status.bench is not None:
            return (
                f"{status.bench.rig_name}, simulated" if status.bench.is_simulated else status.bench.rig_name
            )
        case EngineState.ARMED if status.armed is not None:
            return f"F5 starts the drive; the plan disarms itself in {status.armed.expires_in_s:.0f} s"
        case EngineState.HELD:
            return f"The drive stays on   ·   {run_text(status.run)}"
        case EngineState.RUNNING | EngineState.RAMPING_DOWN:
            return run_text(status.run)
        case state:
            return _INDICATORS[state].detail


def run_text(run: RunStatus | None) -> str:
    """Return the progress of a run, as text."""
    if run is None:
        return "Beginning"
    parts = [f"{run.name} ({run.number} of {run.count})" if run.count > 1 else run.name]
    parts.append(run.run_state.value.replace("_", " "))
    parts.append(f"{clock(run.elapsed_s)} of {clock(run.total_s)}")
    parts.append(f"{run.amplitude_vpp:.3g} Vpp")
    if run.frequency_hz is not None:
        parts.append(f"{run.frequency_hz:.2f} Hz")
    return "   ·   ".join(parts)


def status_fields(
    status: EngineStatus | None, frames_per_s: float, longest_wait_s: float
) -> tuple[dict[StatusField, str], frozenset[StatusField]]:
    """Return the texts of the status line, and the fields that need attention."""
    frames = f"{frames_per_s:.0f} fps, latency {1e3 * longest_wait_s:.0f} ms"
    if status is None or status.bench is None:
        return {StatusField.RIG: "no bench", StatusField.FRAMES: frames}, frozenset()
    bench = status.bench
    marked = set()
    if status.lost_blocks:
        marked.add(StatusField.OVERRUNS)
    if status.overloads:
        marked.add(StatusField.CLIPPED)
    room_s = status.disk_free_bytes / (bench.sample_rate_hz * len(bench.channels) * _BYTES_PER_SAMPLE)
    disk = ""
    if status.disk_free_bytes:
        disk = f"disk {status.disk_free_bytes / 1e9:.0f} GB = {room_s / 3600:.0f} h"
        if room_s < _LITTLE_ROOM_S:
            marked.add(StatusField.DISK)
    texts = {
        StatusField.RIG: f"{bench.rig_name}, {bench.sample_rate_hz / 1e3:g} kS/s × {len(bench.channels)}",
        StatusField.OVERRUNS: f"overruns {status.lost_blocks}",
        StatusField.CLIPPED: f"clipped {status.overloads}",
        StatusField.DISK: disk,
        StatusField.FILE: "" if status.run is None else f"file {Path(status.run.file).name}",
        StatusField.FRAMES: frames,
    }
    return texts, frozenset(marked)


SYMBOLS = {NoticeKind.INFO: "ℹ", NoticeKind.WARNING: "⚠", NoticeKind.FAULT: "✖"}
TONES = {NoticeKind.INFO: Tone.CALM, NoticeKind.WARNING: Tone.CAUTION, NoticeKind.FAULT: Tone.DANGER}
MOST_KEPT = 200
_LINES = 2
_DETAIL_LINES = 14


class MessageStrip(QFrame):
    """Strip with the newest message: what happened, what was done, what to do next.

    Its height is constant, so that nothing below it moves. If there is no message, it shows the next step.
    The Details button opens the list of all messages over the page.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Messages")
        self.notices: tuple[Notice, ...] = ()
        """All messages in the list of Details, the newest last."""
        self.is_said = False
        self._hint = ""
        self._text = SentenceLabel()
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self._details = QPlainTextEdit(self)
        self._details.setReadOnly(True)
        self._details.setAccessibleName("All messages")
        self._details.hide()
        self._more = self._button("Details", "Show details and earlier messages", lambda: None)
        self._more.setCheckable(True)
        self._more.toggled.connect(self._show_details)
        copy = self._button("Copy", "Copy the message", self._copy)
        close = self._button("Dismiss", "Dismiss the message", self.dismiss)
        line = QHBoxLayout(self)
        line.setContentsMargins(10, 2, 10, 2)
        line.addWidget(self._text, 1)
        self._buttons = (self._more, copy, close)
        for button in self._buttons:
            line.addWidget(button)
            keep_space(button)
        self._fit()
        self.dismiss()

    def say(self, notice: Notice) -> None:
        """Show a message; earlier messages remain in Details."""
        self.notices = (*self.notices, notice)[-MOST_KEPT:]
        sentences = "  ▸ ".join(part for part in (notice.what, notice.done, notice.next_step) if part)
        self._details.setPlainText("\n\n".join(each.text for each in reversed(self.notices)))
        self.is_said = True
        self._show(f"{SYMBOLS[notice.kind]}  {sentences}", TONES[notice.kind].value)
        self._text.setAccessibleName(f"{notice.kind.value}: {notice.what}")
        self._text.setToolTip(notice.text)

    def hint(self, text: str) -> None:
        """Set the next step, which is shown if there is no message."""
        if text != self._hint:
            self._hint = text
            if not self.is_said:
                self._text.setText(text)

    def dismiss(self) -> None:
        """Remove the message from the strip; it remains in Details."""
        self.is_said = False
        self._more.setChecked(False)
        self._show(self._hint, "")
        self._text.setAccessibleName("What can be done next")
        self._text.setToolTip("")

    def changeEvent(self, event: QEvent) -> None:
        """Apply a change of the font at once."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange:
            self._fit()

    def _fit(self) -> None:
        room = max(_LINES * self.fontMetrics().lineSpacing(), self._more.sizeHint().height())
        self.setFixedHeight(room + 6)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the list of messages to the width of the strip."""
        super().resizeEvent(event)
        self._show_details()

    def _show(self, text: str, tone: str) -> None:
        self._text.setText(text)
        for widget in (self, self._text):
            set_tone(widget, tone)
        for button in self._buttons:
            button.setVisible(self.is_said or (button is self._more and bool(self.notices)))

    def _show_details(self) -> None:
        host = self.window()
        if self._details.parentWidget() is not host:
            self._details.setParent(host)
        height = _DETAIL_LINES * self.fontMetrics().lineSpacing()
        place = self.mapTo(host, QPoint(0, self.height())) if host is not self else QPoint(0, self.height())
        self._details.setGeometry(place.x(), place.y(), self.width(), height)
        self._details.setVisible(self._more.isChecked())
        self._details.raise_()

    def _copy(self) -> None:
        if self.notices:
            QGuiApplication.clipboard().setText(self.notices[-1].text)

    def _button(self, label: str, name: str, act: Callable[[], object]) -> QPushButton:
        button = push_button(label, name, act)
        button.setAccessibleName(name)
        return button
