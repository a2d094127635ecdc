"""Arming in plain words: what is going to happen, then a second, explicit act to start it."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGroupBox, QVBoxLayout

from vibench.acquisition.engine import DRIVING, EngineState, EngineStatus

from ...widgets import SentenceLabel, filled, push_button, row

_HINTS = {
    EngineState.CLOSED: "No bench is open. Open one on the Rig page (Ctrl+1).",
    EngineState.OPENING: "The bench is being opened.",
    EngineState.CHECKING: "The bench is being checked.",
    EngineState.FAULT: "The bench is not usable. Open it again on the Rig page (Ctrl+1).",
}


class ArmCard(QGroupBox):
    """Arm, then Start or Cancel; while something runs: hold, go on."""

    arm_wanted = Signal()
    start_wanted = Signal()
    cancel_wanted = Signal()
    hold_wanted = Signal()

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
        buttons = row(self.cancel_button, self.start_button)
        filled(QVBoxLayout(self), self._words, self.arm_button, buttons, self.hold_button)
        self._was_armed = False

    @property
    def words(self) -> str:
        """What is said."""
        return self._words.text()

    def show_status(self, status: EngineStatus | None, test: str, reason: str) -> None:
        """Show what can be done now; ``reason`` says why the test cannot be armed, empty when it can."""
        state = EngineState.CLOSED if status is None else status.state
        armed = None if status is None else status.armed
        is_armed = state is EngineState.ARMED and armed is not None
        if is_armed and armed is not None:
            left = f"Disarms itself in {armed.expires_in_s:.0f} s."
            self._say("\n".join((f"Campaign {armed.campaign}", *armed.lines, left)))
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
        if is_armed and not self._was_armed:
            # To start needs another key than the one that armed.
            self.cancel_button.setFocus()
        self._was_armed = is_armed

    def _say(self, text: str) -> None:
        if self._words.sentence != text:
            self._words.setText(text)
