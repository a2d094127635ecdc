"""An area between two lines of a plot: bounds and envelopes."""

import numpy as np
import pyqtgraph as pg
from numpy.typing import ArrayLike

_INSIDE = "enclosed"


class Band:
    """An area between a lower and an upper line: one outline, there and back, filled."""

    def __init__(self) -> None:
        self.item = pg.PlotDataItem(pen=None, fillLevel=_INSIDE)

    def set_data(self, across: ArrayLike, low: ArrayLike, high: ArrayLike) -> None:
        """Draw the area; where an edge is not finite there is none."""
        x, below, above = (np.asarray(values, dtype=np.float64) for values in (across, low, high))
        drawn = np.isfinite(below) & np.isfinite(above)
        there, back = np.flatnonzero(drawn), np.flatnonzero(drawn)[::-1]
        self.item.setData(np.concatenate((x[there], x[back])), np.concatenate((below[there], above[back])))

    def paint(self, shade: object) -> None:
        """Fill it with a colour."""
        self.item.setFillBrush(shade)
