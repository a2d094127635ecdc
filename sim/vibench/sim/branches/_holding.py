"""Whether a loop can hold an unstable motion: how fast the motion is left, beside how often the loop acts."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..periodic.branch import NEUTRAL

UPDATES_TO_HOLD = 10.0
"""A loop holds what takes this many of its updates to grow by e: it must see a departure and answer it."""


def growth_time_s(frequency_hz: ArrayLike, multiplier: ArrayLike, periods: int = 1) -> NDArray[np.float64]:
    """Give the time in which a small distance from a motion grows by e; infinite where it does not grow.

    It is T / ln|mu| with T the period of the motion, and holds where the base moves as prescribed.

    Parameters
    ----------
    frequency_hz
        Of the drive [Hz].
    multiplier
        Magnitude of the largest Floquet multiplier over the whole period of the motion; same shape.
    periods
        Drive periods of the motion.

    """
    size = np.asarray(multiplier, dtype=np.float64)
    rate = np.where(size > 1.0 + NEUTRAL, np.log(np.maximum(size, 1.0)), 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(periods / (np.asarray(frequency_hz, dtype=np.float64) * rate))


def least_growth_time_s(loop_time_s: float) -> float:
    """Give the shortest growth time that a loop can hold against [s].

    Parameters
    ----------
    loop_time_s
        From a motion to the drive that answers it [s].

    Raises
    ------
    ValueError
        When it is not positive and finite.

    """
    if not 0.0 < loop_time_s < math.inf:
        msg = f"A loop time of {loop_time_s} s is not allowed: positive and finite."
        raise ValueError(msg)
    return UPDATES_TO_HOLD * loop_time_s
