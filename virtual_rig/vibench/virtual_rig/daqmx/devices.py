"""Devices of the simulated DAQmx system with their capabilities, and channels with their settings.

Sources: NI 9234 and NI USB-9234 guides (ranges, IEPE, data rates fM/256/n), NI USB-443x specifications
(ranges, rates, IEPE), NI USB-6211 specifications. Not confirmed on a device: the minimum rate, the rate steps
and the output memory of the USB-4431, the default couplings, and all figures of the USB-6211.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from nidaqmx.constants import (
    AOIdleOutputBehavior,
    ExcitationSource,
    ProductCategory,
    SampleTimingType,
    TerminalConfiguration,
)
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError
from nidaqmx.utils import unflatten_channel_string
from numpy.typing import NDArray

from vibench.acquisition import ConfigurationError

from ..world.conversion import Coupling, Input
from .errors import DaqmxRefusal, unsupported_value

_NI_9234_RATE_HZ = 13.1072e6 / 256
_NI_9234_MAX_DIVISOR = 31
_M_SERIES_TIMEBASE_HZ = 20e6

_ROUNDING = 1e-12
"""Relative tolerance of rates: a rate that is read back and set again must not change to the next rate."""


@dataclass(frozen=True)
class Rates:
    """Sample rates within an interval; if a clock is given, only integer fractions of the clock rate."""

    minimum_hz: float
    maximum_hz: float
    clock_hz: float | None = None

    def next_up(self, rate_hz: float) -> float:
        """Return the smallest possible rate that is not below ``rate_hz``, except for rounding errors."""
        if self.clock_hz is None:
            return rate_hz
        return self.clock_hz / math.floor(self.clock_hz / rate_hz * (1 + _ROUNDING))


@dataclass(frozen=True)
class AnalogInputs:
    """Capabilities of a device's inputs."""

    count: int
    ranges_v: tuple[float, ...]
    """Full scales in ascending order, each symmetric about zero [V]."""
    rates: Rates
    bits: int
    couplings: tuple[Coupling, ...]
    iepe_currents_a: tuple[float, ...]
    """Possible excitation currents besides 0 [A]; empty if the inputs have no excitation."""
    terminals: tuple[TerminalConfiguration, ...]
    """Possible terminal configurations; the first is the default."""
    untimed: SampleTimingType
    """Timing of a task whose sample clock is not set; delta-sigma converters use their default clock rate."""
    detects_overloads: bool = False
    """Whether the device reports clipped inputs."""
    is_multiplexed: bool = False
    """Whether the inputs of a task share one converter, and so also share the converter's highest rate."""


@dataclass(frozen=True)
class AnalogOutputs:
    """Capabilities of a device's outputs."""

    count: int
    range_v: float
    rates: Rates
    idle: AOIdleOutputBehavior
    """State of an output after its generation has ended."""
    untimed: SampleTimingType
    memory: int
    """Samples per channel in the device's memory, between the program's buffer and the converter."""


@dataclass(frozen=True)
class Device:
    """One device of the simulated DAQmx system."""

    name: str
    product_type: str
    serial: int
    category: ProductCategory
    inputs: AnalogInputs | None = None
    outputs: AnalogOutputs | None = None
    chassis: str = ""
    pfi_lines: int = 0

    @property
    def clock_name(self) -> str:
        """The device whose timing engine is used: for a module its chassis, else the device itself."""
        return self.chassis or self.name

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs, such as ``"Dev1/ai0"``."""
        return tuple(f"{self.name}/ai{n}" for n in range(self.inputs.count)) if self.inputs else ()

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs, such as ``"Dev1/ao0"``."""
        return tuple(f"{self.name}/ao{n}" for n in range(self.outputs.count)) if self.outputs else ()

    @property
    def terminals(self) -> tuple[str, ...]:
        """Names of the terminals for routing signals."""
        pfi = [f"/{self.name}/PFI{n}" for n in range(self.pfi_lines)]
        sides = [side for side, names in (("ai", self.input_names), ("ao", self.output_names)) if names]
        inner = [
            f"/{self.clock_name}/{side}/{signal}"
            for side in sides
            for signal in ("SampleClock", "StartTrigger")
        ]
        return (*pfi, *inner)


