"""The generator's clock as the converter sees it: where the drive's periods begin, block by block."""

from collections import deque
from math import pi

import numpy as np

from ..instruments import Samples

_MEMORY = 40
"""Blocks from which the frequency is taken; the line through their phases is then sharp enough."""


class DriveClock:
    """Follows one tone on the recorded drive channel.

    Generator and converter have clocks of their own: some ten parts in a million between them, a
    tenth of a turn after 40 s at 260 Hz. What was commanded therefore tells the frequency only
    roughly; the phase of every block is fitted anew, and the line through them is the frequency.
    """

    def __init__(self, near_hz: float, sample_rate_hz: float) -> None:
        self._near_hz = near_hz
        self._rate_hz = sample_rate_hz
        self._centres_s: deque[float] = deque(maxlen=_MEMORY)
        self._phases: deque[float] = deque(maxlen=_MEMORY)
        self.frequency_hz = near_hz
        """Of the drive in the converter's time, as far as it is known [Hz]."""
        self.phase_cycles = 0.0
        """Cycles of the drive's sine at sample 0, modulo 1."""

    def follow(self, drive: Samples, first_sample: int) -> None:
        """Take in the drive of a block, any unit, shape (samples,): two periods at least."""
        count = len(drive)
        centre_s = (first_sample + 0.5 * (count - 1)) / self._rate_hz
        offset_s = (np.arange(count) - 0.5 * (count - 1)) / self._rate_hz
        angle = 2 * pi * self._near_hz * offset_s
        basis = np.stack([np.sin(angle), np.cos(angle), np.ones(count)], axis=1)
        solution = np.linalg.lstsq(basis, drive)[0]
        # Cycles of A sin(2 pi (f t + c)) at the block's centre, less what the nominal frequency makes of it.
        turns = float(np.arctan2(solution[1], solution[0])) / (2 * pi) - self._near_hz * centre_s
        before = self._phases[-1] if self._phases else turns
        turns = before + (turns - before + 0.5) % 1.0 - 0.5
        self._centres_s.append(centre_s)
        self._phases.append(turns)
        self._draw_line()

    def starts_s(self, first_s: float, last_s: float) -> Samples:
        """Give the times between two times at which the drive rises through zero [s]."""
        first = np.ceil(self.frequency_hz * first_s + self.phase_cycles - 1e-6)
        last = np.floor(self.frequency_hz * last_s + self.phase_cycles)
        return np.asarray((np.arange(first, last + 1) - self.phase_cycles) / self.frequency_hz)

    def _draw_line(self) -> None:
        centre_s, phase = np.array(self._centres_s), np.array(self._phases)
        mean_s, mean = float(centre_s.mean()), float(phase.mean())
        away_s = centre_s - mean_s
        spread = float(away_s @ away_s)
        slope = float(away_s @ (phase - mean)) / spread if spread > 0 else 0.0
        self.frequency_hz = self._near_hz + slope
        self.phase_cycles = mean - slope * mean_s
