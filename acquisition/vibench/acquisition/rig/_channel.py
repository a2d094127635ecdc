"""A channel from its sensor to its file: which quantity, which unit, how many volts per unit."""

from dataclasses import dataclass
from datetime import date

from ._configuration import ChannelConfig, Rig, Role


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
    quantity, unit, per_volt, full_scale_v, sensor, serial, delay_s, calibrated = _sensor(rig, config.role)
    return Channel(
        role=config.role,
        physical=f"{rig.daq.device}/{config.physical}",
        quantity=quantity,
        unit=unit,
        units_per_volt=per_volt * config.attenuation,
        full_scale_v=min(config.range_v, full_scale_v / config.attenuation),
        range_v=config.range_v,
        coupling=config.coupling,
        iepe_current_a=config.iepe_current_a,
        sensor=sensor,
        serial=serial,
        delay_s=delay_s,
        sensor_calibrated=calibrated,
        converter_calibrated=config.calibrated,
    )


def _sensor(rig: Rig, role: Role) -> tuple[str, str, float, float, str, str, float, date | None]:
    match role:
        case Role.DRIVE_VOLTAGE:
            wire = "the amplifier's input, by wire"
            return "voltage", "V", 1.0, float("inf"), wire, "", 0.0, None
        case Role.AMPLIFIER_VOLTAGE:
            wire = "amplifier output, by wire"
            return "voltage", "V", 1.0, float("inf"), wire, rig.amplifier.serial, 0.0, None
        case Role.BASE_ACCELERATION:
            a = rig.accelerometer
            per_volt = 1 / a.sensitivity_v_per_m_per_s2
            return "acceleration", "m s-2", per_volt, a.full_scale_v, a.model, a.serial, 0.0, a.calibrated
        case Role.M0_VELOCITY:
            v = rig.vibrometer
            per_volt = v.range_mm_per_s_per_v * 1e-3
            name = f"{v.model} {v.decoder}"
            return "velocity", "m s-1", per_volt, v.full_scale_v, name, v.serial, v.delay_s, v.calibrated
