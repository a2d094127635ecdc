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

from ..errors import InvalidRequest
from ..signals.arrays import Reals

# What of a signal is drawn: the smallest and largest sample of every column of the picture.
#
# Every sample is in exactly one column, so an impact of three samples is seen at any zoom; every n-th
# sample would show it in a few percent of the frames.

Samples = NDArray[np.float32] | NDArray[np.float64]


def envelope(samples: Samples, columns: int) -> tuple[Samples, Samples]:
    """Reduce signals to their extremes, column by column.

    Parameters
    ----------
    samples
        Shape (..., samples). Lost samples are NaN; a column is NaN where all of its samples are lost.
    columns
        Of the picture. Fewer samples than columns are given back as they are.

    Returns
    -------
    Smallest and largest value of each column, shape (..., columns). Column c holds the samples from
    ``c * n // columns`` on, which `column_starts` names.

    Raises
    ------
    InvalidRequest
        When there is no column.

    """
    if columns < 1:
        raise InvalidRequest(f"{columns} columns were asked for; a picture has 1 or more")
    count = samples.shape[-1]
    if count <= columns:
        return samples, samples
    starts = column_starts(count, columns)
    # fmin and fmax pass over NaN, and cost the same as minimum and maximum.
    return (
        np.asarray(np.fmin.reduceat(samples, starts, axis=-1)),
        np.asarray(np.fmax.reduceat(samples, starts, axis=-1)),
    )


def column_starts(samples: int, columns: int) -> NDArray[np.int64]:
    """First sample of each column of `envelope`.

    Parameters
    ----------
    samples
        How many a signal has.
    columns
        How many the picture has.

    Returns
    -------
    ndarray
        Shape (columns,).

    """
    shown = min(samples, columns)
    return np.arange(shown, dtype=np.int64) * samples // max(shown, 1)


def zigzag(low: Reals, high: Reals) -> Reals:
    """Lay both edges of an envelope into one line, low and high in turn, shape (..., 2 columns).

    Parameters
    ----------
    low, high
        Edges, shape (..., columns).

    Returns
    -------
    ndarray
        Shape (..., 2 columns).

    """
    return np.stack((low, high), axis=-1).reshape(*low.shape[:-1], -1)


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
