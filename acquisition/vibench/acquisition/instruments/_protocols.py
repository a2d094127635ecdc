"""Protocols of a bench's instruments, which every driver implements."""

import re
from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from math import log
from typing import Annotated, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from ..errors import InstrumentError
from ..host.printable import shorten
from ..host.toml_file import FrozenModel

Samples = NDArray[np.float64]
Counts = NDArray[np.int32]


@dataclass(frozen=True)
class Identity:
    """Identity that an instrument reports; every recording contains this identity."""

    maker: str
    model: str
    serial: str
    firmware: str
    reply: str
    """The instrument's whole reply, unchanged."""
    origin: str = ""
    """Origin of the samples as reported by the instrument, ``"simulated"`` or ``"imported"``; else empty."""


class Knob(FrozenModel):
    """Setting made by hand that no instrument reports; the operator must confirm the setting."""

    instrument: str
    setting: str
    value: str


@dataclass(frozen=True)
class FoundDevice:
    """Data-acquisition device found by a search."""

    name: str
    """Value for ``daq.device`` in the hardware configuration."""
    product: str
    """Value for ``daq.product`` in the hardware configuration."""
    serial: str
    inputs: tuple[str, ...]
    """Names of inputs; the part after the slash is a value for ``daq.channels.physical``."""
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Overload:
    """Range of samples in which an input reaches at least 95 % of its full scale."""

    channel: str
    """Role of the channel, for example ``"m0_velocity"``."""
    first_sample: int
    last_sample: int
    """Number of the last sample in the range; the first sample of the run is 0."""


@dataclass(frozen=True)
class Block:
    """Samples of all channels from one read, which follow those of the previous block without a gap."""

    first_sample: int
    """Number of the block's first sample in the run."""
    volts: Samples
    """Voltages at the converter's input, shape (channels, samples) [V]."""
    overloads: tuple[Overload, ...] = ()
    counts: Counts | None = None
    """Integers of the converter, recorded unchanged; multiply them by `Digitizer.volts_per_count` to get
    volts. None if the converter gives only volts."""


def _not_zero(units: float) -> float:
    if units == 0:
        raise ValueError("the units per volt of a sensor must not be 0")
    return units


@dataclass(frozen=True)
class SensorFacts:
    """Conversion of a quantity to volts by a sensor."""

    quantity: str
    """Quantity of the channel's role: ``"voltage"``, ``"acceleration"`` or ``"velocity"``."""
    unit: str
    """Unit of the quantity in UDUNITS notation: ``"V"``, ``"m s-2"``, ``"m s-1"``."""
    units_per_volt: Annotated[float, AfterValidator(_not_zero)]
    full_scale_v: Annotated[float, Field(gt=0, allow_inf_nan=True)]
    """Largest output voltage of the sensor, peak [V]; infinite for a wire."""
    name: str
    serial: str = ""
    delay_s: Annotated[float, Field(ge=0)] = 0.0
    """Delay from the quantity to the output voltage [s]."""
    calibrated: date | None = None


Time = TypeVar("Time", float, Samples)


class Spacing(StrEnum):
    """Change of a sweep's frequency over time."""

    LINEAR = "linear"
    """The frequency changes at a constant rate in hertz per second."""
    LOGARITHMIC = "logarithmic"
    """The frequency passes through every octave in the same time."""


@dataclass(frozen=True)
class Sweep:
    """Sine sweep, made by the generator itself or approximated by the computer with frequency steps."""

    start_hz: float
    stop_hz: float
    duration_s: float
    spacing: Spacing = Spacing.LINEAR

    def cycles(self, time_s: Time) -> Time:
        """Return the number of cycles since the sweep began, at one or several times [s]."""
        match self.spacing:
            case Spacing.LINEAR:
                rate = (self.stop_hz - self.start_hz) / self.duration_s
                return self.start_hz * time_s + 0.5 * rate * time_s**2
            case Spacing.LOGARITHMIC:
                rate = log(self.stop_hz / self.start_hz) / self.duration_s
                grown: Time = np.expm1(rate * time_s)
                return self.start_hz * grown / rate


@dataclass(frozen=True)
class GeneratorDescription:
    """Capabilities of a generator model, known before opening a generator; plans are checked against them."""

    name: str
    """Name of the model in messages: ``"AFG1022"``."""
    amplitude_range_vpp: tuple[float, float]
    """Smallest and largest amplitude setting at the configured load, peak to peak [V]."""
    highest_sine_hz: float
    memory_points: tuple[int, int]
    """Smallest and largest number of points in one period of a waveform."""
    usb_ids: tuple[tuple[int, int], ...] = ()
    """USB numbers of vendor and product, one pair for each variant."""
    longest_sweep_s: float = 0.0
    """Longest internal sweep of the generator [s]; 0 without internal sweeps."""


