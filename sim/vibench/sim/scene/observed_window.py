"""The end of a motion, observed: its largest values block by block, and its lines at the drive frequency."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..engine.run import Watch
from ..model.arrays import Floats
from ..motion.response import WHOLE
from .followed_run import FollowedRun, Samples, Stretch

BLOCKS = 10
"""Parts of a window that are kept apart: what the scatter of the whole is found from."""
FIRST, LAST = 2, 3
"""Parts at the ends of a window that tell of lasting chaos that it lasted: half of what it grew in is late,
whether or not a stretch precedes the first."""


@dataclass(frozen=True)
class Block:
    """What was seen in a part of a motion that holds whole drive periods, but for what precedes the first."""

    peak_x_m: float
    """Largest abs(x)."""
    peak_p_m: float
    line_x_m: complex
    """x = Re(line_x_m * exp(i (omega t + phase))) at the drive frequency."""
    line_p_m: complex


@dataclass(frozen=True, eq=False)
class ObservedWindow:
    """What was seen in a window. SI units."""

    begins: FollowedRun
    """The run as it was where the window begins."""
    stretches: tuple[Stretch, ...]
    """The parts it was followed in."""
    blocks: tuple[Block, ...]
    """Equal parts, but for a drive period."""
    line_periods: int
    """The lines, over this many whole drive periods before the end: the most that the window holds, of the
    motion's own periods where it has one."""
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
    def responses_m(self) -> Floats:
        """Largest abs(x), line of x, largest abs(p), line of p, shape (4,); not over the drive."""
        return np.array([self.largest_x_m, abs(self.line_x_m), self.largest_p_m, abs(self.line_p_m)])

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


def follow_strobed(run: FollowedRun, until_s: float, observe: Watch = Watch.NOTHING) -> Stretch:
    """Follow a motion to an instant, and keep its states once a drive period."""
    end_s = max(until_s, run.time_s)
    return run.follow(end_s, observe, samples_between(run.drive.frequency_hz, run.time_s, end_s))


def observe_window(
    run: FollowedRun,
    window_s: float,
    cycle: int = 1,
    is_chaos: Callable[[Sequence[Stretch]], bool] | None = None,
) -> ObservedWindow:
    """Follow a motion through a window that begins now and holds a drive period or more, and observe it.

    A motion that repeats after ``cycle`` drive periods has its lines taken over a whole multiple of them, as
    far as the window holds one: over other lengths its other lines leak in. Where ``is_chaos`` says of the
    first parts that they surely are, a small change is not carried through the middle, only at the end again.
    """
    begins, start_s, frequency = run.apart(), run.time_s, run.drive.frequency_hz
    end_s = start_s + window_s
    periods = whole_periods(window_s, frequency)
    periods = cycle * (periods // cycle) or periods
    line_s = max(end_s - periods / frequency, start_s)
    count = min(BLOCKS, periods)
    edges = [end_s - (periods * (count - k) // count) / frequency for k in range(1, count)] + [end_s]
    head = [follow_strobed(run, line_s, Watch.PEAKS)] if run.time_s < line_s else []
    parts: list[Stretch] = []
    for edge in edges:
        if is_chaos is not None and count == BLOCKS:
            if len(parts) == FIRST and is_chaos(parts):
                run.drop_tangent()
            elif len(parts) == BLOCKS - LAST and math.isnan(parts[-1].growth):
                run.follow_tangent()
        parts.append(follow_strobed(run, edge, Watch.PEAKS_AND_LINES))
    return window_of(begins, parts, head)


def window_of(begins: FollowedRun, parts: Sequence[Stretch], head: Sequence[Stretch] = ()) -> ObservedWindow:
    """Make a window of parts that hold whole drive periods, after a head of which only peaks are taken."""
    frequency = begins.drive.frequency_hz
    periods = round(sum(part.length_s for part in parts) * frequency)
    scale = 2.0 * frequency / max(periods, 1)
    return ObservedWindow(
        begins=begins,
        stretches=(*head, *parts),
        blocks=blocks_of(parts),
        line_periods=periods,
        line_x_m=scale * sum(part.area_x for part in parts),
        line_p_m=scale * sum(part.area_p for part in parts),
    )


def blocks_of(parts: Sequence[Stretch]) -> tuple[Block, ...]:
    """Take each watched part as a block; a line is the mean of twice the motion against the drive."""
    return tuple(
        Block(
            part.peak_x_m,
            part.peak_p_m,
            2.0 * part.area_x / part.length_s,
            2.0 * part.area_p / part.length_s,
        )
        for part in parts
        if part.peak_x_m > 0.0 and part.length_s > 0.0
    )


def states_of(stretches: Sequence[Stretch]) -> Floats:
    """All states kept, shape (n, 6)."""
    return np.concatenate([np.empty((0, 6)), *(stretch.states for stretch in stretches)])
