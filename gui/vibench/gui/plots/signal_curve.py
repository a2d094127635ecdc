"""Long signal in a plot, drawn as the smallest and largest sample in every pixel column."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QStyledItemDelegate, QStyleOptionViewItem

from vibench.analysis.live import outline, zigzag

from .line_style import LineStyle
from .plot import Plot

MOST_COLUMNS = 3000


class SignalCurve:
    """Curve of a long signal. Only the visible part is drawn; short impacts are visible at any zoom."""

    def __init__(self, plot: Plot, line_style: LineStyle, name: str = "") -> None:
        self._plot = plot
        self._curve = plot.curve(line_style, name)
        self._samples: NDArray[np.float64] = np.empty(0)
        self._rate_hz = 1.0
        self._drawn: tuple[int, int, int] | None = None
        plot.getViewBox().sigXRangeChanged.connect(self._redraw)

    def set_samples(self, samples: NDArray[np.floating], sample_rate_hz: float) -> None:
        """Set the samples of the signal, shape (samples,)."""
        self._samples = np.asarray(samples)
        self._rate_hz = sample_rate_hz
        self._drawn = None
        self._draw(0, len(self._samples))

    def _redraw(self, *_: object) -> None:
        (low_s, high_s), _range = self._plot.getViewBox().viewRange()
        first = int(np.floor(low_s * self._rate_hz)) - 1
        last = int(np.ceil(high_s * self._rate_hz)) + 2
        count = len(self._samples)
        if self._plot.getViewBox().autoRangeEnabled()[0]:
            # The range of the axis follows the data, so draw the whole signal.
            first, last = 0, count
        self._draw(min(max(first, 0), count), min(max(last, 0), count))

    def _draw(self, first: int, last: int) -> None:
        columns = min(max(self._plot.columns, 200), MOST_COLUMNS)
        if (first, last, columns) == self._drawn:
            return
        self._drawn = (first, last, columns)
        visible = self._samples[first:last]
        if len(visible) <= 2 * columns:
            self._curve.setData(np.arange(first, last) / self._rate_hz, visible)
            return
        low, high = outline(visible, columns)
        edges = np.arange(columns) * len(visible) // columns
        time_s = (first + np.repeat(edges, 2)) / self._rate_hz
        self._curve.setData(time_s, zigzag(np.asarray(low, float), np.asarray(high, float)))


SHARE_ROLE = Qt.ItemDataRole.UserRole + 1
"""Item role under which a table cell stores the length of its bar; 1 is the cell's whole width."""
OVER = "#b3261e"
NEAR = "#a06a00"
WELL = "#00694d"
NEAR_SHARE = 0.8


class BarDelegate(QStyledItemDelegate):
    """Delegate that paints a bar in a table cell; above 1 the bar is full and red."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """Paint the bar below the text."""
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
