"""The strip under the banner: it keeps its place; messages stay until they are read, and block nothing."""

from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QGuiApplication, QResizeEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QPlainTextEdit, QPushButton, QSizePolicy

from ..widgets.notice import Notice, NoticeKind
from ..widgets.theme import Tone
from ..widgets.units import SentenceLabel

SYMBOLS = {NoticeKind.INFO: "ℹ", NoticeKind.WARNING: "⚠", NoticeKind.FAULT: "✖"}
TONES = {NoticeKind.INFO: Tone.CALM, NoticeKind.WARNING: Tone.CAUTION, NoticeKind.FAULT: Tone.DANGER}
MOST_KEPT = 200
_LINES = 2
_DETAIL_LINES = 14


class MessageStrip(QFrame):
    """The newest message: what happened, what was done, what to do; Details holds the earlier ones too.

    It is as high without a message as with one, so that nothing below it ever moves; then it says what can be
    done next. Details lie over the page.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Messages")
        self._notices: list[Notice] = []
        self._is_said = False
        self._hint = ""
        self._text = SentenceLabel()
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self._details = QPlainTextEdit(self)
        self._details.setReadOnly(True)
        self._details.setAccessibleName("All messages")
        self._details.hide()
        self._more = self._button("Details", "Show details and earlier messages")
        self._more.setCheckable(True)
        self._more.toggled.connect(self._show_details)
        copy = self._button("Copy", "Copy the message")
        copy.clicked.connect(self._copy)
        self._close = self._button("Dismiss", "Dismiss the message")
        self._close.clicked.connect(self.dismiss)
        line = QHBoxLayout(self)
        line.setContentsMargins(10, 2, 10, 2)
        line.addWidget(self._text, 1)
        self._buttons = (self._more, copy, self._close)
        for button in self._buttons:
            line.addWidget(button)
            policy = button.sizePolicy()
            policy.setRetainSizeWhenHidden(True)
            button.setSizePolicy(policy)
        self._fit()
        self.dismiss()

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Every message so far, the newest last."""
        return tuple(self._notices)

    @property
    def is_said(self) -> bool:
        """Whether a message stands there."""
        return self._is_said

    def say(self, notice: Notice) -> None:
        """Show a message above the earlier ones."""
        self._notices = [*self._notices, notice][-MOST_KEPT:]
        sentences = "  ▸ ".join(part for part in (notice.what, notice.done, notice.next_step) if part)
        self._details.setPlainText("\n\n".join(each.text for each in reversed(self._notices)))
        self._is_said = True
        self._show(f"{SYMBOLS[notice.kind]}  {sentences}", TONES[notice.kind].value)
        self._text.setAccessibleName(f"{notice.kind.value}: {notice.what}")
        self._text.setToolTip(notice.text)

    def hint(self, text: str) -> None:
        """Say what can be done next, while there is no message."""
        if text != self._hint:
            self._hint = text
            if not self._is_said:
                self._text.setText(text)

    def give_way(self) -> None:
        """Take away what is about before: what was wanted has come about since; it stays in Details."""
        self.dismiss()

    def dismiss(self) -> None:
        """Take the message away; all messages stay in Details."""
        self._is_said = False
        self._more.setChecked(False)
        self._show(self._hint, "")
        self._text.setAccessibleName("What can be done next")
        self._text.setToolTip("")

    def changeEvent(self, event: QEvent) -> None:
        """Follow the font at once."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange:
            self._fit()

    def _fit(self) -> None:
        room = max(_LINES * self.fontMetrics().lineSpacing(), self._more.sizeHint().height())
        self.setFixedHeight(room + 6)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep Details as wide as the strip."""
        super().resizeEvent(event)
        self._show_details()

    def _show(self, text: str, tone: str) -> None:
        self._text.setText(text)
        for widget in (self, self._text):
            if (widget.property("tone") or "") != tone:
                widget.setProperty("tone", tone)
                widget.style().polish(widget)
        for button in self._buttons:
            button.setVisible(self._is_said or (button is self._more and bool(self._notices)))

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
        if self._notices:
            QGuiApplication.clipboard().setText(self._notices[-1].text)

    def _button(self, label: str, name: str) -> QPushButton:
        button = QPushButton(label)
        button.setAccessibleName(name)
        button.setToolTip(name)
        return button
