"""Between the world and a real-time controller: its samples are means over its step, its volts come late."""

from collections.abc import Callable
from typing import NamedTuple, cast

import numpy as np
from llvmlite import binding
from numba import types
from numpy.typing import NDArray

from vibench.sim.engine import native_engine
from vibench.sim.kernels import kernel
from vibench.sim.shaker import ShakenMotion, ShakerParts, move_shaker

from ..controller import VirtualController
from ._sensors import SensorParts
from ._wiring import Signal

FloatArray = NDArray[np.float64]
# The shaker is moved by a kernel as yet, so that a kernel goes from sample to sample.
_play_loop, _hear_loop = (
    cast("Callable[[int], int]", types.ExternalFunction(f"vibench_{name}", types.int64(types.intp)))
    for name in ("play_loop", "hear_loop")
)


class PlantParts(NamedTuple):
    """Everything between the voltage at the amplifier and the volts of both sensors, over a stretch."""

    shaker: ShakerParts
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
        binding.load_library_permanently(str(engine.path))
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
        native_engine().fill(cables, drive=drive, base=base, m0=m0)
        done, good = 0, True
        while good and done < drive.size:
            with self._loop.answering() as loop:
                cables["controller"] = loop.ctypes.data
                done, good = _closed_loop(
                    done,
                    cables.ctypes.data,
                    plant.shaker,
                    drive,
                    plant.noise,
                    motion.amplifier_voltage,
                    motion.base_acceleration,
                    motion.m0_velocity,
                    motion.ends,
                )
                self._loop.attend((first + done) * step_s)
        signals[Signal.AMPLIFIER, :done] = motion.amplifier_voltage[:done]
        return done


@kernel
def _closed_loop(
    begin: int,
    cables: int,
    shaker: ShakerParts,
    drive: FloatArray,
    noise: FloatArray,
    amplifier_voltage: FloatArray,
    base_acceleration: FloatArray,
    m0_velocity: FloatArray,
    ends: FloatArray,
) -> tuple[int, bool]:
    """Go from sample to sample until the stretch ends, or the controller asks for attention."""
    while begin < drive.size:
        stop = _play_loop(cables)
        good = move_shaker(
            drive[begin:stop],
            noise[begin:stop],
            shaker,
            amplifier_voltage[begin:stop],
            base_acceleration[begin:stop],
            m0_velocity[begin:stop],
            ends[begin:stop] if ends.shape[0] else ends,
        )
        if good < stop - begin:
            return begin + good, False
        begin = stop
        if _hear_loop(cables):
            break
    return begin, True
