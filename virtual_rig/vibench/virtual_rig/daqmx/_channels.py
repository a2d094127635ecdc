"""The channels of a simulated DAQmx task: what is converted, how, and in which unit it is handed over."""

from dataclasses import dataclass, field

import numpy as np
from nidaqmx.constants import (
    AccelSensitivityUnits,
    AccelUnits,
    ExcitationSource,
    ForceIEPESensorSensitivityUnits,
    ForceUnits,
    SoundPressureUnits,
    TerminalConfiguration,
    UsageTypeAI,
    VelocityIEPESensorSensitivityUnits,
    VelocityUnits,
    VoltageUnits,
)
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from ..analogue import Coupling, Input
from ._devices import AnalogInputs, AnalogOutputs, Device
from ._errors import DaqmxRefusal, unsupported_value
from ._scales import Scale

_STANDARD_GRAVITY = 9.80665
_INCH_M = 0.0254
_POUND_N = 4.4482216152605
_RANGE_SLACK = 1e-9
"""Limits computed from a sensitivity may miss the range by a rounding error."""

SI_PER_UNIT: dict[int, float] = {
    VoltageUnits.VOLTS.value: 1.0,
    AccelUnits.G.value: _STANDARD_GRAVITY,
    AccelUnits.METERS_PER_SECOND_SQUARED.value: 1.0,
    AccelUnits.INCHES_PER_SECOND_SQUARED.value: _INCH_M,
    VelocityUnits.METERS_PER_SECOND.value: 1.0,
    VelocityUnits.INCHES_PER_SECOND.value: _INCH_M,
    ForceUnits.NEWTONS.value: 1.0,
    ForceUnits.POUNDS.value: _POUND_N,
    ForceUnits.KILOGRAM_FORCE.value: _STANDARD_GRAVITY,
    SoundPressureUnits.PA.value: 1.0,
}
"""How much one unit of a channel is in SI."""

UNIT_NAMES: dict[int, str] = {
    VoltageUnits.VOLTS.value: "Volts",
    AccelUnits.G.value: "g",
    AccelUnits.METERS_PER_SECOND_SQUARED.value: "m/s^2",
    AccelUnits.INCHES_PER_SECOND_SQUARED.value: "in/s^2",
    VelocityUnits.METERS_PER_SECOND.value: "m/s",
    VelocityUnits.INCHES_PER_SECOND.value: "in/s",
    ForceUnits.NEWTONS.value: "Newtons",
    ForceUnits.POUNDS.value: "Pounds",
    ForceUnits.KILOGRAM_FORCE.value: "kgf",
    SoundPressureUnits.PA.value: "Pascals",
}
"""What waveforms and files call them."""

VOLTS_PER_SI: dict[int, float] = {
    AccelSensitivityUnits.MILLIVOLTS_PER_G.value: 1e-3 / _STANDARD_GRAVITY,
    AccelSensitivityUnits.VOLTS_PER_G.value: 1 / _STANDARD_GRAVITY,
    VelocityIEPESensorSensitivityUnits.MILLIVOLTS_PER_MILLIMETER_PER_SECOND.value: 1.0,
    VelocityIEPESensorSensitivityUnits.MILLIVOLTS_PER_INCH_PER_SECOND.value: 1e-3 / _INCH_M,
    ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_NEWTON.value: 1e-3,
    ForceIEPESensorSensitivityUnits.MILLIVOLTS_PER_POUND.value: 1e-3 / _POUND_N,
}
"""What a sensitivity of 1 in that unit is, in volts per SI unit."""

MILLIVOLTS_PER_PASCAL = 0
"""A microphone's sensitivity has no unit of its own in DAQmx."""

_VOLTS_PER_MILLIVOLT = 1e-3


@dataclass
class Sensor:
    """What turns a quantity into the converter's volts."""

    sensitivity: float = 1.0
    sensitivity_units: int = VoltageUnits.VOLTS.value

    @property
    def volts_per_si(self) -> float:
        """Volts per SI unit of what is sensed."""
        if self.sensitivity_units == MILLIVOLTS_PER_PASCAL:
            return self.sensitivity * _VOLTS_PER_MILLIVOLT
        return self.sensitivity * VOLTS_PER_SI.get(self.sensitivity_units, 1.0)


