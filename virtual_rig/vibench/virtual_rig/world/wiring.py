"""Which cable ends at which input of the converter."""

from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import NamedTuple

import numpy as np

from vibench.acquisition.rig import Rig, Role
from vibench.sim.engine.run import native_engine
from vibench.sim.shaker.loaded_shaker import LoadedShaker, ShakenMotion

from ..controller.virtual_controller import VirtualController
from .sensors import SensorParts
from .time_grid import FloatArray

SECOND_DEVICE = "Dev1"
"""The second converter of the virtual system: the same cables end at it, by way of T-pieces."""
_USUAL_OUTPUT = f"{SECOND_DEVICE}/ao0"


class Signal(IntEnum):
    """Row of the world's signals."""

    DRIVE = 0
    AMPLIFIER = 1
    BASE_ACCELERATION = 2
    M0_VELOCITY = 3


class Behind(Enum):
    """What sits at the far end of a cable."""

    VOLTAGE_SOURCE = "voltage source"
    IEPE_SENSOR = "IEPE sensor"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Cable:
    """What one input of the converter is connected to."""

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
    """Name the analogue output whose voltage is added to the generator's at the amplifier's input."""
    return rig.daq.output_channel or _USUAL_OUTPUT


def cables_of(rig: Rig, vibrometer_delay_steps: float) -> dict[str, Cable]:
    """Every connected input by its physical name, ``"cDAQ1Mod1/ai0"``."""
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


class _LoopEnd(IntEnum):
    """How the engine ends a call; `LoopEnd` in native/world.hpp."""

    COMPLETE = 0
    NEEDS_ATTENTION = 1
    MOTION_LOST = 2


class PlantParts(NamedTuple):
    """Everything between the voltage at the amplifier and the volts of both sensors, over a stretch."""

    shaker: LoadedShaker
    noise: FloatArray
    """Of the amplifier [V], shape (steps,)."""
    base: SensorParts
    m0: SensorParts


class LoopCables:
    """Hands a controller its samples, on a grid since the world began, and plays its volts.

    While it is silent the world does not stop for it.
    """

    def __init__(self, loop: VirtualController) -> None:
        self._loop = loop
        engine, steps = native_engine(), loop.steps_per_sample
        self._late = np.zeros(loop.latency_steps + steps)
        self._cables = engine.new("LoopCables", late=self._late, steps_per_sample=steps)

    @property
    def is_on(self) -> bool:
        """Whether the controller plays, or volts are still on their way."""
        return self._loop.is_on or bool(self._late.any())

    def move(
        self, first: int, step_s: float, plant: PlantParts, motion: ShakenMotion, signals: FloatArray
    ) -> int:
        """Move the plant from a step of the world on, the loop closed; gives the steps done.

        ``signals`` holds at first what else drives the amplifier, and at last all that there was.
        """
        cables, drive = self._cables, signals[Signal.DRIVE]
        cables["first"], cables["begin"] = first, 0
        base = plant.base.showing(motion.base_acceleration, signals[Signal.BASE_ACCELERATION])
        m0 = plant.m0.showing(motion.m0_velocity, signals[Signal.M0_VELOCITY])
        plant.shaker.prepare(motion, drive, plant.noise)
        native_engine().fill(cables, shaker=plant.shaker.structure.ctypes.data, drive=drive, base=base, m0=m0)
        done, end = 0, _LoopEnd.COMPLETE
        while end is not _LoopEnd.MOTION_LOST and done < drive.size:
            with self._loop.answering() as loop:
                cables["controller"] = loop.ctypes.data
                end = _LoopEnd(native_engine().call("close_loop", cables))
                done = int(cables["begin"])
                self._loop.attend((first + done) * step_s)
        signals[Signal.AMPLIFIER, :done] = motion.amplifier_voltage[:done]
        return done
