"""A label of one line: what finds no room ends in dots, and is whole in the tooltip."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QLabel, QStyle, QStyleOption


class ElidedLabel(QLabel):
    """Never asks for more width than a few letters, whatever its text."""

    LETTERS = 3

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
