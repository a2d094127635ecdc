"""What a program can ask and set about the channels of a task."""

from collections.abc import Callable
from typing import Any

from nidaqmx.constants import (
    AOIdleOutputBehavior,
    ChannelType,
    Coupling as WireCoupling,
    DataJustification,
    ExcitationDCorAC,
    ExcitationSource,
    ExcitationVoltageOrCurrent,
    RawDataCompressionType,
    ResolutionType,
    TerminalConfiguration,
    UsageTypeAO,
)

from ..analogue import Coupling
from ._attributes import Attribute, AttributeGroup, Attributes
from ._channels import Channel, InputChannel, OutputChannel
from ._devices import Idle
from ._errors import unsupported_value

_COUPLINGS = {Coupling.AC: WireCoupling.AC, Coupling.DC: WireCoupling.DC}
_IDLE = {Idle.ZERO: AOIdleOutputBehavior.ZERO_VOLTS, Idle.HOLD: AOIdleOutputBehavior.MAINTAIN_EXISTING_VALUE}
_SHORT_BITS, _LONG_BITS = 16, 32


def _writes(field: str, convert: Callable[[Any], object] = lambda value: value) -> Callable[[Any, Any], None]:
    def write(channel: object, value: object) -> None:
        setattr(channel, field, convert(value))

    return write


def _coupling(code: int) -> Coupling:
    by_code = {wire.value: coupling for coupling, wire in _COUPLINGS.items()}
    if code not in by_code:
        raise unsupported_value("AI_Coupling", code, "AC, DC")
    return by_code[code]


def _set_sensitivity(channel: InputChannel, sensitivity: float) -> None:
    if sensitivity == 0:
        raise unsupported_value("sensitivity", sensitivity, "anything but 0")
    channel.sensor.sensitivity = sensitivity


def _set_sensitivity_units(channel: InputChannel, units: int) -> None:
    channel.sensor.sensitivity_units = units


def _raw_bits(bits: int) -> int:
    return _SHORT_BITS if bits <= _SHORT_BITS else _LONG_BITS


_EITHER: Attributes[Any] = {
    "PHYSICAL_CHAN_NAME": Attribute(lambda channel: channel.physical),
    "CHAN_DESCR": Attribute(lambda channel: channel.description, _writes("description"), initial=""),
    "CHAN_IS_GLOBAL": Attribute(lambda _: False),
}

_UNITS = Attribute[InputChannel](lambda channel: channel.units, _writes("units"))
_SENSITIVITY = Attribute[InputChannel](lambda channel: channel.sensor.sensitivity, _set_sensitivity)
_SENSITIVITY_UNITS = Attribute[InputChannel](
    lambda channel: channel.sensor.sensitivity_units, _set_sensitivity_units
)

INPUT_CHANNEL = AttributeGroup[InputChannel](
    "Channel",
    {
        **_EITHER,
        "CHAN_TYPE": Attribute(lambda _: ChannelType.ANALOG_INPUT),
        "AI_MEAS_TYPE": Attribute(lambda channel: channel.measurement),
        "AI_MAX": Attribute(lambda channel: channel.maximum, _writes("maximum")),
        "AI_MIN": Attribute(lambda channel: channel.minimum, _writes("minimum")),
        "AI_RNG_HIGH": Attribute(lambda channel: channel.range_v),
        "AI_RNG_LOW": Attribute(lambda channel: -channel.range_v),
        "AI_COUPLING": Attribute(
            lambda channel: _COUPLINGS[channel.actual_coupling], _writes("coupling", _coupling)
        ),
        "AI_TERM_CFG": Attribute(
            lambda channel: channel.actual_terminal, _writes("terminal", TerminalConfiguration), initial=-1
        ),
        "AI_EXCIT_SRC": Attribute(
            lambda channel: channel.excitation, _writes("excitation", ExcitationSource)
        ),
        "AI_EXCIT_VAL": Attribute(lambda channel: channel.excitation_a, _writes("excitation_a")),
        "AI_EXCIT_ACTUAL_VAL": Attribute(lambda channel: channel.iepe_current_a),
        "AI_EXCIT_VOLTAGE_OR_CURRENT": Attribute(
            lambda _: ExcitationVoltageOrCurrent.USE_CURRENT, lambda _, code: _require_current(code)
        ),
        "AI_EXCIT_D_COR_AC": Attribute(lambda _: ExcitationDCorAC.USE_DC),
        "AI_RESOLUTION": Attribute(lambda channel: float(channel.inputs.bits)),
        "AI_RESOLUTION_UNITS": Attribute(lambda _: ResolutionType.BITS),
        "AI_RAW_SAMP_SIZE": Attribute(lambda channel: _raw_bits(channel.inputs.bits)),
        "AI_RAW_SAMP_JUSTIFICATION": Attribute(lambda _: DataJustification.RIGHT),
        "AI_RAW_DATA_COMPRESSION_TYPE": Attribute(lambda _: RawDataCompressionType.NONE),
        "AI_DEV_SCALING_COEFF": Attribute(lambda channel: [0.0, channel.volts_per_count, 0.0, 0.0]),
        "AI_GAIN": Attribute(lambda channel: channel.inputs.ranges_v[-1] / channel.range_v),
        "AI_CUSTOM_SCALE_NAME": Attribute(lambda channel: channel.scale.name if channel.scale else ""),
        "AI_IS_TEDS": Attribute(lambda _: False),
        "AI_INPUT_SRC": Attribute(lambda channel: channel.physical),
        "AI_VOLTAGE_UNITS": _UNITS,
        "AI_ACCEL_UNITS": _UNITS,
        "AI_ACCEL_SENSITIVITY": _SENSITIVITY,
        "AI_ACCEL_SENSITIVITY_UNITS": _SENSITIVITY_UNITS,
        "AI_VELOCITY_UNITS": _UNITS,
        "AI_VELOCITY_IEPE_SENSOR_SENSITIVITY": _SENSITIVITY,
        "AI_VELOCITY_IEPE_SENSOR_SENSITIVITY_UNITS": _SENSITIVITY_UNITS,
        "AI_FORCE_UNITS": _UNITS,
        "AI_FORCE_IEPE_SENSOR_SENSITIVITY": _SENSITIVITY,
        "AI_FORCE_IEPE_SENSOR_SENSITIVITY_UNITS": _SENSITIVITY_UNITS,
        "AI_SOUND_PRESSURE_UNITS": _UNITS,
        "AI_MICROPHONE_SENSITIVITY": _SENSITIVITY,
    },
)


