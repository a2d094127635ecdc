"""A curve whose line is as wide on a fine screen as on a coarse one."""

from math import ceil

import pyqtgraph as pg
from PySide6.QtGui import QPainter, QTransform
from PySide6.QtWidgets import QStyleOptionGraphicsItem, QWidget


class _LogicalCurve(pg.PlotCurveItem):  # type: ignore[misc] # untyped library
    """Paints a line of one pixel of the screen once more beside and below itself, where pixels are small.

    A pen of two pixels looks the same and takes three times as long: Qt draws such lines as areas.
    """

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None) -> None:
        """Draw as many times as a pixel of the layout has pixels of the screen."""
        super().paint(painter, option, widget)
        ratio = painter.device().devicePixelRatioF()
        place = painter.transform()
        for step in range(1, ceil(ratio)):
            for right, down in ((step, 0), (0, step)):
                painter.setTransform(place * QTransform.fromTranslate(right / ratio, down / ratio))
                super().paint(painter, option, widget)
        painter.setTransform(place)


class LogicalLine(pg.PlotDataItem):  # type: ignore[misc] # untyped library
    """pyqtgraph's own curve with another painter of its line."""

    def __init__(self) -> None:
        super().__init__()
        self.curve.setParentItem(None)
        self.curve: pg.PlotCurveItem = _LogicalCurve()
        self.curve.setParentItem(self)