CDAQ1 = Device(
    name="cDAQ1", product_type="cDAQ-9174", serial=0x01D0C0DE,
    category=ProductCategory.COMPACT_DAQ_CHASSIS, pfi_lines=2,
)  # fmt: skip

NI_9234 = Device(
    name="cDAQ1Mod1", product_type="NI 9234", serial=0x01D09234,
    category=ProductCategory.C_SERIES_MODULE, chassis="cDAQ1",
    inputs=AnalogInputs(
        count=4, ranges_v=(5.0,), bits=24,
        rates=Rates(_NI_9234_RATE_HZ / _NI_9234_MAX_DIVISOR, _NI_9234_RATE_HZ, _NI_9234_RATE_HZ),
        couplings=(Coupling.AC, Coupling.DC), iepe_currents_a=(0.002,),
        terminals=(TerminalConfiguration.PSEUDO_DIFF,), untimed=SampleTimingType.SAMPLE_CLOCK,
    ),
)  # fmt: skip

USB_4431 = Device(
    name="Dev1", product_type="USB-4431", serial=0x01D04431,
    category=ProductCategory.DSA, pfi_lines=8,
    inputs=AnalogInputs(
        count=4, ranges_v=(10.0,), bits=24, rates=Rates(1000.0, 102.4e3),
        couplings=(Coupling.AC, Coupling.DC), iepe_currents_a=(0.0021,),
        terminals=(TerminalConfiguration.PSEUDO_DIFF,), untimed=SampleTimingType.SAMPLE_CLOCK,
        detects_overloads=True,
    ),
    outputs=AnalogOutputs(
        count=1, range_v=3.5, rates=Rates(1000.0, 96e3), idle=AOIdleOutputBehavior.ZERO_VOLTS,
        untimed=SampleTimingType.SAMPLE_CLOCK, memory=1023,
    ),
)  # fmt: skip

