"""The edges of a signal as they are drawn, where its periods are too many to be told apart.

A column of the picture that is shorter than a period holds a part of it: one column has the crest,
the next has not, and the edges of a steady sine look like a comb that beats with the columns. There
each column is given the extremes of a whole period around it, and a steady sine has straight edges.
Where a period is many columns long its waveform is drawn, and where a column holds a whole one its
extremes are: both are left alone, and nowhere is an extreme lost.
"""

from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..signals.arrays import Reals
from ._envelope import Samples, envelope

LEGIBLE_COLUMNS = 6.0
"""A period of so many columns is seen as a wave."""
_MARGIN = 1.25
"""Periods around a column: those of a sweep are not all alike."""
_CLEAR = 0.25
"""Share of the usual height that a sample must be away from the middle to tell its side."""
_BLOCKS, _LEAST_COLUMNS = 32, 24
"""Periods are counted in so many stretches, each of so many columns or more."""


def outline(samples: Samples, columns: int) -> tuple[Samples, Samples]:
    """Reduce signals to their edges, column by column; shapes and columns are those of `envelope`.

    Parameters
    ----------
    samples
        Shape (..., samples).
    columns
        Of the picture.

    Returns
    -------
    tuple of ndarray
        Lower and upper edge, shape (..., columns).

    """
    low, high = envelope(samples, columns)
    if samples.shape[-1] <= columns:
        return low, high
    lowest, highest = low.copy(), high.copy()
    for row in np.ndindex(samples.shape[:-1]):
        reach = columns_around(samples[row], (low[row], high[row]))
        lowest[row], highest[row] = widened(low[row], high[row], reach)
    return lowest, highest


def columns_around(samples: Samples, edges: tuple[Samples, Samples]) -> NDArray[np.int64]:
    """Count the columns that hold a period, around each column; 1 where the edges are to be left alone.

    The period is that of the stretch around the column: a sweep has many.
    """
    low, high = edges
    count = low.size
    blocks = max(1, min(_BLOCKS, count // _LEAST_COLUMNS))
    borders = np.arange(blocks + 1) * count // blocks
    places = borders * samples.size // count
    periods = [
        period_of(samples[places[each] : places[each + 1]], low[start:stop], high[start:stop])
        for each, (start, stop) in enumerate(pairwise(borders))
    ]
    return reach_of(np.array(periods), borders)


def reach_of(periods: Reals, borders: NDArray[np.int64]) -> NDArray[np.int64]:
    """Spread periods of stretches [columns] over their columns; next to a longer one it is that."""
    is_short = (periods > 1.0 / _MARGIN) & (periods < LEGIBLE_COLUMNS)
    reach = np.where(is_short, np.ceil(_MARGIN * np.where(is_short, periods, 1.0)), 1.0).astype(np.int64)
    beside = np.pad(reach, 1, mode="edge")
    longest = np.max([beside[:-2], reach, beside[2:]], axis=0)
    return np.repeat(longest, np.diff(borders))


def period_of(samples: Samples, low: Samples, high: Samples) -> float:
    """Measure a period in columns; infinite where the signal never goes there and back.

    Noise around the middle does not count.
    """
    known = np.isfinite(low)
    if not known.any():
        return inf
    middle, height = np.median(0.5 * (low + high)[known]), np.median((high - low)[known])
    moved = samples - middle
    sides = np.signbit(moved[np.abs(moved) > _CLEAR * height])
    turns = np.count_nonzero(sides[1:] != sides[:-1]) / 2
    return low.size / turns if turns else inf


def widened(low: Samples, high: Samples, reach: NDArray[np.int64]) -> tuple[Samples, Samples]:
    """Give every column the extremes of so many columns around it."""
    lowest, highest = low.copy(), high.copy()
    for each in np.unique(reach[reach > 1]):
        here = reach == each
        lowest[here] = _widened(low, int(each), np.fmin)[here]
        highest[here] = _widened(high, int(each), np.fmax)[here]
    return lowest, highest


def _widened(edge: Samples, reach: int, extreme: np.ufunc) -> Samples:
    """Give every column the extreme of so many columns around it."""
    before, found = (reach - 1) // 2, edge.copy()
    padded = np.pad(edge, (before, reach - 1 - before), mode="edge")
    for shift in range(reach):
        extreme(found, padded[shift : shift + edge.size], out=found)
    return found
