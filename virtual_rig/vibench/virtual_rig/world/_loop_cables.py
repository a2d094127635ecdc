"""Between the world and a real-time controller: its samples are means over its step, its volts come late."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibench.sim.kernels import kernel
from vibench.sim.shaker import ShakenMotion, ShakerParts, move_shaker

from ..controller import LoopParts, VirtualController, answer, wants_attention
from ._sensors import SensorParts, show_steps
from ._wiring import Signal

FloatArray = NDArray[np.float64]
_DRIVE, _AMPLIFIER = int(Signal.DRIVE), int(Signal.AMPLIFIER)
_BASE, _M0 = int(Signal.BASE_ACCELERATION), int(Signal.M0_VELOCITY)


class PlantParts(NamedTuple):
    """Everything between the voltage at the amplifier and the volts of both sensors, over a stretch."""

    shaker: ShakerParts
    noise: FloatArray
    """Of the amplifier [V], shape (steps,)."""
    base: SensorParts
    m0: SensorParts


class CableParts(NamedTuple):
    """What is on its way."""

    late: FloatArray
    """Volts of the next steps, from the one that is played next, shape (latency + sample,)."""
    heard: FloatArray
    """Sums over the sample so far of base and m0, and how many steps they have."""
    steps: int
    """From sample to sample."""


class LoopCables:
    """Hands a controller its samples, on a grid since the world began, and plays its volts.

    While it is silent the world does not stop for it.
    """

    def __init__(self, loop: VirtualController) -> None:
        self._loop = loop
        steps = loop.steps_per_sample
        self._parts = CableParts(np.zeros(loop.latency_steps + steps), np.zeros(3), steps)

    @property
    def is_on(self) -> bool:
        """Whether the controller plays, or volts are still on their way."""
        return self._loop.is_on or bool(self._parts.late.any())

    def move(
        self, first: int, step_s: float, plant: PlantParts, motion: ShakenMotion, signals: FloatArray
    ) -> int:
        """Move the plant from a step of the world on, the loop closed; gives the steps done.

        ``signals`` holds at first what else drives the amplifier, and at last all that there was.
        """
        done, steps = 0, signals.shape[1]
        while done < steps:
            with self._loop.answering() as loop:
                stop, good = _closed_loop(
                    done,
                    first,
                    plant,
                    self._parts,
                    loop,
                    motion.amplifier_voltage,
                    motion.base_acceleration,
                    motion.m0_velocity,
                    motion.ends,
                    signals,
                )
                self._loop.attend((first + stop) * step_s)
            done = stop
            if not good:
                break
        return done


@kernel
def _closed_loop(
    begin: int,
    first: int,
    plant: PlantParts,
    cables: CableParts,
    loop: LoopParts,
    amplifier_voltage: FloatArray,
    base_acceleration: FloatArray,
    m0_velocity: FloatArray,
    ends: FloatArray,
    signals: FloatArray,
) -> tuple[int, bool]:
    """Go from sample to sample until the stretch ends, or the controller asks for attention."""
    late, heard, each = cables
    drive = signals[_DRIVE]
    while begin < drive.size:
        if (first + begin) % each == 0:
            count = max(heard[2], 1.0)
            volts = answer(heard[0] / count, heard[1] / count, loop)
            heard[:] = 0.0
            late[-each:] = volts
        stop = min(begin + each - (first + begin) % each, drive.size)
        count = stop - begin
        drive[begin:stop] += late[:count]
        late[:-count] = late[count:]
        late[-count:] = 0.0
        rows = ends[begin:stop] if ends.shape[0] else ends
        good = move_shaker(
            drive[begin:stop],
            plant.noise[begin:stop],
            plant.shaker,
            amplifier_voltage[begin:stop],
            base_acceleration[begin:stop],
            m0_velocity[begin:stop],
            rows,
        )
        if good < count:
            return begin + good, False
        show_steps(base_acceleration[begin:stop], begin, plant.base, signals[_BASE, begin:stop])
        show_steps(m0_velocity[begin:stop], begin, plant.m0, signals[_M0, begin:stop])
        for n in range(begin, stop):
            heard[0] += signals[_BASE, n]
            heard[1] += signals[_M0, n]
        heard[2] += count
        begin = stop
        if wants_attention(loop.now):
            break
    signals[_AMPLIFIER, :begin] = amplifier_voltage[:begin]
    return begin, True
