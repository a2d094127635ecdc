"""A long signal in a plot: the smallest and largest sample of every column of pixels, at any zoom."""

import numpy as np
from numpy.typing import NDArray

from vibench.analysis.live import outline, zigzag

from .line_style import LineStyle
from .plot import Plot

MOST_COLUMNS = 3000


class SignalCurve:
    """Draws what of a signal is in sight, from its samples: an impact of three samples is never lost."""

    def __init__(self, plot: Plot, line_style: LineStyle, name: str = "") -> None:
        self._plot = plot
        self._curve = plot.curve(line_style, name)
        self._samples: NDArray[np.float64] = np.empty(0)
        self._rate_hz, self._start_s = 1.0, 0.0
        self._drawn: tuple[int, int, int] | None = None
        plot.getViewBox().sigXRangeChanged.connect(self._redraw)

    def set_samples(self, samples: NDArray[np.floating], sample_rate_hz: float, start_s: float = 0.0) -> None:
        """Show another signal, shape (samples,)."""
        self._samples = np.asarray(samples)
        self._rate_hz, self._start_s = sample_rate_hz, start_s
        self._drawn = None
        self._draw(0, len(self._samples))

    def _redraw(self, *_: object) -> None:
        (low_s, high_s), _range = self._plot.getViewBox().viewRange()
        first = int(np.floor((low_s - self._start_s) * self._rate_hz)) - 1
        last = int(np.ceil((high_s - self._start_s) * self._rate_hz)) + 2
        count = len(self._samples)
        if self._plot.getViewBox().autoRangeEnabled()[0]:
            # What is in sight is being chosen from what is drawn: draw all of it.
            first, last = 0, count
        self._draw(min(max(first, 0), count), min(max(last, 0), count))

    def _draw(self, first: int, last: int) -> None:
        columns = min(max(self._plot.columns, 200), MOST_COLUMNS)
        if (first, last, columns) == self._drawn:
            return
        self._drawn = (first, last, columns)
        seen = self._samples[first:last]
        if len(seen) <= 2 * columns:
            time_s = self._start_s + np.arange(first, last) / self._rate_hz
            self._curve.setData(time_s, seen)
            return
        low, high = outline(seen, columns)
        edges = np.arange(columns) * len(seen) // columns
        time_s = self._start_s + (first + np.repeat(edges, 2)) / self._rate_hz
        self._curve.setData(time_s, zigzag(np.asarray(low, float), np.asarray(high, float)))