@dataclass
class InputChannel:
    """One analogue input of a task, as configured so far."""

    name: str
    physical: str
    device: Device
    inputs: AnalogInputs
    measurement: UsageTypeAI
    units: int
    minimum: float
    maximum: float
    """Expected extremes, in ``units``."""
    terminal: TerminalConfiguration = TerminalConfiguration.DEFAULT
    coupling: Coupling | None = None
    """None: the device's default (AC under excitation, DC otherwise)."""
    excitation: ExcitationSource = ExcitationSource.NONE
    excitation_a: float = 0.0
    sensor: Sensor = field(default_factory=Sensor)
    scale: Scale | None = None
    description: str = ""

    @property
    def volts_per_unit(self) -> float:
        """Sensitivity in volts per channel unit."""
        return self.sensor.volts_per_si * SI_PER_UNIT.get(self.units, 1.0)

    @property
    def unit_name(self) -> str:
        """The unit in words."""
        return self.scale.scaled_units if self.scale else UNIT_NAMES.get(self.units, "")

    @property
    def iepe_current_a(self) -> float:
        """Current the device feeds into the sensor [A]."""
        return self.excitation_a if self.excitation is ExcitationSource.INTERNAL else 0.0

    @property
    def actual_coupling(self) -> Coupling:
        """The coupling in force."""
        if self.coupling is not None:
            return self.coupling
        wants = Coupling.AC if self.iepe_current_a else Coupling.DC
        return wants if wants in self.inputs.couplings else self.inputs.couplings[0]

    @property
    def actual_terminal(self) -> TerminalConfiguration:
        """The terminal configuration in force."""
        is_default = self.terminal is TerminalConfiguration.DEFAULT
        return self.inputs.terminals[0] if is_default else self.terminal

    @property
    def range_v(self) -> float:
        """Smallest full scale of the device that holds the expected extremes [V]."""
        return next(
            (r for r in self.inputs.ranges_v if self._wanted_v <= r * (1 + _RANGE_SLACK)), float("nan")
        )

    @property
    def _wanted_v(self) -> float:
        return float(np.max(np.abs(self.to_volts(np.array([self.minimum, self.maximum])))))

    @property
    def volts_per_count(self) -> float:
        """One step of the converter [V]."""
        return float(self.range_v / 2 ** (self.inputs.bits - 1))

    def verify(self) -> None:
        """Refuse what the device cannot do: range, terminal, coupling, excitation."""
        if self.minimum >= self.maximum:
            raise unsupported_value("AI_Min", self.minimum, f"below AI_Max = {self.maximum:g}")
        if not np.isfinite(self.range_v):
            raise unsupported_value("AI_Max", self.maximum, f"up to {self._limit:g} on {self.physical}")
        if self.actual_terminal not in self.inputs.terminals:
            allowed = ", ".join(terminal.name for terminal in self.inputs.terminals)
            raise unsupported_value("AI_TermCfg", self.terminal.name, f"{allowed} on {self.physical}")
        if self.actual_coupling not in self.inputs.couplings:
            raise unsupported_value("AI_Coupling", self.actual_coupling, ", ".join(self.inputs.couplings))
        self._verify_excitation()

    def _verify_excitation(self) -> None:
        if self.iepe_current_a == 0.0:
            return
        if self.iepe_current_a not in self.inputs.iepe_currents_a:
            allowed = ", ".join(f"{current:g}" for current in (0.0, *self.inputs.iepe_currents_a))
            raise unsupported_value("AI_Excit_Val", self.iepe_current_a, f"{allowed} A on {self.physical}")
        if self.actual_coupling is not Coupling.AC:
            raise unsupported_value("AI_Coupling", self.actual_coupling, "AC while IEPE excitation is on")

    @property
    def _limit(self) -> float:
        largest = np.array([self.inputs.ranges_v[-1]])
        return float(self.scale.forward(largest)[0] if self.scale else largest[0] / self.volts_per_unit)

    def to_units(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Volts at the converter as the channel hands them over."""
        if self.scale is not None:
            return self.scale.forward(volts)
        return volts if self.volts_per_unit == 1.0 else volts / self.volts_per_unit

    def to_volts(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values in the channel's units as volts at the converter."""
        return self.scale.inverse(values) if self.scale else values * self.volts_per_unit

    def wiring(self) -> Input:
        """Describe the channel to the analogue world."""
        return Input(self.physical, self.range_v, self.actual_coupling, self.iepe_current_a)


@dataclass
class OutputChannel:
    """One analogue output of a task."""

    name: str
    physical: str
    device: Device
    outputs: AnalogOutputs
    minimum: float
    maximum: float
    """Expected extremes, in volts, or in the scale's unit."""
    units: int = VoltageUnits.VOLTS.value
    scale: Scale | None = None
    description: str = ""

    @property
    def volts_per_count(self) -> float:
        """One step of the converter [V]."""
        return float(self.outputs.range_v / 2 ** (self.outputs.bits - 1))

    def verify(self) -> None:
        """Refuse extremes that the device cannot deliver."""
        if self.minimum >= self.maximum:
            raise unsupported_value("AO_Min", self.minimum, f"below AO_Max = {self.maximum:g}")
        for name, value in (("AO_Min", self.minimum), ("AO_Max", self.maximum)):
            if abs(float(self.to_volts(np.array([value]))[0])) > self.outputs.range_v * (1 + _RANGE_SLACK):
                limit = f"-{self.outputs.range_v:g} to {self.outputs.range_v:g} V on {self.physical}"
                raise unsupported_value(name, value, limit)

    def to_volts(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Written values as volts at the terminal."""
        return self.scale.inverse(values) if self.scale else values

    def check(self, values: NDArray[np.float64]) -> None:
        """Refuse samples beyond the channel's extremes: DAQmx does not clip."""
        slack = _RANGE_SLACK * self.maximum
        if values.size and (values.min() < self.minimum - slack or values.max() > self.maximum + slack):
            extreme = values.min() if values.min() < self.minimum - slack else values.max()
            allowed = f"Allowed: {self.minimum:g} to {self.maximum:g}"
            detail = f"Channel: {self.name}\nRequested Value: {extreme:g}\n{allowed}"
            raise DaqmxRefusal(DAQmxErrors.INVALID_AO_DATA_WRITE, detail, samples_written=0)


Channel = InputChannel | OutputChannel
