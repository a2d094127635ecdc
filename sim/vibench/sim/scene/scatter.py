"""Scatter of Response I between windows of a motion that never repeats. SI units.

Response I is the largest value in a window and therefore has an extreme-value distribution. In chaos,
Response I scatters by a few per cent at any accuracy. The scatter is estimated from the largest values in
blocks of one run, or from several runs with slightly different starts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..specimen.specimen import Complex, Floats
from .followed_run import Block
from .shares import student_quantile

COVERED = 0.975
"""Probability below the upper end of a symmetric 95 % interval."""
FEWEST_BLOCKS = 4
"""Smallest number of blocks of a run from which the scatter of Response I is estimated."""


@dataclass(frozen=True)
class WindowScatter:
    """Scatter of the largest value in a window, from window to window."""

    relative: float
    """Standard deviation of the largest value in a window, divided by its mean."""
    blocks: int
    """Number of blocks from which the scatter was estimated."""

    @property
    def between_runs(self) -> float:
        """Relative difference that two runs do not exceed in 95 % of cases.

        The limit is sqrt(2) standard deviations times Student's t, and covers 85 to 99.7 % of chaotic pairs.
        """
        return math.sqrt(2.0) * student_quantile(self.blocks - 1, COVERED) * self.relative


def window_scatter(block_peaks: ArrayLike, blocks_in_window: int) -> WindowScatter | None:
    """Return the scatter of the largest value in ``blocks_in_window`` blocks; None for too few blocks.

    The scatter is the geometric mean of two estimates. The scatter of block peaks is too large, because peaks
    of longer windows scatter less (Coles, Statistical Modeling of Extreme Values (2001), section 3.1).
    The bootstrap estimate is too small, because this estimate never exceeds the largest observed peak.
    """
    peaks = np.sort(np.asarray(block_peaks, dtype=np.float64))
    if len(peaks) < FEWEST_BLOCKS:
        return None
    mean, drawn = bootstrap_of_largest(peaks, blocks_in_window)
    return WindowScatter(math.sqrt(drawn * float(peaks.std(ddof=1))) / mean, len(peaks))


def bootstrap_of_largest(ascending: Floats, drawn: int) -> tuple[float, float]:
    """Return mean and standard deviation of the largest of ``drawn`` values, drawn with replacement.

    For n draws from N values, the k-th smallest is the largest with probability (k/N)^n - ((k-1)/N)^n.
    """
    count = len(ascending)
    weights = np.diff((np.arange(count + 1) / count) ** drawn)
    mean = float(weights @ ascending)
    return mean, math.sqrt(float(weights @ (ascending - mean) ** 2))


def draws_apart(blocks: Sequence[Block], blocks_in_window: int) -> Floats | None:
    """Return the 95 % limit of the relative difference between the responses in two windows, shape (4,).

    ``blocks`` are the blocks before a window, followed by the blocks of the window. None for too few blocks.
    """
    lines = blocks[-blocks_in_window:]
    along = [window_scatter([block.peak_x_m for block in blocks], blocks_in_window)]
    along += [window_scatter([block.peak_p_m for block in blocks], blocks_in_window)]
    if along[0] is None or along[1] is None or len(lines) < FEWEST_BLOCKS:
        return None
    return np.array(
        [
            along[0].between_runs,
            _lines_apart(np.array([block.line_x_m for block in lines])),
            along[1].between_runs,
            _lines_apart(np.array([block.line_p_m for block in lines])),
        ]
    )


def _lines_apart(parts: Complex) -> float:
    """Return the 95 % limit of the relative difference between the amplitudes of a line in two windows.

    ``parts`` are the line's complex amplitudes in consecutive blocks; the line is their mean. Because blocks
    may be correlated, the larger of two errors is used: from all blocks, or from means of pairs (Flyvbjerg
    and Petersen, J. Chem. Phys. 91 (1989) 461). A deviation d normal to the mean a changes |a| by d²/(2|a|).
    """
    line = complex(parts.mean())
    found = []
    for each in (parts, 0.5 * (parts[0 : len(parts) // 2 * 2 : 2] + parts[1::2])):
        if len(each) < FEWEST_BLOCKS:
            continue
        times = math.sqrt(2.0) * student_quantile(len(each) - 1, COVERED) / math.sqrt(len(each))
        turned = each * (line.conjugate() / abs(line)) if line != 0.0 else each
        deviations = times * np.array([turned.real.std(ddof=1), turned.imag.std(ddof=1)])
        across = min(float(deviations[1] ** 2) / (2.0 * abs(line)), float(deviations[1]))
        found.append(float(deviations[0]) + across)
    return max(found) / abs(line)


def draws_of_starts(answer: Floats, others: Sequence[Floats]) -> Floats:
    """Return the 95 % limit of the relative difference between the responses of two starts, shape (4,).

    ``answer`` and ``others`` are responses of nearly equal starts, shape (4,) each; NaN if a run failed.
    """
    found = np.array([answer, *others])
    times = math.sqrt(2.0) * student_quantile(len(found) - 1, COVERED)
    return np.asarray(times * found.std(axis=0, ddof=1) / np.abs(answer))
