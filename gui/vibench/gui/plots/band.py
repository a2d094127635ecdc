"""An area between two lines of a plot: bounds and envelopes."""

import numpy as np
import pyqtgraph as pg
from numpy.typing import ArrayLike

_INSIDE = "enclosed"


class Band:
    """An area between a lower and an upper line: one outline, there and back, filled."""

    def __init__(self, of: str) -> None:
        self.of = of
        """Name of the curve whose bounds it shows."""
        self._edges = np.empty((3, 0))
        self.item = pg.PlotDataItem(pen=None, fillLevel=_INSIDE)

    def set_data(self, across: ArrayLike, low: ArrayLike, high: ArrayLike) -> None:
        """Draw the area; where an edge is not finite there is none."""
        x, below, above = (np.asarray(values, dtype=np.float64) for values in (across, low, high))
        self._edges = np.stack((x, below, above))
        drawn = np.isfinite(below) & np.isfinite(above)
        there, back = np.flatnonzero(drawn), np.flatnonzero(drawn)[::-1]
        self.item.setData(np.concatenate((x[there], x[back])), np.concatenate((below[there], above[back])))

    def at(self, across: float) -> tuple[float, float] | None:
        """Give the bounds at the place that is nearest; None where there are none."""
        x, below, above = self._edges
        if x.size == 0:
            return None
        place = int(np.argmin(np.abs(x - across)))
        return (float(below[place]), float(above[place])) if np.isfinite(below[place]) else None

    def paint(self, shade: object) -> None:
        """Fill it with a colour."""
        self.item.setFillBrush(shade)
