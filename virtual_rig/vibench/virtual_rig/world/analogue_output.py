"""What an analogue output of the converter plays: queued samples, each held until the next one."""

import numpy as np

from .time_grid import USUAL_GRID, FloatArray, TimeGrid


class AnalogueOutput:
    """A queue of samples, played at their own rate on the world's grid; at zero when it is empty.

    The voltage is exact on average over every step, whatever the rate. A converter with an
    interpolating output filter would show weaker images than this plain hold.
    """

    def __init__(self, grid: TimeGrid = USUAL_GRID) -> None:
        self._grid = grid
        self._queue = np.empty(0)
        self._steps_per_sample = 1.0
        self._begin_step = 0.0
        """Where the first queued sample begins; fractions of a step are kept."""

    def queue(self, volts: FloatArray, sample_rate_hz: float, now_step: int) -> None:
        """Append samples; they begin now when nothing is left to play.

        A rate that differs from that of what still plays takes over the samples that are left.
        """
        left = self.unplayed(now_step)
        if left == 0:
            self._queue = np.empty(0)
            self._begin_step = max(float(now_step), self._begin_step)
        steps_per_sample = self._grid.rate_hz / sample_rate_hz
        if left and steps_per_sample != self._steps_per_sample:
            self._begin_step = float(now_step)
        self._steps_per_sample = steps_per_sample
        self._queue = np.concatenate([self._queue, np.asarray(volts, dtype=np.float64)])

    def unplayed(self, now_step: int) -> int:
        """Count the samples that have not ended yet."""
        ended = int(max(now_step - self._begin_step, 0.0) / self._steps_per_sample + _ROUNDING)
        return max(len(self._queue) - ended, 0)

    def drop(self) -> None:
        """Forget what is queued; the output goes to zero."""
        self._queue = np.empty(0)

    def render(self, first_step: int, steps: int) -> FloatArray:
        """Mean voltage over each of the next steps, shape (steps,); what has been played is forgotten."""
        if not len(self._queue):
            return np.zeros(steps)
        edges = (first_step + np.arange(steps + 1) - self._begin_step) / self._steps_per_sample
        touched = self._queue[: max(int(np.ceil(edges[-1])), 0)]
        integral = np.concatenate([[0.0], np.cumsum(touched)])
        means = np.diff(np.interp(edges, np.arange(len(integral)), integral)) * self._steps_per_sample
        self._forget(int(max(edges[-1], 0.0) + _ROUNDING))
        return np.asarray(means)

    def _forget(self, played: int) -> None:
        played = min(played, len(self._queue))
        self._queue = self._queue[played:]
        self._begin_step += played * self._steps_per_sample


_ROUNDING = 1e-6
"""In samples: a sample that ends on a step has ended."""
