"""A running acquisition: the sampler, and the circular buffer between the device and the reader."""

import math
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

import numpy as np
from nidaqmx.constants import (
    AcquisitionType,
    RegenerationMode,
    SampleTimingType,
)
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from ..analogue import Sampler
from .errors import DaqmxRefusal, unsupported_value

MOST_SAMPLES = 1 << 27
"""Values that one buffer or one read may have: 1 GiB."""

_LEAST_PRETRIGGER = 2


@dataclass(frozen=True)
class ReferenceTrigger:
    """The edge around which a finite task keeps its samples."""

    terminal: str
    pretrigger: int
    """Samples per channel that are kept from before it."""


@dataclass
class Timing:
    """The sample clock and the triggers, as configured so far."""

    kind: SampleTimingType | None = None
    """None: what the device does without configuration."""
    requested_hz: float = 1000.0
    mode: AcquisitionType = AcquisitionType.FINITE
    samples: int = 1000
    """To convert, or for a continuous task the least size of the buffer."""
    clock_source: str = ""
    trigger_source: str = ""
    """Empty: the task begins when it is started."""
    reference: ReferenceTrigger | None = None

    @property
    def total(self) -> float:
        """Samples to convert, or infinity."""
        return self.samples if self.mode is AcquisitionType.FINITE else math.inf

    def verify_reference(self) -> None:
        """Refuse a reference trigger in a continuous task, or with too few samples on one side of it."""
        if self.reference is None:
            return
        if self.mode is not AcquisitionType.FINITE:
            raise DaqmxRefusal(DAQmxErrors.REF_TRIG_WHEN_CONTINUOUS)
        most = self.samples - _LEAST_PRETRIGGER
        if not _LEAST_PRETRIGGER <= self.reference.pretrigger <= most:
            allowed = f"{_LEAST_PRETRIGGER} to {most} of {self.samples} samples"
            raise unsupported_value("RefTrig_PretrigSamples", self.reference.pretrigger, allowed)


class Overflow(Enum):
    """What becomes of samples that find their buffer full."""

    GROW = auto()
    """The buffer grows: nothing is lost."""
    LOSE = auto()
    """The oldest samples are overwritten, as on the real device."""


@dataclass(frozen=True)
class LogSettings:
    """The TDMS file that a task logs to what is read."""

    path: Path
    group: str


@dataclass
class InputSettings:
    """How the program wants to read."""

    buffer_size: int | None = None
    """None: chosen from rate and samples."""
    logging: LogSettings | None = None


class StartsItself(Enum):
    """Whether a write starts a task that is not running."""

    YES = auto()
    NO = auto()


@dataclass
class OutputSettings:
    """How the program wants to write."""

    buffer_size: int = 0
    """0: as large as the first writes."""
    regeneration: RegenerationMode = RegenerationMode.ALLOW_REGENERATION


def check_memory(samples: int, channels: int) -> None:
    """Refuse more samples than the simulated computer has memory for (-50352)."""
    if samples * channels > MOST_SAMPLES:
        detail = f"{samples} samples of {channels} channels; there is room for {MOST_SAMPLES} values"
        raise DaqmxRefusal(DAQmxErrors.PAL_MEMORY_FULL, detail)


_ROUNDING_SAMPLES = 1e-5
"""Rig time is a sum of many durations: a sample is due although the sum falls this much of a period short."""


