"""What an empty area says: why nothing is there, and how something comes to be."""

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor, QPainter

_WIDEST = 0.8
"""Part of the area that the words may take."""


def paint_hint(painter: QPainter, area: QRect, text: str, colour: str | QColor) -> None:
    """Write words into the middle of an area."""
    margin = round(0.5 * (1 - _WIDEST) * area.width())
    painter.setPen(QColor(colour))
    flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
    painter.drawText(area.adjusted(margin, 0, -margin, 0), flags, text)
