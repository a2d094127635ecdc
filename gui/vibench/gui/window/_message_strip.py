"""The strip under the banner: messages stay until they are read, and block nothing."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from ..widgets import Notice, NoticeKind, Tone

SYMBOLS = {NoticeKind.INFO: "ℹ", NoticeKind.WARNING: "⚠", NoticeKind.FAULT: "✖"}
TONES = {NoticeKind.INFO: Tone.CALM, NoticeKind.WARNING: Tone.CAUTION, NoticeKind.FAULT: Tone.DANGER}
MOST_KEPT = 200


class MessageStrip(QFrame):
    """The newest message: what happened, what was done, what to do; Details holds the earlier ones too."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Messages")
        self._notices: list[Notice] = []
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._details = QPlainTextEdit()
        self._details.setReadOnly(True)
        self._details.setAccessibleName("All messages")
        self._details.hide()
        self._more = self._button("Details", "Show details and earlier messages")
        self._more.setCheckable(True)
        self._more.toggled.connect(self._details.setVisible)
        copy = self._button("Copy", "Copy the message")
        copy.clicked.connect(self._copy)
        close = self._button("Dismiss", "Dismiss the message")
        close.clicked.connect(self.dismiss)
        line = QHBoxLayout()
        line.addWidget(self._text, 1)
        for button in (self._more, copy, close):
            line.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(10, 4, 10, 4)
        layout.addLayout(line)
        layout.addWidget(self._details)
        self.hide()

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Every message so far, the newest last."""
        return tuple(self._notices)

    def say(self, notice: Notice) -> None:
        """Show a message above the earlier ones."""
        self._notices = [*self._notices, notice][-MOST_KEPT:]
        sentences = "  ▸ ".join(part for part in (notice.what, notice.done, notice.next_step) if part)
        self._text.setText(f"{SYMBOLS[notice.kind]}  {sentences}")
        self._text.setAccessibleName(f"{notice.kind.value}: {notice.what}")
        self._details.setPlainText("\n\n".join(each.text for each in reversed(self._notices)))
        tone = TONES[notice.kind].value
        for widget in (self, self._text):
            widget.setProperty("tone", tone)
            widget.style().polish(widget)
        self.show()

    def give_way(self) -> None:
        """Take away what is only information and about what was before; it stays in Details."""
        if self._notices and self._notices[-1].kind is NoticeKind.INFO:
            self.dismiss()

    def dismiss(self) -> None:
        """Take the strip away; the messages stay in Details."""
        self._more.setChecked(False)
        self.hide()

    def _copy(self) -> None:
        if self._notices:
            QGuiApplication.clipboard().setText(self._notices[-1].text)

    def _button(self, label: str, name: str) -> QPushButton:
        button = QPushButton(label)
        button.setAccessibleName(name)
        button.setToolTip(name)
        return button
