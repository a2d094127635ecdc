"""Connections of the converter's inputs."""

from dataclasses import dataclass
from enum import Enum, IntEnum

from vibench.acquisition.rig import Rig, Role

SECOND_DEVICE = "Dev1"
"""The second converter of the virtual system, connected to the same cables by T-pieces."""
_USUAL_OUTPUT = f"{SECOND_DEVICE}/ao0"


class Signal(IntEnum):
    """Row of the world's signals."""

    DRIVE = 0
    AMPLIFIER = 1
    BASE_ACCELERATION = 2
    M0_VELOCITY = 3


class Behind(Enum):
    """Source at the far end of a cable."""

    VOLTAGE_SOURCE = "voltage source"
    IEPE_SENSOR = "IEPE sensor"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Cable:
    """Connection of one input of the converter."""

    behind: Behind
    signal: Signal = Signal.DRIVE
    attenuation: float = 1.0
    """Volts at the source per volt at the input."""
    delay_steps: float = 0.0


OPEN_INPUT = Cable(Behind.NOTHING)

_SIGNAL_OF_ROLE = {
    Role.DRIVE_VOLTAGE: Signal.DRIVE,
    Role.AMPLIFIER_VOLTAGE: Signal.AMPLIFIER,
    Role.BASE_ACCELERATION: Signal.BASE_ACCELERATION,
    Role.M0_VELOCITY: Signal.M0_VELOCITY,
}


def amplifier_input(rig: Rig) -> str:
    """Return the analogue output whose voltage is added to the generator's at the amplifier's input."""
    return rig.daq.output_channel or _USUAL_OUTPUT


def cables_of(rig: Rig, vibrometer_delay_steps: float) -> dict[str, Cable]:
    """Return every connected input by its physical name, ``"cDAQ1Mod1/ai0"``."""
    delays = {Role.M0_VELOCITY: vibrometer_delay_steps}
    sensors = {Role.BASE_ACCELERATION: _accelerometer(rig)}
    return {
        f"{device}/{channel.physical}": Cable(
            behind=sensors.get(channel.role, Behind.VOLTAGE_SOURCE),
            signal=_SIGNAL_OF_ROLE[channel.role],
            attenuation=channel.attenuation,
            delay_steps=delays.get(channel.role, 0.0),
        )
        for device in (rig.daq.device, SECOND_DEVICE)
        for channel in rig.daq.channels
    }


def _accelerometer(rig: Rig) -> Behind:
    return Behind.IEPE_SENSOR if rig.accelerometer.iepe == "yes" else Behind.VOLTAGE_SOURCE
