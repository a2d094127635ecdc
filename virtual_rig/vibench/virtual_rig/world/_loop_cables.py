"""Between the world and a real-time controller: its samples are means over its step, its volts come late."""

import numpy as np
from numpy.typing import NDArray

from ..analogue import FastLoop
from ._wiring import Signal

FloatArray = NDArray[np.float64]


class LoopCables:
    """Hands a controller its samples, on a grid since the world began, and plays its volts.

    While it is silent the world does not stop for it.
    """

    def __init__(self, loop: FastLoop) -> None:
        self._loop = loop
        self._steps = loop.steps_per_sample
        self._late = np.zeros(loop.latency_steps + self._steps)
        """Volts of the next steps, from the one that is played next."""
        self._heard = np.zeros(2)
        self._count = 0

    @property
    def is_on(self) -> bool:
        """Whether the controller plays, or volts are still on their way."""
        return self._loop.is_on or bool(self._late.any())

    def until_sample(self, step: int) -> int:
        """Count the steps from one to the controller's next sample."""
        return self._steps - step % self._steps

    def played(self, step: int, count: int) -> FloatArray:
        """Volts of the next steps, none of which lies beyond the next sample, shape (count,)."""
        if step % self._steps == 0:
            seen, self._count = self._heard / max(self._count, 1), 0
            self._heard = np.zeros(2)
            volts = self._loop.answer(float(seen[0]), float(seen[1])) if self._loop.is_on else 0.0
            self._late[-self._steps :] = volts
        volts_now = self._late[:count].copy()
        self._late[:-count] = self._late[count:]
        self._late[-count:] = 0.0
        return volts_now

    def take(self, signals: FloatArray) -> None:
        """Take what the sensors showed in the steps that were played."""
        self._heard += signals[[Signal.BASE_ACCELERATION, Signal.M0_VELOCITY]].sum(axis=1)
        self._count += signals.shape[1]
