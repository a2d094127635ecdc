"""Calls that add channels to a task of the simulated driver."""

from typing import Any

from nidaqmx.constants import (
    BridgeConfiguration,
    ExcitationSource,
    SoundPressureUnits,
    TerminalConfiguration,
    UsageTypeAI,
    VoltageUnits,
)
from nidaqmx.error_codes import DAQmxErrors

from ._calls import NOTHING, Call, Fields, pick
from ._channels import MILLIVOLTS_PER_PASCAL, InputChannel, OutputChannel, Sensor
from ._device_attributes import PhysicalChannel
from ._errors import DaqmxRefusal, member, unsupported_value
from ._names import assigned_names
from ._scales import Scale
from ._system import DaqmxSystem

_REFERENCE_PRESSURE_PA = 20e-6
"""0 dB of sound pressure."""


class ChannelCalls:
    """Calls that add inputs and outputs."""

    def __init__(self, system: DaqmxSystem) -> None:
        """Work on that system."""
        self._system = system

    def calls(self) -> dict[str, Call]:
        """Give the calls by their name in the protocol."""
        return {
            "CreateAIVoltageChan": self._voltage,
            "CreateAIVoltageChanWithExcit": self._voltage_with_excitation,
            "CreateAIAccelChan": self._accelerometer,
            "CreateAIVelocityIEPEChan": self._velocity,
            "CreateAIForceIEPEChan": self._force,
            "CreateAIMicrophoneChan": self._microphone,
            "CreateAOVoltageChan": self._output,
        }

    def _voltage(self, request: Any) -> Fields:
        limits = (request.min_val, request.max_val)
        return self._add_inputs(request, UsageTypeAI.VOLTAGE, Sensor(), limits)

    def _voltage_with_excitation(self, request: Any) -> Fields:
        bridge = pick(request, "bridge_config")
        if bridge != BridgeConfiguration.NO_BRIDGE.value or request.use_excit_for_scaling:
            raise unsupported_value("AI_Bridge_Cfg", bridge, "NO_BRIDGE, without scaling by the excitation")
        source = member(ExcitationSource, pick(request, "voltage_excit_source"), "AI_Excit_Src")
        if source is ExcitationSource.INTERNAL and request.voltage_excit_val:
            raise unsupported_value(
                "AI_Excit_Val", f"{request.voltage_excit_val:g} V", "0 V on these devices"
            )
        return self._voltage(request)

    def _accelerometer(self, request: Any) -> Fields:
        return self._sensor(request, UsageTypeAI.ACCELERATION_ACCELEROMETER_CURRENT_INPUT)

    def _velocity(self, request: Any) -> Fields:
        return self._sensor(request, UsageTypeAI.VELOCITY_IEPE_SENSOR)

    def _force(self, request: Any) -> Fields:
        return self._sensor(request, UsageTypeAI.FORCE_IEPE_SENSOR)

    def _sensor(self, request: Any, measurement: UsageTypeAI) -> Fields:
        sensor = Sensor(request.sensitivity, pick(request, "sensitivity_units"))
        if sensor.sensitivity == 0:
            raise unsupported_value("sensitivity", 0, "anything but 0")
        return self._add_inputs(
            request, measurement, sensor, (request.min_val, request.max_val), _excitation(request)
        )

    def _microphone(self, request: Any) -> Fields:
        if pick(request, "units") != SoundPressureUnits.PA.value:
            raise unsupported_value("AI_SoundPressure_Units", pick(request, "units"), "PA")
        largest_pa = _REFERENCE_PRESSURE_PA * 10 ** (request.max_snd_press_level / 20) * 2**0.5
        sensor = Sensor(request.mic_sensitivity, MILLIVOLTS_PER_PASCAL)
        kind = UsageTypeAI.SOUND_PRESSURE_MICROPHONE
        return self._add_inputs(request, kind, sensor, (-largest_pa, largest_pa), _excitation(request))

    def _add_inputs(
        self,
        request: Any,
        measurement: UsageTypeAI,
        sensor: Sensor,
        limits: tuple[float, float],
        excitation: tuple[ExcitationSource, float] = (ExcitationSource.NONE, 0.0),
    ) -> Fields:
        task = self._system.task(request.task.name)
        places = self._system.inputs(request.physical_channel)
        source, current_a = excitation
        for place, name in _named(request, places):
            inputs = place.device.inputs
            if inputs is None or measurement not in inputs.measurements:
                detail = f"Physical Channel: {place.name}\nMeasurement: {measurement.name}"
                raise DaqmxRefusal(DAQmxErrors.PHYS_CHAN_MEAS_TYPE, detail)
            channel = InputChannel(
                name, place.name, place.device, inputs, measurement, pick(request, "units"), *limits,
                terminal=member(TerminalConfiguration, pick(request, "terminal_config"), "AI_TermCfg"),
                excitation=source, excitation_a=current_a,
                sensor=Sensor(sensor.sensitivity, sensor.sensitivity_units), scale=self._scale(request),
            )  # fmt: skip
            task.add(channel)
        return NOTHING

    def _output(self, request: Any) -> Fields:
        task = self._system.task(request.task.name)
        for place, name in _named(request, self._system.outputs(request.physical_channel)):
            outputs = place.device.outputs
            assert outputs is not None
            channel = OutputChannel(
                name, place.name, place.device, outputs, request.min_val, request.max_val,
                units=pick(request, "units"), scale=self._scale(request),
            )  # fmt: skip
            task.add(channel)
        return NOTHING

    def _scale(self, request: Any) -> Scale | None:
        if pick(request, "units") != VoltageUnits.FROM_CUSTOM_SCALE.value:
            return None
        return self._system.scale(request.custom_scale_name)


def _excitation(request: Any) -> tuple[ExcitationSource, float]:
    source = member(ExcitationSource, pick(request, "current_excit_source"), "AI_Excit_Src")
    return source, request.current_excit_val


def _named(request: Any, places: tuple[PhysicalChannel, ...]) -> list[tuple[PhysicalChannel, str]]:
    names = assigned_names(request.name_to_assign_to_channel, tuple(place.name for place in places))
    return list(zip(places, names, strict=True))
