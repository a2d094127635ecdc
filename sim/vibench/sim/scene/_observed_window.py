"""The end of a motion, observed: its largest values block by block, and its lines at the drive frequency."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kernels import Floats
from ..motion import WHOLE
from ._followed_run import FollowedRun, ObservedQuantities, Samples, Stretch

BLOCKS = 10
"""Parts of a window whose extremes are kept apart: what the scatter of the whole is found from."""


@dataclass(frozen=True, eq=False)
class ObservedWindow:
    """What was seen in a window. SI units."""

    begins: FollowedRun
    """The run as it was where the window begins."""
    stretches: tuple[Stretch, ...]
    """The parts it was followed in."""
    block_peaks_m: Floats
    """Largest abs(x) in equal parts, shape (blocks,)."""
    line_periods: int
    """The lines, over this many whole drive periods before the end: the most that the window holds."""
    line_x_m: complex
    """x = Re(line_x_m * exp(i (omega t + phase))) at the drive frequency."""
    line_p_m: complex

    @property
    def length_s(self) -> float:
        """From its start to its end."""
        return self.stretches[-1].end_s - self.stretches[0].start_s

    @property
    def largest_x_m(self) -> float:
        """Largest abs(x)."""
        return max(stretch.peak_x_m for stretch in self.stretches)

    @property
    def largest_p_m(self) -> float:
        """Largest abs(p)."""
        return max(stretch.peak_p_m for stretch in self.stretches)

    @property
    def impacts(self) -> int:
        """Contacts that began."""
        return sum(stretch.impacts for stretch in self.stretches)


def whole_periods(duration_s: float, frequency_hz: float) -> int:
    """How many whole drive periods a duration holds."""
    return math.floor(duration_s * frequency_hz * (1.0 + WHOLE))


def samples_between(rate_hz: float, start_s: float, end_s: float) -> Samples:
    """States after ``start_s`` and up to ``end_s``, at whole numbers of 1 / ``rate_hz`` from time zero."""
    first, last = (math.floor(time_s * rate_hz * (1.0 + WHOLE) + WHOLE) for time_s in (start_s, end_s))
    return Samples((first + 1) / rate_hz, rate_hz, max(0, last - first))


def follow_strobed(
    run: FollowedRun, until_s: float, observe: ObservedQuantities = ObservedQuantities.NOTHING
) -> Stretch:
    """Follow a motion to an instant, and keep its states once a drive period."""
    end_s = max(until_s, run.time_s)
    return run.follow(end_s, observe, samples_between(run.drive.frequency_hz, run.time_s, end_s))


def observe_window(run: FollowedRun, window_s: float) -> ObservedWindow:
    """Follow a motion through a window that begins now and holds a drive period or more, and observe it."""
    begins, start_s, frequency = run.apart(), run.time_s, run.drive.frequency_hz
    end_s = start_s + window_s
    line_s = max(end_s - whole_periods(window_s, frequency) / frequency, start_s)
    edges = [start_s + window_s * k / BLOCKS for k in range(1, BLOCKS)] + [end_s]
    stretches, peaks = [], []
    for edge in edges:
        parts = (
            [follow_strobed(run, min(line_s, edge), ObservedQuantities.PEAKS)] if run.time_s < line_s else []
        )
        if edge > line_s:
            parts.append(follow_strobed(run, edge, ObservedQuantities.PEAKS_AND_LINES))
        stretches += parts
        peaks.append(max(part.peak_x_m for part in parts))
    return window_of(begins, stretches, peaks)


def window_of(
    begins: FollowedRun, stretches: Sequence[Stretch], block_peaks_m: Sequence[float]
) -> ObservedWindow:
    """Make a window of stretches, one after the other, whose lines cover whole periods up to the end."""
    length_s = stretches[-1].end_s - stretches[0].start_s
    frequency = begins.drive.frequency_hz
    periods = whole_periods(length_s, frequency)
    # A line is the mean of twice the motion against the drive.
    scale = 2.0 * frequency / max(periods, 1)
    return ObservedWindow(
        begins=begins,
        stretches=tuple(stretches),
        block_peaks_m=np.array(block_peaks_m),
        line_periods=periods,
        line_x_m=scale * sum(stretch.area_x for stretch in stretches),
        line_p_m=scale * sum(stretch.area_p for stretch in stretches),
    )


def states_of(stretches: Sequence[Stretch]) -> Floats:
    """All states kept, shape (n, 6)."""
    return np.concatenate([np.empty((0, 6)), *(stretch.states for stretch in stretches)])
