"""A channel from its sensor to its file: which quantity, which unit, how many volts per unit."""

from dataclasses import dataclass
from datetime import date

from ._configuration import ChannelConfig, Rig, Role
from ._sensors import sensor_of


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
