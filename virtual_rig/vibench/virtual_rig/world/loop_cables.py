"""Between the world and a real-time controller: its samples are means over its step, its volts come late."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibench.sim.engine.run import native_engine
from vibench.sim.shaker.loaded_shaker import LoadedShaker, ShakenMotion

from ..controller.virtual_controller import VirtualController
from .sensors import SensorParts
from .wiring import Signal

FloatArray = NDArray[np.float64]


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