def _require_current(code: int) -> None:
    if code != ExcitationVoltageOrCurrent.USE_CURRENT.value:
        raise unsupported_value("AI_Excit_VoltageOrCurrent", code, "USE_CURRENT")


def _require_idle(channel: OutputChannel, code: int) -> None:
    allowed = _IDLE[channel.outputs.idle]
    if code != allowed.value:
        raise unsupported_value("AO_IdleOutputBehavior", code, f"{allowed.name} on {channel.physical}")


OUTPUT_CHANNEL = AttributeGroup[OutputChannel](
    "Channel",
    {
        **_EITHER,
        "CHAN_TYPE": Attribute(lambda _: ChannelType.ANALOG_OUTPUT),
        "AO_OUTPUT_TYPE": Attribute(lambda _: UsageTypeAO.VOLTAGE),
        "AO_MAX": Attribute(lambda channel: channel.maximum, _writes("maximum")),
        "AO_MIN": Attribute(lambda channel: channel.minimum, _writes("minimum")),
        "AO_DAC_RNG_HIGH": Attribute(lambda channel: channel.outputs.range_v),
        "AO_DAC_RNG_LOW": Attribute(lambda channel: -channel.outputs.range_v),
        "AO_VOLTAGE_UNITS": Attribute(lambda channel: channel.units),
        "AO_TERM_CFG": Attribute(lambda channel: channel.outputs.terminal),
        "AO_IDLE_OUTPUT_BEHAVIOR": Attribute(lambda channel: _IDLE[channel.outputs.idle], _require_idle),
        "AO_RESOLUTION": Attribute(lambda channel: float(channel.outputs.bits)),
        "AO_RESOLUTION_UNITS": Attribute(lambda _: ResolutionType.BITS),
        "AO_DEV_SCALING_COEFF": Attribute(lambda channel: [0.0, 1 / channel.volts_per_count, 0.0, 0.0]),
        "AO_GAIN": Attribute(lambda _: 1.0),
        "AO_CUSTOM_SCALE_NAME": Attribute(lambda channel: channel.scale.name if channel.scale else ""),
    },
)


def get_attribute(channel: Channel, number: int) -> object:
    """Value of a channel's attribute."""
    match channel:
        case InputChannel():
            return INPUT_CHANNEL.get(channel, number)
        case OutputChannel():
            return OUTPUT_CHANNEL.get(channel, number)


def set_attribute(channel: Channel, number: int, value: object) -> None:
    """Write a channel's attribute."""
    match channel:
        case InputChannel():
            INPUT_CHANNEL.set(channel, number, value)
        case OutputChannel():
            OUTPUT_CHANNEL.set(channel, number, value)


def reset_attribute(channel: Channel, number: int) -> None:
    """Give a channel's attribute its first value again."""
    match channel:
        case InputChannel():
            INPUT_CHANNEL.reset(channel, number)
        case OutputChannel():
            OUTPUT_CHANNEL.reset(channel, number)