class Acquisition:
    """Samples per channel, counted from the start of the task; volts as the converter saw them."""

    def __init__(
        self,
        sampler: Sampler,
        channels: int,
        rate_hz: float,
        began_s: float,
        total: float,
        buffer_size: int,
        overflow: Overflow,
        reference: ReferenceTrigger | None = None,
    ) -> None:
        """Begin at rig time ``began_s``; ``total`` samples, or infinity, around a ``reference`` trigger."""
        self.rate_hz = rate_hz
        self.began_s = began_s
        self.total = total if reference is None else math.inf
        self.acquired = 0
        self.position = 0
        self.asked_at = -1
        """Read position at which somebody has asked last how many samples wait."""
        self.failure: DaqmxRefusal | None = None
        self.overloaded: NDArray[np.bool_] = np.zeros(channels, dtype=np.bool_)
        self._sampler = sampler
        self._ring = np.empty((channels, max(1, buffer_size)))
        self._overflow = overflow
        self._samples = total
        self._reference = reference
        self._is_open = True

    @property
    def available(self) -> int:
        """Unread samples."""
        return self.acquired - self.position

    @property
    def buffer_size(self) -> int:
        """Samples per channel that the buffer holds."""
        return int(self._ring.shape[1])

    @property
    def is_done(self) -> bool:
        """Whether nothing more will be acquired."""
        return self.acquired >= self.total or self.failure is not None

    def time_of(self, count: float) -> float:
        """Rig time at which ``count`` samples exist [s]; infinite if they never will."""
        return self.began_s + count / self.rate_hz if count <= self.total else math.inf

    @property
    def passed(self) -> int:
        """Samples per channel that have gone into the buffer."""
        return self.acquired

    @property
    def used(self) -> float:
        """Samples per channel that the program has read."""
        return self.position

    def listened_until_s(self, count: int) -> float:
        """Rig time at which a listener expects ``count`` samples [s]."""
        return self.time_of(count)

    def advance_to(self, now_s: float) -> None:
        """Convert whatever is due at rig time ``now_s``."""
        due = math.floor((now_s - self.began_s) * self.rate_hz + _ROUNDING_SAMPLES)
        due = int(min(due, self.total))
        while self.acquired < min(due, self.total) and self._is_open and self.failure is None:
            self._store(self._sampler.read(min(due - self.acquired, self.buffer_size)))
        if self.is_done:
            self.close()

    @property
    def awaits_trigger(self) -> bool:
        """Whether it keeps only the newest samples, until its reference trigger comes."""
        return self._reference is not None and self._is_open and self.total == math.inf

    @property
    def enough_before_s(self) -> float:
        """Rig time by which the reference trigger counts; infinite when that has passed [s]."""
        assert self._reference is not None
        kept = self._reference.pretrigger
        return self.began_s + kept / self.rate_hz if self.acquired < kept else math.inf

    def trigger(self) -> bool:
        """Let the reference trigger come now; say whether it counts.

        It does not while there are fewer samples than are to be kept from before it.
        """
        assert self._reference is not None
        kept = self._reference.pretrigger
        if not self.awaits_trigger or self.acquired < kept:
            return False
        self.position = self.acquired - kept
        self.total = self.position + self._samples
        return True

    def _store(self, block: NDArray[np.float64]) -> None:
        count = block.shape[1]
        if self.awaits_trigger:
            self.position = self.acquired + count
        elif self.available + count > self.buffer_size:
            needed = self.available + count
            if self._overflow is Overflow.GROW and self._ring.shape[0] * needed <= MOST_SAMPLES:
                self._grow(needed)
            else:
                self.failure = DaqmxRefusal(DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE, samples_read=0)
        first = self.acquired % self.buffer_size
        head = min(count, self.buffer_size - first)
        self._ring[:, first : first + head] = block[:, :head]
        self._ring[:, : count - head] = block[:, head:]
        self.acquired += count

    def _grow(self, needed: int) -> None:
        unread = self._copy(self.position, self.available)
        larger = np.empty((self._ring.shape[0], max(needed, 2 * self.buffer_size)))
        at = (np.arange(self.available) + self.position) % larger.shape[1]
        larger[:, at] = unread
        self._ring = larger

    def _copy(self, first: int, count: int) -> NDArray[np.float64]:
        start = first % self.buffer_size
        head = min(count, self.buffer_size - start)
        if head == count:
            return self._ring[:, start : start + count].copy()
        return np.concatenate([self._ring[:, start:], self._ring[:, : count - head]], axis=1)

    def read_at(self, first: int, count: int) -> NDArray[np.float64]:
        """Hand over ``count`` samples from number ``first`` on, shape (channels, count) [V].

        Raises DaqmxRefusal when the buffer has overflown (-200279).
        """
        if self.failure is not None:
            raise self.failure
        block = self._copy(first, count)
        self.position = first + count
        return block

    def look_for_overloads(self) -> None:
        """Latch which inputs have clipped since the last look."""
        if self._is_open:
            self.overloaded = np.asarray(self._sampler.overloaded(), dtype=np.bool_)

    def close(self) -> None:
        """Stop converting; what is in the buffer can still be read."""
        if self._is_open:
            self._is_open = False
            self._sampler.close()