_M_SERIES_RATES = Rates(_M_SERIES_TIMEBASE_HZ / 2**32, 250e3, _M_SERIES_TIMEBASE_HZ)
USB_6211 = Device(
    name="Dev2", product_type="USB-6211", serial=0x01D06211,
    category=ProductCategory.M_SERIES_DAQ, pfi_lines=8,
    inputs=AnalogInputs(
        count=16, ranges_v=(0.2, 1.0, 5.0, 10.0), bits=16,
        rates=_M_SERIES_RATES,
        couplings=(Coupling.DC,), iepe_currents_a=(),
        terminals=(TerminalConfiguration.DIFF, TerminalConfiguration.RSE, TerminalConfiguration.NRSE),
        untimed=SampleTimingType.ON_DEMAND, is_multiplexed=True,
    ),
    outputs=AnalogOutputs(
        count=2, range_v=10.0, idle=AOIdleOutputBehavior.MAINTAIN_EXISTING_VALUE,
        untimed=SampleTimingType.ON_DEMAND, memory=8191,
        rates=_M_SERIES_RATES,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Catalogue:
    """The devices of a system by name (DAQmx ignores case)."""

    devices: tuple[Device, ...] = (CDAQ1, NI_9234, USB_4431, USB_6211)

    def device(self, name: str) -> Device:
        """Return a device by its name or the name of one of its channels (-200220 if unknown)."""
        wanted = name.strip("/").partition("/")[0].lower()
        for device in self.devices:
            if device.name.lower() == wanted:
                return device
        known = ", ".join(device.name for device in self.devices)
        raise DaqmxRefusal(DAQmxErrors.INVALID_DEVICE_ID, f"Device Specified: {name}\nDevices: {known}")

    def physical(
        self, names: str, side: Callable[[Device], tuple[str, ...]]
    ) -> tuple[tuple[str, Device], ...]:
        """Return the channels in a list of names and ranges, as their devices spell them, with the devices.

        ``side`` returns the inputs or the outputs of a device. Unknown names: -200220, -200170 or -200096.
        """
        found, prefix = [], ""
        for given in expand(names):
            # A name without a device belongs to the device of the previous name: ``"Dev1/ai0, ai2"``.
            if "/" in given.strip("/"):
                prefix, name = given.rpartition("/")[0], given
            else:
                name = f"{prefix}/{given}" if prefix else given
            device = self.device(name)
            known = {each.lower(): each for each in (*device.input_names, *device.output_names)}
            if name.lower() not in known:
                detail = f"Physical Channel: {name}\nPhysical Channels: {', '.join(known.values()) or 'none'}"
                raise DaqmxRefusal(DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST, detail)
            if known[name.lower()] not in side(device):
                raise DaqmxRefusal(DAQmxErrors.INVALID_PHYS_CHAN_TYPE, f"Physical Channel: {name}")
            found.append((known[name.lower()], device))
        if not found:
            raise DaqmxRefusal(DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST, "No physical channel was given.")
        return tuple(found)


def expand(text: str) -> tuple[str, ...]:
    """Return all names in a list of names and ranges, in order (-200498 for an invalid range).

    ``"Dev1/ai0:2"`` and ``"Dev1/ai0:Dev1/ai2"`` both give three names; ``"ai2:0"`` counts down.
    """
    try:
        return tuple(unflatten_channel_string(text))
    except DaqError as error:
        raise DaqmxRefusal(error.error_code, f"Channels: {text}") from None


def catalogue_with(product_type: str, name: str) -> Catalogue:
    """Return the default system, with the device of type ``product_type`` renamed to ``name``.

    Raises ConfigurationError if the type is unknown, or if another device already has this name.
    """
    devices = Catalogue().devices
    old = next((device for device in devices if device.product_type == product_type), None)
    if old is None:
        known = ", ".join(device.product_type for device in devices)
        raise ConfigurationError(
            f"The simulated DAQ has no device type {product_type!r}; "
            f"nothing was started. Choose one of {known}"
        )
    if any(device.name.lower() == name.lower() and device is not old for device in devices):
        raise ConfigurationError(
            f"The simulated {product_type} cannot be called {name!r}: another device has this name; "
            "nothing was started. Choose another name"
        )

    def rename(text: str) -> str:
        return name if text == old.name else text

    return Catalogue(
        tuple(replace(each, name=rename(each.name), chassis=rename(each.chassis)) for each in devices)
    )


_SLACK = 1 + 1e-9
"""Relative tolerance for the limits of a channel, which may have rounding errors."""


@dataclass
class _VoltageChannel:
    """Configuration of one voltage input or output of a task."""

    name: str
    physical: str
    device: Device
    minimum: float
    maximum: float


@dataclass
class InputChannel(_VoltageChannel):
    """Configuration of one voltage input."""

    terminal: TerminalConfiguration = TerminalConfiguration.DEFAULT
    coupling: Coupling | None = None
    """Input coupling; None for the device's default (AC with excitation, DC without)."""
    excitation: ExcitationSource = ExcitationSource.NONE
    excitation_a: float = 0.0

    @property
    def side(self) -> AnalogInputs:
        """Capabilities of the device's inputs."""
        assert self.device.inputs is not None
        return self.device.inputs

    @property
    def iepe_current_a(self) -> float:
        """Excitation current of the sensor [A]."""
        return self.excitation_a if self.excitation is ExcitationSource.INTERNAL else 0.0

    @property
    def actual_coupling(self) -> Coupling:
        """Coupling that the input actually has."""
        if self.coupling is not None:
            return self.coupling
        wants = Coupling.AC if self.iepe_current_a else Coupling.DC
        return wants if wants in self.side.couplings else self.side.couplings[0]

    @property
    def range_v(self) -> float:
        """Smallest full scale that covers the expected values [V]; NaN if no full scale covers them."""
        wanted_v = max(abs(self.minimum), abs(self.maximum))
        return next((each for each in self.side.ranges_v if wanted_v <= each * _SLACK), float("nan"))

    @property
    def volts_per_count(self) -> float:
        """Quantisation step of the input [V]."""
        return float(self.range_v / 2 ** (self.side.bits - 1))

    @property
    def raw_bits(self) -> int:
        """Number of bits of an unscaled sample when it is transferred."""
        return 16 if self.side.bits <= 16 else 32

    def verify(self) -> None:
        """Refuse settings that the device does not support: range, terminal, coupling, excitation."""
        inputs, where = self.side, f"on {self.physical}"
        if self.minimum >= self.maximum:
            raise unsupported_value("AI_Min", self.minimum, f"below AI_Max = {self.maximum:g}")
        if not np.isfinite(self.range_v):
            raise unsupported_value("AI_Max", self.maximum, f"up to {inputs.ranges_v[-1]:g} {where}")
        if self.terminal not in (TerminalConfiguration.DEFAULT, *inputs.terminals):
            allowed = ", ".join(terminal.name for terminal in inputs.terminals)
            raise unsupported_value("AI_TermCfg", self.terminal.name, f"{allowed} {where}")
        if self.actual_coupling not in inputs.couplings:
            raise unsupported_value("AI_Coupling", self.actual_coupling, ", ".join(inputs.couplings))
        if self.iepe_current_a not in (0.0, *inputs.iepe_currents_a):
            allowed = ", ".join(f"{current:g}" for current in (0.0, *inputs.iepe_currents_a))
            raise unsupported_value("AI_Excit_Val", self.iepe_current_a, f"{allowed} A {where}")
        if self.iepe_current_a and self.actual_coupling is not Coupling.AC:
            raise unsupported_value("AI_Coupling", self.actual_coupling, "AC while IEPE excitation is on")

    def wiring(self) -> Input:
        """Return the configuration of the input for the simulated analogue world."""
        return Input(self.physical, self.range_v, self.actual_coupling, self.iepe_current_a)


@dataclass
class OutputChannel(_VoltageChannel):
    """Configuration of one voltage output."""

    @property
    def side(self) -> AnalogOutputs:
        """Capabilities of the device's outputs."""
        assert self.device.outputs is not None
        return self.device.outputs

    def verify(self) -> None:
        """Refuse limits beyond the voltages that the device can output."""
        if self.minimum >= self.maximum:
            raise unsupported_value("AO_Min", self.minimum, f"below AO_Max = {self.maximum:g}")
        range_v = self.side.range_v
        for name, value in (("AO_Min", self.minimum), ("AO_Max", self.maximum)):
            if abs(value) > range_v * _SLACK:
                raise unsupported_value(name, value, f"-{range_v:g} to {range_v:g} V on {self.physical}")

    def check(self, volts: NDArray[np.float64]) -> None:
        """Refuse samples beyond the channel's limits, because DAQmx does not clip."""
        slack_v = (_SLACK - 1) * self.maximum
        too_low, too_high = volts < self.minimum - slack_v, volts > self.maximum + slack_v
        if np.any(too_low | too_high):
            extreme = volts.min() if np.any(too_low) else volts.max()
            allowed = f"Allowed: {self.minimum:g} to {self.maximum:g}"
            detail = f"Channel: {self.name}\nRequested Value: {extreme:g}\n{allowed}"
            raise DaqmxRefusal(DAQmxErrors.INVALID_AO_DATA_WRITE, detail, samples_written=0)


Channel = InputChannel | OutputChannel


def channel_names(given: str, physical: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of virtual channels: the given names or, by default, the physical names.

    ``given`` is a list or range with one name per channel, or a single name, to which numbers are added.
    """
    if not given:
        return physical
    names = expand(given)
    if len(names) == len(physical):
        return names
    return tuple(f"{given}{number}" for number in range(len(physical)))
