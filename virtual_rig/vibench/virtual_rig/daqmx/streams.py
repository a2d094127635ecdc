"""Running acquisitions and generations, and the buffers between program and device."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from nidaqmx.constants import AcquisitionType, AOIdleOutputBehavior, RegenerationMode, SampleTimingType
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from ..world.conversion import SampleQueue
from .errors import DaqmxRefusal

if TYPE_CHECKING:
    from .tasks import Task

MOST_SAMPLES = 1 << 27
"""Largest number of values in a buffer or a read: 1 GiB."""


@dataclass
class Timing:
    """Configuration of sample clock and triggers."""

    kind: SampleTimingType | None = None
    """Type of sample timing; None for the device's default."""
    requested_hz: float = 1000.0
    mode: AcquisitionType = AcquisitionType.FINITE
    samples: int = 1000
    """Number of samples to acquire; for a continuous task, the smallest buffer size."""
    clock_source: str = ""
    trigger_source: str = ""
    """Terminal of the start trigger; if empty, sampling begins when the task is started."""

    @property
    def total(self) -> float:
        """Number of samples to acquire; infinite for a continuous task."""
        return self.samples if self.mode is AcquisitionType.FINITE else math.inf


def check_memory(samples: int, channels: int) -> None:
    """Refuse more samples than the simulated computer has memory for (-50352)."""
    if samples * channels > MOST_SAMPLES:
        detail = f"{samples} samples of {channels} channels; there is room for {MOST_SAMPLES} values"
        raise DaqmxRefusal(DAQmxErrors.PAL_MEMORY_FULL, detail)


_ROUNDING_SAMPLES = 1e-5
"""Tolerance of the test whether a sample is due [sample periods], because rig time has rounding errors."""


class Stream:
    """A running acquisition or generation of a task, which begins now; samples are counted per channel."""

    def __init__(self, task: "Task") -> None:
        self.rate_hz = task.rate_hz
        self.began_s = task.rig.now_s
        self.total = task.timing.total
        self.transferred = 0
        """Number of samples per channel acquired or generated so far."""
        self.failure: DaqmxRefusal | None = None

    @property
    def is_done(self) -> bool:
        """Whether all samples of the task are transferred, or no more samples will follow."""
        return self.transferred >= self.total or self.failure is not None

    def reaches(self, count: int) -> bool:
        """Return whether ``count`` samples per channel are transferred."""
        return self.transferred >= count

    def time_of(self, count: float) -> float:
        """Return the rig time at which ``count`` samples are transferred [s]; infinite beyond the total."""
        return self.began_s + count / self.rate_hz if count <= self.total else math.inf

    def due(self, now_s: float) -> int:
        """Return how many samples an endless stream would have transferred by rig time ``now_s``."""
        return math.floor((now_s - self.began_s) * self.rate_hz + _ROUNDING_SAMPLES)


class Acquisition(Stream):
    """A running acquisition, with the samples that the program has not read yet [V]."""

    def __init__(self, task: "Task") -> None:
        super().__init__(task)
        channels = len(task.inputs)
        self.position = 0
        """Number of samples per channel that the program has read."""
        self.queried_at = -1
        """Value of ``position`` at the last query of available samples."""
        self.overloaded: NDArray[np.bool_] = np.zeros(channels, dtype=np.bool_)
        wiring = tuple(channel.wiring() for channel in task.inputs)
        self._sampler = task.rig.world.sample(wiring, self.rate_hz)
        self._unread = SampleQueue(channels)
        self.buffer_size = max(1, task.buffer_size)
        loses_samples = task.rig.pace.loses_samples  # otherwise the buffer grows as needed
        self._capacity = self.buffer_size if loses_samples else MOST_SAMPLES // channels
        self._is_open = True

    @property
    def available(self) -> int:
        """Number of samples per channel that the program has not read yet."""
        return self.transferred - self.position

    def advance_to(self, now_s: float) -> None:
        """Acquire all samples that are due at rig time ``now_s``."""
        due = int(min(self.due(now_s), self.total))
        while self.transferred < due and self._is_open and self.failure is None:
            self._store(self._sampler.read(min(due - self.transferred, self.buffer_size)))
        if self.is_done:
            self.close()

    def _store(self, block: NDArray[np.float64]) -> None:
        self._unread.append(block)
        self.transferred += block.shape[1]
        if self.available > self._capacity:
            self.failure = DaqmxRefusal(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE, samples_read=0)

    def read(self, count: int) -> NDArray[np.float64]:
        """Return the next ``count`` samples, shape (channels, count) [V].

        Raises DaqmxRefusal after a buffer overflow (-200279).
        """
        if self.failure is not None:
            raise self.failure
        self.position += count
        return self._unread.take(count)

    def look_for_overloads(self) -> None:
        """Latch the inputs that have clipped since the last call."""
        if self._is_open:
            self.overloaded = np.asarray(self._sampler.overload_flags(), dtype=np.bool_)

    def close(self) -> None:
        """Stop the conversion; stored samples can still be read."""
        if self._is_open:
            self._is_open = False
            self._sampler.close()


