"""Arming in plain words: what is going to happen, then a second, explicit act to start it."""

from PySide6.QtCore import QPoint, Signal
from PySide6.QtWidgets import QGroupBox, QVBoxLayout

from vibench.acquisition.engine import DRIVING, EngineState, EngineStatus

from ...widgets.boxes import column, filled, row
from ...widgets.push_button import push_button
from ...widgets.units import SentenceLabel

_HINTS = {
    EngineState.CLOSED: "No bench is open. Open one on the Rig page (Ctrl+1).",
    EngineState.OPENING: "The bench is being opened.",
    EngineState.CHECKING: "The bench is being checked.",
    EngineState.FAULT: "The bench is not usable. Open it again on the Rig page (Ctrl+1).",
}


UNREAD = "Read to the end  (PgDn)"


class ArmCard(QGroupBox):
    """Arm, then Start or Cancel; while something runs: hold, go on."""

    arm_wanted = Signal()
    start_wanted = Signal()
    cancel_wanted = Signal()
    hold_wanted = Signal()
    news = Signal()
    """Something else is armed: what will happen is to be read from its beginning."""

    def __init__(self) -> None:
        super().__init__("What will happen")
        self._words = SentenceLabel()
        self._words.setAccessibleName("What will happen")
        self.arm_button = push_button(
            "A&rm…  (Ctrl+Return)", "Say in words what will happen", self.arm_wanted.emit
        )
        self.arm_button.setProperty("rank", "first")
        self.cancel_button = push_button("Cancel", "Disarm; nothing was played", self.cancel_wanted.emit)
        self.start_button = push_button("▶ Start  (F5)", "Start the drive", self.start_wanted.emit)
        self.start_button.setProperty("rank", "first")
        self.hold_button = push_button(
            "Hold", "Stay where the run is; the drive stays on", self.hold_wanted.emit
        )
        filled(QVBoxLayout(self), self._words)
        self.buttons = column(
            self.arm_button, row(self.cancel_button, (self.start_button, 1)), self.hold_button
        )
        """What can be done now; it stays in sight when the words are scrolled."""
        self._armed: tuple[str, ...] = ()
        """What is armed, in words; nothing while nothing is."""
        self._read: tuple[str, ...] = ()
        """Words whose end has been in sight."""

    @property
    def is_read(self) -> bool:
        """Whether the end of what will happen has been in sight: only then it may be started."""
        words = self._words
        end = QPoint(0, words.height() - 1)
        is_whole = words.height() >= words.heightForWidth(words.width())
        if self._armed and is_whole and words.visibleRegion().contains(end):
            self._read = self._armed
        return self._read == self._armed

    @property
    def words(self) -> str:
        """What is said."""
        return self._words.text()

    def show_status(self, status: EngineStatus | None, test: str, reason: str) -> None:
        """Show what can be done now; ``reason`` says why the test cannot be armed, empty when it can."""
        state = EngineState.CLOSED if status is None else status.state
        armed = None if status is None else status.armed
        is_armed = state is EngineState.ARMED and armed is not None
        words: tuple[str, ...] = ()
        if is_armed and armed is not None:
            left = f"Disarms itself in {armed.expires_in_s:.0f} s."
            words = (f"Campaign {armed.campaign}", *armed.lines)
            self._say("\n".join((*words, left)))
        elif state in DRIVING:
            self._say("Plan and limits are fixed while it runs. Stop ramps down; Esc aborts.")
        else:
            self._say(_HINTS.get(state) or reason or f"Ready to arm: {test}")
        self.arm_button.setVisible(not is_armed and state not in DRIVING)
        self.arm_button.setEnabled(state is EngineState.READY and not reason)
        self.cancel_button.setVisible(is_armed)
        self.start_button.setVisible(is_armed)
        self.hold_button.setVisible(state in (EngineState.RUNNING, EngineState.HELD))
        self.hold_button.setText("Go on" if state is EngineState.HELD else "Hold")
        if words != self._armed:
            self._armed, self._read = words, ()
            if words:
                # To start needs another key than the one that armed.
                self.cancel_button.setFocus()
                self.news.emit()
        self.start_button.setEnabled(self.is_read)
        self.start_button.setText("▶ Start  (F5)" if self.is_read else UNREAD)

    def _say(self, text: str) -> None:
        if self._words.sentence != text:
            self._words.setText(text)
