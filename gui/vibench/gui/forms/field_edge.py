"""The edge of a field. The style's own is a shade of the window: on a dark one nobody sees it."""

from PySide6.QtCore import QRectF
from PySide6.QtGui import QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import QLineEdit, QWidget

_ROUND = 2.0


def draw_edge(field: QWidget) -> None:
    """Draw a line around a field, after the style has drawn the field itself."""
    role = QPalette.ColorRole.Highlight if field.hasFocus() else QPalette.ColorRole.Mid
    painter = QPainter(field)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(field.palette().color(role))
    painter.drawRoundedRect(QRectF(field.rect()).adjusted(0.5, 0.5, -0.5, -0.5), _ROUND, _ROUND)


class LineField(QLineEdit):
    """A line of text with an edge."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the field, then its edge."""
        super().paintEvent(event)
        draw_edge(self)
