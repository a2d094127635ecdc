"""The state of the rig, by symbol, word and colour, with STOP beside it: on every page, always."""

from dataclasses import dataclass

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QAccessible, QAccessibleEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QSizePolicy

from ..widgets.boxes import filled
from ..widgets.elided_label import ElidedLabel
from ..widgets.theme import Tone


@dataclass(frozen=True)
class StateIndicator:
    """What the banner shows of a state."""

    symbol: str
    word: str
    tone: Tone
    detail: str = ""
    """What changes while the state stays: a clock, a level."""
    is_ramping: bool = False
    """The drive goes down already: STOP can only make it faster."""


STOP_TEXT, AT_ONCE_TEXT = "■ STOP: ramp down   (Esc: abort)", "■ STOP: at once   (Esc: abort)"
CLOSED = StateIndicator("○", "NO BENCH", Tone.CALM, "Open one on the Rig page")


class Banner(QFrame):
    """One indicator at a time; a change of its word is announced to screen readers."""

    stop_wanted = Signal()
    """Ramp down smoothly, as the plan says; pressed a second time: at once."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("banner")
        self.setAccessibleName("State of the rig")
        self._indicator = CLOSED
        self._label = QLabel()
        self._label.setObjectName("engine_state")
        self._detail = ElidedLabel()
        self._detail.setAccessibleName("Details of the state")
        self._detail.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._stop = QPushButton(STOP_TEXT)
        self._stop.setObjectName("stop")
        self._stop.setAccessibleName("Stop")
        self._stop.setToolTip(
            "A click ramps the drive down as the plan says; Esc, as fast as the shaker bears.\n"
            "This is not an emergency stop: in an emergency, switch the amplifier off."
        )
        self._stop.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._stop.clicked.connect(self.stop_wanted)
        layout = filled(QHBoxLayout(self), self._label, (self._detail, 1), self._stop)
        layout.setContentsMargins(10, 6, 10, 6)
        self._fit()
        self._paint()

    @property
    def indicator(self) -> StateIndicator:
        """What is shown."""
        return self._indicator

    def changeEvent(self, event: QEvent) -> None:
        """Follow font and style sheet at once."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._fit()

    def _fit(self) -> None:
        """Keep STOP as wide as it ever gets: it must not move under the hand."""
        shown, widths = self._stop.text(), []
        for text in (STOP_TEXT, AT_ONCE_TEXT):
            self._stop.setText(text)
            widths.append(self._stop.sizeHint().width())
        self._stop.setText(shown)
        self._stop.setMinimumWidth(max(widths))

    def show_indicator(self, indicator: StateIndicator) -> None:
        """Show a state; nothing is repainted while nothing changes."""
        if indicator == self._indicator:
            return
        announced = indicator.word != self._indicator.word
        self._indicator = indicator
        self._paint()
        if announced:
            QAccessible.updateAccessibility(QAccessibleEvent(self._label, QAccessible.Event.Alert))

    def _paint(self) -> None:
        indicator = self._indicator
        self._label.setText(f"{indicator.symbol}  {indicator.word}")
        self._label.setAccessibleName(f"State: {indicator.word}")
        self._detail.setText(indicator.detail)
        self._stop.setText(AT_ONCE_TEXT if indicator.is_ramping else STOP_TEXT)
        if self._label.property("tone") != indicator.tone.value:
            self._label.setProperty("tone", indicator.tone.value)
            self._label.style().polish(self._label)
