"""When a simulated task converts: its clock, its mode, its buffer and its start trigger."""

import math
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

from nidaqmx.constants import (
    AcquisitionType,
    Edge,
    LoggingMode,
    LoggingOperation,
    OverwriteMode,
    ReadRelativeTo,
    RegenerationMode,
    SampleTimingType,
    Slope,
)
from nidaqmx.error_codes import DAQmxErrors

from ._devices import AnalogInputs, AnalogOutputs, Conversion, Untimed
from ._errors import DaqmxRefusal, unsupported_value

DEFAULT_RATE_HZ = 1000.0
DEFAULT_SAMPLES = 1000
MOST_SAMPLES = 1 << 27
"""Values that one buffer or one read may have: 1 GiB."""

_DEFAULT_BUFFERS = ((100.0, 1_000), (10_000.0, 10_000), (1_000_000.0, 100_000), (math.inf, 1_000_000))
"""Up to that rate, that many samples per channel (NI-DAQmx Help, "How is buffer size determined?")."""


@dataclass(frozen=True)
class ReferenceTrigger:
    """The edge around which a finite task keeps its samples."""

    source: str
    """A terminal, or for an analogue edge a channel of the task."""
    pretrigger: int
    """Samples per channel that are kept from before it."""
    level: float | None = None
    """Of an analogue edge, in the channel's units; None: a digital edge."""
    slope: Slope = Slope.RISING


@dataclass
class Timing:
    """The sample clock and the start trigger, as configured so far."""

    kind: SampleTimingType | None = None
    """None: what the device does without configuration."""
    requested_hz: float = DEFAULT_RATE_HZ
    mode: AcquisitionType = AcquisitionType.FINITE
    samples: int = DEFAULT_SAMPLES
    """To convert, or for a continuous task the least size of the buffer."""
    clock_source: str = ""
    clock_edge: Edge = Edge.RISING
    trigger_source: str = ""
    """Empty: the task begins when it is started."""
    trigger_edge: Edge = Edge.RISING
    reference: ReferenceTrigger | None = None

    @property
    def total(self) -> float:
        """Samples to convert, or infinity."""
        return self.samples if self.mode is AcquisitionType.FINITE else math.inf


@dataclass(frozen=True)
class LogSettings:
    """The TDMS file that a task logs to, and what."""

    path: Path
    mode: LoggingMode
    group: str
    operation: LoggingOperation


@dataclass
class InputSettings:
    """How the program wants to read."""

    buffer_size: int | None = None
    """None: chosen from rate and samples."""
    overwrite: OverwriteMode = OverwriteMode.DO_NOT_OVERWRITE_UNREAD_SAMPLES
    relative_to: ReadRelativeTo = ReadRelativeTo.CURRENT_READ_POSITION
    offset: int = 0
    starts_by_itself: bool = True
    reads_all_available: bool = False
    logging: LogSettings | None = None
    channels: tuple[str, ...] = ()
    """Channels to read; empty: all."""


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


def kind_of(timing: Timing, side: AnalogInputs | AnalogOutputs) -> SampleTimingType:
    """Tell the timing in force on that device."""
    if timing.kind is not None:
        return timing.kind
    is_on_demand = side.untimed is Untimed.ON_DEMAND
    return SampleTimingType.ON_DEMAND if is_on_demand else SampleTimingType.SAMPLE_CLOCK


def actual_rate(timing: Timing, side: AnalogInputs | AnalogOutputs, channels: int) -> float:
    """Rate the device really runs at [Hz]: the next one up that it has.

    Raises DaqmxRefusal when the request lies outside what the device can do (-200077).
    """
    highest = side.rates.maximum_hz / (channels if _shares_converter(side) else 1)
    lowest = side.rates.minimum_hz
    request = lowest if timing.kind is None and timing.requested_hz < lowest else timing.requested_hz
    if not lowest * (1 - 1e-9) <= request <= highest * (1 + 1e-9):
        raise unsupported_value(
            "SampClk_Rate", f"{request:g}", f"{lowest:.6g} to {highest:.6g} samples per second"
        )
    return min(highest, side.rates.next_up(request))


def _shares_converter(side: AnalogInputs | AnalogOutputs) -> bool:
    match side:
        case AnalogInputs(conversion=Conversion.MULTIPLEXED):
            return True
        case _:
            return False


def input_buffer_size(timing: Timing, settings: InputSettings, rate_hz: float) -> int:
    """Size the buffer between device and program, in samples per channel."""
    if settings.buffer_size is not None:
        return settings.buffer_size
    if timing.mode is AcquisitionType.FINITE:
        return timing.samples
    usual = next(size for limit_hz, size in _DEFAULT_BUFFERS if rate_hz <= limit_hz)
    return max(usual, timing.samples)


def check_memory(samples: int, channels: int) -> None:
    """Refuse more samples than the simulated computer has memory for (-50352)."""
    if samples * channels > MOST_SAMPLES:
        detail = f"{samples} samples of {channels} channels; there is room for {MOST_SAMPLES} values"
        raise DaqmxRefusal(DAQmxErrors.PAL_MEMORY_FULL, detail)


def check_samples(samples: int) -> int:
    """Refuse a number of samples that no task can have."""
    if samples < 1:
        raise unsupported_value("SampQuant_SampPerChan", samples, "1 or more")
    return samples
