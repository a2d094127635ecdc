"""How well the mean of a correlated series is known: its standard error, by blocks as long as they must be.

Neighbouring values are averaged in pairs, again and again; the error of the mean that the blocks suggest
grows until they are longer than the memory of the series, and stays (Flyvbjerg and Petersen, J. Chem. Phys.
91 (1989) 461). That it stays is tested by the correlation of neighbouring blocks, at one length and all
longer ones together (Jonsson, Phys. Rev. E 98 (2018) 043304).
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from ..model.arrays import Floats

FEWEST_BLOCKS = 16
"""With fewer independent blocks an error is itself known to less than 20 per cent."""
CONFIDENCE = 0.99
"""Blocks count as independent unless the test says otherwise this surely."""


@dataclass(frozen=True)
class BlockedMean:
    """A mean with its standard error."""

    mean: float
    standard_error: float
    """Of the mean; zero where all values are equal, NaN for a single one."""
    block_length: int
    """Values in a block: a power of two, as few as make neighbouring blocks independent."""
    blocks: int
    correlation_length: float
    """Values that carry as much as one independent value: variance of the mean over that of as many
    independent ones."""
    is_long_enough: bool
    """The series holds `FEWEST_BLOCKS` independent blocks or more: else the error is a lower bound."""


def blocked_mean(values: ArrayLike) -> BlockedMean:
    """Average a series of evenly spaced values, shape (n,), n >= 1.

    Raises ValueError when there is no value, or one is not finite.
    """
    series = np.asarray(values, dtype=np.float64)
    if series.ndim != 1 or len(series) == 0 or not bool(np.all(np.isfinite(series))):
        msg = f"A series of shape {series.shape} has no mean here: give one row of finite numbers."
        raise ValueError(msg)
    mean = float(series.mean())
    variances, correlations, counts = _levels(series - mean)
    if len(counts) == 0 or variances[0] == 0.0:
        error = 0.0 if len(series) > 1 else math.nan
        return BlockedMean(mean, error, 1, len(series), 1.0, len(series) >= FEWEST_BLOCKS)
    level = _first_independent(variances, correlations, counts)
    variance = variances[level] / (counts[level] - 1)
    return BlockedMean(
        mean=mean,
        standard_error=math.sqrt(variance),
        block_length=2**level,
        blocks=int(counts[level]),
        correlation_length=float(variance / (variances[0] / (counts[0] - 1))),
        is_long_enough=bool(counts[level] >= FEWEST_BLOCKS),
    )


def _levels(centred: Floats) -> tuple[Floats, Floats, Floats]:
    """Variance, covariance of neighbours and number of blocks at every length that leaves two or more."""
    variances, correlations, counts = [], [], []
    while len(centred) > 1:
        variances.append(float(np.mean(centred**2)))
        correlations.append(float(np.sum(centred[:-1] * centred[1:])) / len(centred))
        counts.append(len(centred))
        pairs = len(centred) // 2
        centred = 0.5 * (centred[: 2 * pairs : 2] + centred[1 : 2 * pairs : 2])
    return np.array(variances), np.array(correlations), np.array(counts, dtype=np.float64)


def _first_independent(variances: Floats, correlations: Floats, counts: Floats) -> int:
    """Find the shortest blocks from which on no neighbours are correlated."""
    ratios = np.divide(correlations, variances, out=np.zeros_like(variances), where=variances > 0.0)
    # Of independent values the lagged correlation has the mean -1/n and the variance 1/n.
    evidence = np.cumsum((counts * (ratios + 1.0 / counts) ** 2)[::-1])[::-1]
    passes = np.flatnonzero(evidence < _largest_by_chance(len(counts)))
    return int(passes[0]) if len(passes) else len(counts) - 1


@cache
def _largest_by_chance(levels: int) -> Floats:
    """Evidence from each length and all longer ones, if blocks are independent."""
    from scipy.special import chdtri  # noqa: PLC0415 - a fifth of a second, which few motions need

    return np.asarray(chdtri(np.arange(levels, 0, -1), 1.0 - CONFIDENCE))
