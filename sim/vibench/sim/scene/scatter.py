"""Scatter of Response I between windows of a motion that never repeats. SI units.

It is the largest value of a window, one draw from an extreme-value distribution: in chaos it scatters by a
few per cent whatever the accuracy. The scatter follows from the extremes of blocks of one run, or directly
from many runs with slightly different starts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..specimen.state import Complex, Floats
from .followed_run import Block
from .shares import student_quantile

COVERED = 0.975
"""Share of one tail and the middle: 19 cases of 20 with both tails."""
FEWEST_BLOCKS = 4
"""Fewest extremes for an estimate."""


@dataclass(frozen=True)
class WindowScatter:
    """Scatter of the largest value between windows."""

    relative: float
    """Standard deviation over the mean."""
    blocks: int
    """Extremes that it was found from."""

    @property
    def between_runs(self) -> float:
        """Two runs differ by less in 19 cases of 20, if the extremes were normal: sqrt(2) deviations of
        Student's t for this many blocks. Measured in seven chaotic regimes of five laws at three durations,
        40 runs each: 85 to 99.7 % of the pairs.
        """
        return math.sqrt(2.0) * student_quantile(self.blocks - 1, COVERED) * self.relative


def window_scatter(block_peaks: ArrayLike, blocks_in_window: int) -> WindowScatter | None:
    """Find the scatter of the largest of ``blocks_in_window`` blocks; None for too few blocks.

    It is the geometric mean of two: the blocks' own deviation, which is too large, because extremes of
    longer windows deviate less (Coles, An Introduction to Statistical Modeling of Extreme Values (2001),
    section 3.1), and the bootstrap's, too small, because it never draws more than the largest seen.
    """
    peaks = np.sort(np.asarray(block_peaks, dtype=np.float64))
    if len(peaks) < FEWEST_BLOCKS:
        return None
    mean, drawn = bootstrap_of_largest(peaks, blocks_in_window)
    return WindowScatter(math.sqrt(drawn * float(peaks.std(ddof=1))) / mean, len(peaks))


def bootstrap_of_largest(ascending: Floats, drawn: int) -> tuple[float, float]:
    """Mean and standard deviation of the largest of ``drawn`` values, taken with replacement.

    Of N values, the k-th smallest is the largest drawn with the probability (k/N)^n - ((k-1)/N)^n.
    """
    count = len(ascending)
    weights = np.diff((np.arange(count + 1) / count) ** drawn)
    mean = float(weights @ ascending)
    return mean, math.sqrt(float(weights @ (ascending - mean) ** 2))


def draws_apart(blocks: Sequence[Block], blocks_in_window: int) -> Floats | None:
    """Return the relative difference of the responses of two windows in 19 cases of 20, shape (4,).

    ``blocks`` are those of one window, the last of them, and others before it. None for too few.
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
    """Return the relative difference of the amplitudes of two lines in 19 cases of 20.

    A line is the mean of its parts. Parts that follow one another may be alike: the error of the mean is the
    larger of that from all of them and that from the means of two (Flyvbjerg and Petersen, J. Chem. Phys.
    91 (1989) 461). Across the mean only the square of a deviation counts, over the line's size.
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
    """Return the relative difference of the responses of two starts in 19 cases of 20.

    ``answer`` is one of them, ``others`` are more, each of shape (4,). NaN where one was lost.
    """
    found = np.array([answer, *others])
    times = math.sqrt(2.0) * student_quantile(len(found) - 1, COVERED)
    return np.asarray(times * found.std(axis=0, ddof=1) / np.abs(answer))
