"""What is in front of an input: a wire, an accelerometer, a vibrometer, or the sensor of a plug-in."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from types import MappingProxyType
from typing import Protocol, cast

from ..errors import ConfigurationError
from ..instruments import PlugInKind, SensorFacts, driver_of
from ._configuration import ChannelConfig, Rig, Role


class Sensor(Protocol):
    """What an entry point of ``vibench.sensors`` is: it tells the facts, and may ask its instrument."""

    def __call__(self, rig: Rig, config: ChannelConfig, /) -> SensorFacts:
        """Give the facts of the sensor in front of an input."""


_USUAL: Mapping[Role, str] = MappingProxyType(
    {
        Role.DRIVE_VOLTAGE: "wire",
        Role.AMPLIFIER_VOLTAGE: "wire",
        Role.BASE_ACCELERATION: "accelerometer",
        Role.M0_VELOCITY: "vibrometer",
    }
)
_RECORDED: Mapping[Role, tuple[str, str]] = MappingProxyType(
    {
        Role.DRIVE_VOLTAGE: ("voltage", "V"),
        Role.AMPLIFIER_VOLTAGE: ("voltage", "V"),
        Role.BASE_ACCELERATION: ("acceleration", "m s-2"),
        Role.M0_VELOCITY: ("velocity", "m s-1"),
    }
)


def sensor_name(config: ChannelConfig) -> str:
    """Name the sensor in front of an input: the one that is given, or the usual one of its role."""
    return config.sensor or _USUAL[config.role]


def sensor_of(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Give the facts of the sensor in front of an input.

    Raises ConfigurationError when no package offers it, or it measures something else than the role records;
    BrokenPromise when it is somebody else's, and fails or tells what no sensor can be.
    """
    name = sensor_name(config)
    facts = cast("Sensor", driver_of(PlugInKind.SENSOR, name, Sensor))(rig, config)
    if (facts.quantity, facts.unit) != _RECORDED[config.role]:
        quantity, unit = _RECORDED[config.role]
        raise ConfigurationError(
            f"the sensor {name!r} of {config.physical} tells of {facts.quantity} in {facts.unit!r}, and "
            f"{config.role.value} records {quantity} in {unit!r}; give the channel another role or sensor"
        )
    return facts


def wire(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Volts as they are, behind the attenuation of the channel."""
    if config.role is Role.AMPLIFIER_VOLTAGE:
        return SensorFacts(
            "voltage", "V", 1.0, float("inf"), "amplifier output, by wire", rig.amplifier.serial
        )
    return SensorFacts("voltage", "V", 1.0, float("inf"), "the amplifier's input, by wire")


def accelerometer(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Give the accelerometer of the hardware configuration."""
    del config
    a = rig.accelerometer
    per_volt = 1 / a.sensitivity_v_per_m_per_s2
    return SensorFacts(
        "acceleration", "m s-2", per_volt, a.full_scale_v, a.model, a.serial, calibrated=a.calibrated
    )


def vibrometer(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Give the vibrometer of the hardware configuration."""
    del config
    v = rig.vibrometer
    per_volt, name = v.range_mm_per_s_per_v * 1e-3, f"{v.model} {v.decoder}"
    return SensorFacts("velocity", "m s-1", per_volt, v.full_scale_v, name, v.serial, v.delay_s, v.calibrated)


@dataclass(frozen=True)
class Channel:
    """One recorded quantity and everything needed to turn its volts into units."""

    role: Role
    physical: str
    """Full name at the converter: ``"cDAQ1Mod1/ai2"``."""
    quantity: str
    """``"voltage"``, ``"acceleration"`` or ``"velocity"``."""
    unit: str
    """UDUNITS text: ``"V"``, ``"m s-2"``, ``"m s-1"``."""
    units_per_volt: float
    """Physical units per volt at the converter's input."""
    full_scale_v: float
    """The smaller of what the sensor can put out and what the input can take [V]."""
    range_v: float
    coupling: str
    iepe_current_a: float
    sensor: str
    serial: str
    delay_s: float
    sensor_calibrated: date | None
    converter_calibrated: date


def channels_of(rig: Rig) -> tuple[Channel, ...]:
    """All channels of a rig, in the order of its configuration."""
    return tuple(_channel(rig, config) for config in rig.daq.channels)


def _channel(rig: Rig, config: ChannelConfig) -> Channel:
    sensor = sensor_of(rig, config)
    return Channel(
        role=config.role,
        physical=f"{rig.daq.device}/{config.physical}",
        quantity=sensor.quantity,
        unit=sensor.unit,
        units_per_volt=sensor.units_per_volt * config.attenuation,
        full_scale_v=min(config.range_v, sensor.full_scale_v / config.attenuation),
        range_v=config.range_v,
        coupling=config.coupling,
        iepe_current_a=config.iepe_current_a,
        sensor=sensor.name,
        serial=sensor.serial,
        delay_s=sensor.delay_s,
        sensor_calibrated=sensor.calibrated,
        converter_calibrated=config.calibrated,
    )
