"""An area between two lines of a plot: bounds and envelopes."""

from collections.abc import Callable

import numpy as np
import pyqtgraph as pg
from numpy.typing import ArrayLike


class Band:
    """An area between a lower and an upper line."""

    def __init__(self, add: Callable[[object], None]) -> None:
        # A pen that draws nothing: without any pen a curve would have no path, and the area no edge.
        self._edges = [pg.PlotDataItem(pen=pg.mkPen(None)) for _ in range(2)]
        self._fill = pg.FillBetweenItem(*self._edges)
        for item in (*self._edges, self._fill):
            add(item)

    def set_data(self, across: ArrayLike, low: ArrayLike, high: ArrayLike) -> None:
        """Draw the area; where an edge is not finite there is none."""
        x, below, above = (np.asarray(values, dtype=np.float64) for values in (across, low, high))
        drawn = np.isfinite(below) & np.isfinite(above)
        for edge, values in zip(self._edges, (below, above), strict=True):
            edge.setData(x[drawn], values[drawn])

    def paint(self, shade: object) -> None:
        """Fill it with a colour."""
        self._fill.setBrush(shade)