class FunctionGenerator(Protocol):
    """Generator with a sine, one waveform memory, and an output that can be switched off.

    Amplitudes are peak to peak at the terminal, in volts, as the instrument's panel shows them.
    """

    @property
    def identity(self) -> Identity:
        """Identity of the generator: its reply to ``*IDN?``."""

    @property
    def unconfirmed(self) -> tuple[Knob, ...]:
        """Settings that could be neither made nor read remotely; the operator must confirm these settings."""

    @property
    def amplitude_range_vpp(self) -> tuple[float, float]:
        """Smallest and largest amplitude that this bench allows, peak to peak [V]."""

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set up a sine. The output keeps its state: on or off."""

    def load_waveform(self, waveform: Samples, repetition_hz: float, amplitude_vpp: float) -> None:
        """Load one period of values and select it; -1 and 1 are the two ends of ``amplitude_vpp``."""

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Set up a sweep: a sine at the start frequency, which `trigger` sweeps to the stop frequency.

        Raises LimitExceeded when the generator has no such internal sweep; see
        `GeneratorDescription.longest_sweep_s`.
        """

    def set_frequency(self, frequency_hz: float) -> None:
        """Change the frequency during the drive, without a jump of the phase."""

    def set_amplitude(self, amplitude_vpp: float) -> None:
        """Change the peak-to-peak amplitude during the drive."""

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each call of `trigger`, with 0 V before and after them."""

    def trigger(self) -> None:
        """Start an armed burst or sweep."""

    def end_burst(self) -> None:
        """End the burst mode, so that the signal plays continuously."""

    def measured_latency_s(self) -> float:
        """Return the duration of one verified amplitude change [s]; no step, ramp or stop is shorter."""

    def start(self) -> None:
        """Turn the output on."""

    def stop(self) -> None:
        """Turn the output off. May be called at any time, in any state; never fails silently."""

    def close(self) -> None:
        """Switch the output off and close the connection to the generator."""


class Digitizer(Protocol):
    """Converter that samples voltages continuously, without gaps."""

    @property
    def identity(self) -> Identity:
        """Product and serial number of the converter, and version of its driver."""

    @property
    def sample_rate_hz(self) -> float:
        """Actual sample rate, read back from the hardware [1/s]."""

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the channels, in the row order of a block."""

    @property
    def volts_per_count(self) -> tuple[float | None, ...]:
        """Step of the converter for each channel [V]; None where volts are not multiples of one step."""

    def start(self) -> None:
        """Begin sampling; the first sample of the run is sample 0."""

    def read(self, samples: int) -> Block:
        """Wait for the next ``samples`` of every channel and return them.

        Raises DataLost when samples were overwritten before they were read, and InstrumentLost when the
        device or its server is gone.
        """

    @property
    def waiting_samples(self) -> int:
        """Number of samples per channel that can be read without waiting."""

    def stop(self) -> None:
        """End sampling. May be called at any time."""

    def close(self) -> None:
        """Release the device. May be called at any time."""


class IdleOutput(StrEnum):
    """Voltage of an output that receives no more samples."""

    ZERO = "goes to zero volts"
    HELD = "holds its last value"


class AnalogOutput(Protocol):
    """Output that plays samples written in advance, starting together with the digitizer."""

    @property
    def identity(self) -> Identity:
        """Product and serial number of the output, and version of its driver."""

    @property
    def sample_rate_hz(self) -> float:
        """Actual sample rate of the output [1/s]."""

    @property
    def idle(self) -> IdleOutput:
        """Voltage of the output when it has no more samples or the program has ended."""

    @property
    def ahead_samples(self) -> int:
        """Largest number of samples that can be written ahead of the sample being played."""

    def write(self, volts: Samples) -> None:
        """Queue samples to be played; wait while the buffer is full.

        Raises
        ------
        LimitExceeded
            When a sample is beyond the limit of the bench. Nothing was written.
        DataLost
            When the output ran out of samples and has stopped.
        """

    def arm(self) -> None:
        """After the first samples were written, prepare to start with the digitizer; both share sample 0."""

    def stop(self) -> None:
        """Go to zero volts at once. May be called at any time; the next `write` begins a new stream."""

    def close(self) -> None:
        """Go to zero volts and release the device. May be called at any time."""


class RealTimeController(Protocol):
    """Instrument with its own feedback loop that drives the amplifier in place of the generator."""

    @property
    def identity(self) -> Identity:
        """Identity of the controller."""

    def close(self) -> None:
        """Silence the drive and close the connection to the controller. May be called at any time."""


_USB = re.compile(r"USB\d*::(0x[0-9a-f]+|[1-9]\d*)::(0x[0-9a-f]+|[1-9]\d*)::", re.IGNORECASE)


def usb_ids(resource: str) -> tuple[int, int] | None:
    """Return vendor and product number in a ``resource`` such as ``USB0::0x0699::0x0353::C1::INSTR``."""
    found = _USB.match(resource)
    return None if found is None else (int(found[1], 0), int(found[2], 0))


def read_block(digitizer: Digitizer, samples: int) -> Block:
    """Return the next ``samples`` of every channel of a ``digitizer`` that is sampling.

    An empty block is refused, because the caller would wait for samples forever. Raises InstrumentError when
    the block is empty, has a wrong number of channels, an overload of an unknown channel, or volts that are
    not finite. Also raises the errors of `Digitizer.read`.
    """
    block = digitizer.read(samples)
    rows = len(digitizer.roles)
    if block.volts.ndim != 2 or block.volts.shape[0] != rows or block.volts.shape[1] == 0:
        raise InstrumentError(
            f"the converter returned a block of shape {block.volts.shape}, but {samples} samples of "
            f"{rows} channels were requested; its driver must wait for all samples, or raise "
            "InstrumentLost"
        )
    if not np.isfinite(block.volts).all():
        raise InstrumentError(
            f"the converter returned samples that are not numbers, from sample {block.first_sample} on; "
            "its driver must return volts, or raise DataLost"
        )
    if unknown := {each.channel for each in block.overloads} - set(digitizer.roles):
        raise InstrumentError(
            f"the converter reports overloads of channels {shorten(repr(sorted(unknown)))}; its channels are "
            f"{', '.join(digitizer.roles)}. Check that no other program changed its task"
        )
    return block
