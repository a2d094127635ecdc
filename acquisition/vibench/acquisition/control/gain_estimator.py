"""The base's answer to the generator while the frequency moves: measured, smoothed, and predicted."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from .steadiness import Phasors

_SURE = 4.0
"""Standard uncertainties from which on a trend is followed instead of averaged away."""
_FEWEST = 3
"""Steps from which a trend and its scatter can be told."""


@dataclass(frozen=True)
class _Answer:
    time_s: float
    gain: complex
    """Measured over what the rig's linear model says."""
    level: complex
    """Measured over what should be held."""


class GainEstimator:
    """What the base did over what the linear model of the rig says, for the last while.

    In chaos the fundamental of a few periods is mostly chance: the mean of the track counts. Where the
    answer changes steadily, as over a resonance, the track's line is drawn on to the next step.
    """

    def __init__(self, memory_s: float) -> None:
        self._memory_s = memory_s
        self._answers: deque[_Answer] = deque()

    def add(self, time_s: float, base: Phasors, modelled: float, target: float) -> None:
        """Take in the periods of a step, shape (periods,).

        Parameters
        ----------
        modelled, target
            Base acceleration of the linear model at this setting, and the one to be held [m/s2].

        """
        if not len(base):
            return
        mean = complex(np.mean(base))
        self._answers.append(_Answer(time_s, mean / modelled, mean / target))
        while self._answers[0].time_s < time_s - self._memory_s * (1 - 1e-9):
            self._answers.popleft()

    @property
    def is_known(self) -> bool:
        """Whether anything was measured yet."""
        return bool(self._answers)

    @property
    def level(self) -> float:
        """Give the mean amplitude over the track, as a share of what should be held."""
        if not self._answers:
            return 1.0
        return float(abs(np.mean([each.level for each in self._answers])))

    def gain_at(self, time_s: float) -> float:
        """Foresee the magnitude of the gain; 1, the model, while nothing is known."""
        if not self._answers:
            return 1.0
        gain = np.array([each.gain for each in self._answers])
        mean = complex(gain.mean())
        if len(gain) < _FEWEST:
            return abs(mean)
        since_s = np.array([each.time_s for each in self._answers])
        away_s = since_s - since_s.mean()
        spread = float(away_s @ away_s)
        slope = complex(away_s @ gain) / spread
        left = gain - mean - slope * away_s
        slope_u = float(np.sqrt(np.sum(np.abs(left) ** 2) / (len(gain) - 2) / spread))
        if abs(slope) <= _SURE * slope_u:
            return abs(mean)
        return abs(mean + slope * (time_s - float(since_s.mean())))
