"""Labels of foreign text, without its markup and control characters: names of files, words of instruments."""

from html import escape

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QLabel, QStyle, QStyleOption

from vibench.acquisition import printable


def plain_lines(text: str) -> str:
    """Write every line of a text without control characters."""
    return text if text.isprintable() else "\n".join(map(printable, text.split("\n")))


def plain_tip(text: str) -> str:
    """Write a tooltip whose markup is shown, and not obeyed."""
    lines = plain_lines(text)
    return f"<p style='white-space:pre-wrap'>{escape(lines)}</p>" if "<" in lines else lines


class ElidedLabel(QLabel):
    """A line that asks for little width: what finds no room ends in dots, and is whole in the tooltip."""

    LETTERS = 3

    def __init__(self, text: str = "") -> None:
        super().__init__()
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setText(text)

    def setText(self, text: str) -> None:
        """Show a text as one line."""
        super().setText(printable(text))

    def setToolTip(self, text: str) -> None:
        """Say more under the pointer."""
        super().setToolTip(plain_tip(text))

    def minimumSizeHint(self) -> QSize:
        """Room for some letters: a long text must not widen the window."""
        hint = super().minimumSizeHint()
        least = self.LETTERS * self.fontMetrics().averageCharWidth()
        return QSize(min(hint.width(), least), hint.height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the text whole where it fits, and shortened elsewhere."""
        room = self.contentsRect()
        if self.sizeHint().width() <= self.width() or room.width() <= 0:
            super().paintEvent(event)
            return
        painter, option = QPainter(self), QStyleOption()
        option.initFrom(self)
        self.style().drawPrimitive(QStyle.PrimitiveElement.PE_Widget, option, painter, self)
        painter.setPen(self.palette().color(self.foregroundRole()))
        text = self.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, room.width())
        painter.drawText(room, self.alignment(), text)
        if not self.toolTip():
            self.setToolTip(self.text())
