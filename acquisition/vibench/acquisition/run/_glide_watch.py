"""How many cycles of a glide from tone to tone the recorded drive has more, or fewer, than its plan."""

from collections.abc import Callable, Sequence
from math import pi
from typing import Protocol

import numpy as np

from ..instruments import Block, Samples, Sweep
from ..rig import Channel, Role

DELAY_SAMPLES = 40
"""A delta-sigma converter's filter delays every channel by about so much (NI 9234: 38.4): cycles, over a span
of frequencies."""


class Heard(Protocol):
    """What takes blocks as they are read."""

    def append(self, block: Block) -> None:
        """Take the next one."""


class GlideWatch:
    """Holds the phase of the recorded drive against that of the plan, in the last half of every tone."""

    def __init__(self, channels: tuple[Channel, ...], sample_rate_hz: float) -> None:
        self._row = [channel.role for channel in channels].index(Role.DRIVE_VOLTAGE)
        self.sample_rate_hz = sample_rate_hz
        self._planned = 0.0
        self._due_s = 0.0
        self._began: tuple[float, float] | None = None
        self._last_hz = 0.0
        self._more = 0.0

    def begin(self) -> None:
        """Forget: another glide may begin."""
        self._began = None

    def take(
        self,
        blocks: Sequence[Block],
        frequency_hz: float,
        duration_s: float,
        course: Callable[[Samples], Samples] | None = None,
    ) -> None:
        """Take what was recorded while a tone of the glide should have played.

        ``course`` gives the cycles since its beginning, of what is a tone in the mean only.
        """
        if not blocks:
            return
        if self._began is None:
            self._planned, self._due_s, self._more = 0.0, blocks[0].first_sample / self.sample_rate_hz, 0.0
        late = blocks[len(blocks) // 2 :]
        volts = np.concatenate([block.volts[self._row] for block in late])
        count = volts.size if len(blocks) > 1 else volts.size // 2
        time_s = (
            late[-1].first_sample + late[-1].volts.shape[1] - count + np.arange(count)
        ) / self.sample_rate_hz
        since_s = time_s - self._due_s
        cycles = self._planned + (frequency_hz * since_s if course is None else course(since_s))
        turned = complex(np.sum(volts[-count:] * np.exp(-2j * pi * cycles)))
        angle = float(np.angle(turned)) / (2 * pi)
        if self._began is None:
            self._began = angle, frequency_hz
        more = angle - self._began[0]
        # No tone is off by half a cycle more than the one before.
        self._more += (more - self._more + 0.5) % 1.0 - 0.5
        self._planned += frequency_hz * duration_s
        self._due_s += duration_s
        self._last_hz = frequency_hz

    @property
    def more_cycles(self) -> float:
        """Cycles that the drive has more than planned; a jump of more than half a one is taken for less.

        0 within what a converter's delay makes of it.
        """
        if self._began is None:
            return 0.0
        delayed = DELAY_SAMPLES / self.sample_rate_hz * abs(self._last_hz - self._began[1])
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
