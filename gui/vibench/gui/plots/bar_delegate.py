"""A bar behind a share in a table: how much of a limit is used, with the number on it."""

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QStyledItemDelegate, QStyleOptionViewItem

SHARE_ROLE = Qt.ItemDataRole.UserRole + 1
"""Where an item keeps its share, 0 to 1 and more."""
OVER = "#b3261e"
NEAR = "#a06a00"
WELL = "#00694d"
NEAR_SHARE = 0.8


class BarDelegate(QStyledItemDelegate):
    """Paints the bar; above 1 it is full and red, and the text says so as well."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """Paint the bar under the text."""
        share = index.data(SHARE_ROLE)
        if isinstance(share, float):
            area = QRectF(option.rect).adjusted(2, 3, -2, -3)
            area.setWidth(area.width() * min(share, 1.0))
            painter.save()
            colour = QColor(OVER if share > 1 + 1e-9 else NEAR if share > NEAR_SHARE else WELL)
            colour.setAlphaF(0.35)
            painter.fillRect(area, colour)
            painter.restore()
        super().paint(painter, option, index)
