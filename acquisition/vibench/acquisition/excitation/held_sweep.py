"""A sine sweep with the measured motion of the base held at a level."""

from collections.abc import Iterator
from typing import Literal

from pydantic import PositiveFloat

from .feedback import BaseLevel, Settling
from .plan import AbstractFeedback
from .sine_sweep import MovingSine
from .steps import Segment, Step, Tone


class HeldSweep(MovingSine, AbstractFeedback):
    """A sweep whose setting is corrected after every step from the motion of the base.

    A sweep does not wait: if the gain of the base changes within a few steps, the level is off for that
    time, and the recording notes it.
    """

    kind: Literal["held_sweep"] = "held_sweep"
    base_level: BaseLevel
    """Level of the base to be held."""
    average_s: PositiveFloat = 0.5
    """Averaging time for random errors and for the check of the level; a trend is followed faster [s]."""
    settling: Settling = Settling()
    """Settling before the sweep."""

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """The level of the base to be held, as the only entry."""
        return (self.base_level,)

    @property
    def playing_s(self) -> float:
        """The longest wait at the start, and the sweep [s]."""
        return self.settling.longest_wait_s + self.duration_s

    @property
    def segment(self) -> Segment:
        """The segment of the sweep."""
        return self.segment_with(f"measured {self.base_level.quantity}")

    def steps(self) -> Iterator[Step]:
        """Yield one step for every ``step_s``, all of one segment, at the largest setting."""
        segment = self.segment
        for mean_hz, duration_s in self.mean_steps():
            yield Step(Tone(mean_hz), 0.0, duration_s, segment)
