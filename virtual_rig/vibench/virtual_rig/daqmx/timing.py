"""When a simulated task converts: its clock, its mode, its buffer and its triggers."""

import math
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

from nidaqmx.constants import (
    AcquisitionType,
    RegenerationMode,
    SampleTimingType,
)
from nidaqmx.error_codes import DAQmxErrors

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
