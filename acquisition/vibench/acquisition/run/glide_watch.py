"""How many cycles of a glide from tone to tone the recorded drive has more, or fewer, than its plan."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from ..instruments import Block, Samples, Sweep
from ..rig import Channel, Role

DELAY_SAMPLES = 40
"""A delta-sigma converter's filter delays every channel by about so much (NI 9234: 38.4): cycles, over a span
of frequencies."""


CLEAR = 0.3
"""Share of the amplitude beyond which a sample is above or below zero for sure."""


class Heard(Protocol):
    """What takes blocks as they are read."""

    def append(self, block: Block) -> None:
        """Take the next one."""


class GlideWatch:
    """Counts the cycles of the recorded drive by its rising edges, and holds them against the plan."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate_hz: float) -> None:
        self._row = [channel.role for channel in channels].index(Role.DRIVE_VOLTAGE)
        self.sample_rate_hz = sample_rate_hz
        self.begin()

    def begin(self) -> None:
        """Forget: another glide may begin."""
        self._first: tuple[float, float] | None = None
        """Planned cycles at the first edge, and the frequency there [Hz]."""
        self._last_hz = 0.0
        self._next_sample = -1
        self._planned = 0.0
        self._due_s = 0.0
        self._edges = 0
        self._more = 0.0
        self._offset_v = 0.0
        self._before: tuple[float, float] | None = None
        """Time and voltage of the last sample that was clearly above or below zero."""

    def take(
        self,
        blocks: Sequence[Block],
        frequency_hz: float,
        duration_s: float,
        course: Callable[[float], float] | None = None,
    ) -> None:
        """Take what was recorded while a tone of the glide should have played.

        ``course`` gives the cycles since its beginning, of what is a tone in the mean only.
        """
        if not blocks:
            return
        if blocks[0].first_sample != self._next_sample:
            self.begin()
            self._due_s = blocks[0].first_sample / self.sample_rate_hz
        self._next_sample = blocks[-1].first_sample + blocks[-1].volts.shape[1]
        for block in blocks:
            for edge_s in self._rises(block, frequency_hz):
                since_s = edge_s - self._due_s
                planned = self._planned + (frequency_hz * since_s if course is None else course(since_s))
                if self._first is None:
                    self._first = planned, frequency_hz
                self._edges += 1
                self._more = self._edges - 1 - (planned - self._first[0])
        self._planned += frequency_hz * duration_s
        self._due_s += duration_s
        self._last_hz = frequency_hz

    def _rises(self, block: Block, frequency_hz: float) -> Samples:
        """Give the times at which the drive rises through zero [s]; noise around zero makes none."""
        volts, rate_hz = block.volts[self._row], self.sample_rate_hz
        low, high = float(volts.min()), float(volts.max())
        if volts.size * frequency_hz >= rate_hz:
            self._offset_v = 0.5 * (low + high)
        clear = np.flatnonzero(np.abs(volts - self._offset_v) > CLEAR * 0.5 * (high - low))
        before_s, before_v = self._before or (0.0, np.nan)
        time_s = np.append(before_s, (block.first_sample + clear) / rate_hz)
        v = np.append(before_v, volts[clear] - self._offset_v)
        self._before = float(time_s[-1]), float(v[-1])
        at = np.flatnonzero((v[:-1] < 0) & (v[1:] > 0))
        return np.asarray(time_s[at] - v[at] * (time_s[at + 1] - time_s[at]) / (v[at + 1] - v[at]))

    @property
    def more_cycles(self) -> float:
        """Cycles that the drive has more than planned; 0 within what a converter's delay makes of it."""
        if self._first is None:
            return 0.0
        delayed = DELAY_SAMPLES / self.sample_rate_hz * abs(self._last_hz - self._first[1])
        return float(np.sign(self._more) * max(0.0, abs(self._more) - delayed))


class SweepWatch:
    """Holds a sweep that the generator makes by itself against its course, block by block."""

    def __init__(self, glide: GlideWatch, sweep: Sweep) -> None:
        self._glide = glide
        self._sweep = sweep
        self._time_s = 0.0

    def append(self, block: Block) -> None:
        """Take the next block as the part of the sweep that belongs to it."""
        began_s, duration_s = self._time_s, block.volts.shape[1] / self._glide.sample_rate_hz
        began = self._sweep.cycles(began_s)
        self._time_s += duration_s
        mean_hz = (self._sweep.cycles(self._time_s) - began) / duration_s
        self._glide.take([block], mean_hz, duration_s, lambda t: self._sweep.cycles(began_s + t) - began)
