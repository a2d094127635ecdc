"""Channels of a simulated DAQmx task: conversion, coupling and limits."""

from dataclasses import dataclass

import numpy as np
from nidaqmx.constants import ExcitationSource, TerminalConfiguration
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from ..world.wiring import Coupling, Input
from .devices import AnalogInputs, AnalogOutputs, Device, expand
from .errors import DaqmxRefusal, unsupported_value

_SLACK = 1 + 1e-9
"""Relative tolerance for limits of a channel, as these may have rounding errors."""


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
        """Smallest full scale that covers the expected values [V]; NaN if none does."""
        wanted_v = max(abs(self.minimum), abs(self.maximum))
        return next((each for each in self.side.ranges_v if wanted_v <= each * _SLACK), float("nan"))

    @property
    def volts_per_count(self) -> float:
        """Quantisation step of the input [V]."""
        return float(self.range_v / 2 ** (self.side.bits - 1))

    @property
    def raw_bits(self) -> int:
        """Number of bits of an unscaled sample in transfers."""
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
    """Return the names of virtual channels: the given names, or the physical names if none is given.

    ``given`` is a list or range with one name per channel, or one name to which numbers are added.
    """
    if not given:
        return physical
    names = expand(given)
    if len(names) == len(physical):
        return names
    return tuple(f"{given}{number}" for number in range(len(physical)))