LEAD_S = 0.005
"""Lead of the samples passed to the world [s]; it avoids gaps, and is short so that new samples act soon."""


class OutputBuffer:
    """Samples written by a program and not yet used by the device, shape (channels, size) [V]."""

    def __init__(self, channels: int, size: int = 0) -> None:
        """Create a buffer; with ``size`` 0, the buffer grows with the samples written before the start."""
        self.is_sized = size > 0
        self.written = 0
        self._ring = np.zeros((channels, size))

    @property
    def size(self) -> int:
        """Size of the buffer in samples per channel."""
        return int(self._ring.shape[1])

    @property
    def buffered(self) -> int:
        """Number of samples in the buffer; a regeneration repeats these samples."""
        return min(self.written, self.size)

    def grow(self, count: int) -> None:
        """Enlarge the buffer by ``count`` samples, before the start of a task without a set buffer size."""
        self._ring = np.concatenate([self._ring, np.zeros((self._ring.shape[0], count))], axis=1)

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append samples, which may overwrite the oldest; the caller has checked the space."""
        at = (self.written + np.arange(volts.shape[1])) % self.size
        self._ring[:, at] = volts
        self.written += volts.shape[1]

    def cyclic(self, first: int, count: int) -> NDArray[np.float64]:
        """Return ``count`` samples from number ``first`` on; the filled part repeats endlessly."""
        return self._ring[:, (first + np.arange(count)) % self.buffered]


class Generation(Stream):
    """A running generation: samples played, and samples that wait in the buffer and in the device."""

    def __init__(self, task: "Task") -> None:
        super().__init__(task)
        device = task.outputs[0].side
        self.buffer = task.output_buffer
        self.delivered = 0
        self._world = task.rig.world
        self._outputs = tuple(channel.physical for channel in task.outputs)
        self.repeats = task.regeneration is RegenerationMode.ALLOW_REGENERATION
        """Whether the buffer is played repeatedly; otherwise every sample in the buffer is played once."""
        self._idle = device.idle
        self._memory = np.empty((len(self._outputs), 0))
        self._most_in_memory = 0 if self.repeats else device.memory
        """Largest number of samples stored in the device; 0 for a repeated buffer."""
        self._fetched = 0
        self._recent = np.empty((len(self._outputs), 0))
        self._is_open = True

    def has_room(self, samples: int) -> bool:
        """Return whether ``samples`` can be written now; a repeated buffer can always be rewritten."""
        if self.repeats:
            return True
        self._fetch(self.delivered + self._most_in_memory)
        return samples <= self.buffer.size - (self.buffer.written - self._fetched)

    def time_of_room(self, samples: int) -> float:
        """Return the rig time at which ``samples`` can be written [s]."""
        left = self.buffer.written + samples - self.buffer.size - self._most_in_memory
        return self.time_of(max(0, left)) - LEAD_S

    def prepare(self, until_s: float) -> None:
        """Pass samples to the world, up to rig time ``until_s`` plus a lead."""
        if not self._is_open:
            return
        wanted = math.ceil((until_s + LEAD_S - self.began_s) * self.rate_hz)
        count = int(min(wanted, self.total, self._end)) - self.delivered
        if count <= 0:
            return
        self._fetch(self.delivered + count)
        block, self._memory = self._memory[:, :count], self._memory[:, count:]
        for output, volts in zip(self._outputs, block, strict=True):
            self._world.play(output, volts, self.rate_hz)
        self.delivered += count
        kept = math.ceil(LEAD_S * self.rate_hz) + 1
        self._recent = np.concatenate([self._recent, block], axis=1)[:, -kept:]

    def _fetch(self, until: int) -> None:
        count = int(min(until, self.total, self._end)) - self._fetched
        if count > 0:
            self._memory = np.concatenate([self._memory, self.buffer.cyclic(self._fetched, count)], axis=1)
            self._fetched += count

    @property
    def _end(self) -> float:
        return math.inf if self.repeats and self.buffer.buffered else self.buffer.written

    def advance_to(self, now_s: float) -> None:
        """Update the number of played samples at rig time ``now_s``, and detect an underflow."""
        if not self._is_open:
            return
        due = self.due(now_s)
        self.transferred = int(min(due, self.total, self.delivered))
        if due > self.delivered and self.delivered < self.total:
            self.failure = DaqmxRefusal(
                DAQmxErrors.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES, samples_written=0
            )
        if self.is_done:
            self.close()

    def close(self) -> None:
        """End the generation, and discard the samples not yet played; allowed at any time."""
        if not self._is_open:
            return
        self._is_open = False
        for output in self._outputs:
            self._world.silence(output)
        if self._idle is AOIdleOutputBehavior.MAINTAIN_EXISTING_VALUE and self.transferred:
            last = max(0, self._recent.shape[1] - 1 - (self.delivered - self.transferred))
            for output, volts in zip(self._outputs, self._recent[:, last : last + 1], strict=True):
                self._world.play(output, volts, self.rate_hz)
