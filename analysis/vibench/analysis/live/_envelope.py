"""What of a signal is drawn: the smallest and largest sample of every column of the picture.

Every sample is in exactly one column, so an impact of three samples is seen at any zoom; every n-th
sample would show it in a few percent of the frames.
"""

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidRequest
from ..signals.arrays import Reals

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
