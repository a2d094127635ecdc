"""The edges of a signal as they are drawn, where its periods are too many to be told apart.

A column of the picture that is shorter than a period holds a part of it: one column has the crest,
the next has not, and the edges of a steady sine look like a comb that beats with the columns. There
each column is given the extremes of a whole period around it, and a steady sine has straight edges.
Where a period is many columns long its waveform is drawn, and where a column holds a whole one its
extremes are: both are left alone, and nowhere is an extreme lost.
"""

from math import ceil

import numpy as np

from ._envelope import Samples, envelope

LEGIBLE_COLUMNS = 6.0
"""A period of so many columns is seen as a wave."""
_MARGIN = 1.25
"""Periods around a column: those of a sweep are not all alike."""
_CLEAR = 0.25
"""Share of the usual height that a sample must be away from the middle to tell its side."""
_BLOCKS, _EVERY = 32, 4
"""Periods are counted in every fourth of so many stretches: that is enough, and costs a quarter."""


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
        reach = columns_around(samples[row], low[row], high[row])
        if reach > 1:
            lowest[row] = _widened(low[row], reach, np.fmin)
            highest[row] = _widened(high[row], reach, np.fmax)
    return lowest, highest


def columns_around(samples: Samples, low: Samples, high: Samples) -> int:
    """Give the number of columns that hold a period; 1 where the edges are to be left alone."""
    known = np.isfinite(low)
    if not known.any():
        return 1
    period = low.size / max(_periods(samples, low[known], high[known]), 1e-9)
    return ceil(_MARGIN * period) if 1.0 / _MARGIN < period < LEGIBLE_COLUMNS else 1


def _periods(samples: Samples, low: Samples, high: Samples) -> float:
    """Count how often the signal goes there and back; noise around its middle does not count."""
    middle, height = np.median(0.5 * (low + high)), np.median(high - low)
    size = samples.size // _BLOCKS
    looked_at = samples[: size * _BLOCKS].reshape(_BLOCKS, size)[::_EVERY].ravel() - middle
    sides = np.signbit(looked_at[np.abs(looked_at) > _CLEAR * height])
    return _EVERY * np.count_nonzero(sides[1:] != sides[:-1]) / 2


def _widened(edge: Samples, reach: int, extreme: np.ufunc) -> Samples:
    """Give every column the extreme of so many columns around it."""
    before, found = (reach - 1) // 2, edge.copy()
    padded = np.pad(edge, (before, reach - 1 - before), mode="edge")
    for shift in range(reach):
        extreme(found, padded[shift : shift + edge.size], out=found)
    return found
