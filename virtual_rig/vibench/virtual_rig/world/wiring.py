"""Cables and other connections of the converter's inputs."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum

from vibench.acquisition.rig import Rig, Role

SECOND_DEVICE = "Dev1"
"""Second converter of the virtual system, connected to the same cables by T-pieces."""


class Signal(IntEnum):
    """Rows of the world's signals; rows of further sensors follow in the order of the configuration."""

    DRIVE = 0
    AMPLIFIER = 1
    BASE_ACCELERATION = 2
    M0_VELOCITY = 3


class Coupling(StrEnum):
    """Coupling of a converter's input."""

    AC = "AC"
    DC = "DC"


@dataclass(frozen=True)
class Input:
    """Configuration of one converter input in a task."""

    physical_channel: str
    """Name of the input at the converter (``"cDAQ1Mod1/ai0"``), which the wiring maps to a signal."""
    range_v: float
    """Full scale of the input, plus and minus [V]."""
    coupling: Coupling
    iepe_current_a: float = 0.0
    """Excitation current of an IEPE sensor [A]; IEPE sensors give no signal without this current."""


class Behind(Enum):
    """Source at the far end of a cable."""

    VOLTAGE_SOURCE = "voltage source"
    IEPE_SENSOR = "IEPE sensor"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Cable:
    """Connection of one input of the converter."""

    behind: Behind
    signal: int = Signal.DRIVE
    attenuation: float = 1.0
    """Ratio of the voltage at the source to the voltage at the converter's input."""
    delay_steps: float = 0.0


OPEN_INPUT = Cable(Behind.NOTHING)


def signal_rows(rig: Rig) -> dict[Role, int]:
    """Return the row of the world's signals for each role of a rig."""
    fixed = (Role.DRIVE_VOLTAGE, Role.AMPLIFIER_VOLTAGE, Role.BASE_ACCELERATION, Role.M0_VELOCITY)
    return {role: row for row, role in enumerate((*fixed, *rig.sensors))}


def cables_of(rig: Rig, delay_steps: Mapping[Role, float]) -> dict[str, Cable]:
    """Return the cable of each connected input by its name, such as ``"cDAQ1Mod1/ai0"``."""
    rows = signal_rows(rig)
    return {
        f"{device}/{channel.physical}": Cable(
            behind=_source(rig, channel.role),
            signal=rows[channel.role],
            attenuation=channel.attenuation,
            delay_steps=delay_steps.get(channel.role, 0.0),
        )
        for device in (rig.daq.device, SECOND_DEVICE)
        for channel in rig.daq.channels
    }


def _source(rig: Rig, role: Role) -> Behind:
    sensor = rig.sensor(role)
    return Behind.IEPE_SENSOR if sensor is not None and sensor.iepe == "yes" else Behind.VOLTAGE_SOURCE
