"""A sine sweep during which feedback holds the base motion at a level."""

from collections.abc import Iterator
from typing import Literal

from pydantic import PositiveFloat

from .feedback import BaseLevel, Settling
from .plan import AbstractFeedback
from .sine_sweep import MovingSine
from .steps import Segment, Step, Tone


class HeldSweep(MovingSine, AbstractFeedback):
    """A sweep whose amplitude setting is corrected after every step from the measured base motion.

    A sweep does not wait for the level to settle. If the gain from the setting to the base motion changes
    within a few steps, the level is wrong during these steps, and the recording states this.
    """

    kind: Literal["held_sweep"] = "held_sweep"
    base_level: BaseLevel
    """Level of the base that feedback holds."""
    average_s: PositiveFloat = 0.5
    """Averaging time of the level, to reduce random errors [s]; a lasting change is tracked faster."""
    settling: Settling = Settling()
    """Criteria by which the motion counts as settled before the sweep."""

    @property
    def playing_s(self) -> float:
        """Longest wait at the start plus duration of the sweep [s]."""
        return self.settling.longest_wait_s + self.duration_s

    @property
    def segment(self) -> Segment:
        """The segment of the sweep."""
        return self.segment_with(f"measured {self.base_level.quantity}")

    def steps(self) -> Iterator[Step]:
        """Yield one step for every ``step_s``, all in one segment and at the largest amplitude setting."""
        segment = self.segment
        for mean_hz, duration_s in self.mean_steps():
            yield Step(Tone(mean_hz), 0.0, duration_s, segment)
