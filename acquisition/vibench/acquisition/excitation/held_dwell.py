"""A sine at one frequency during which feedback holds the base motion at a level."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import PositiveFloat

from ..recording import SegmentLabel
from .feedback import BaseLevel, Settling
from .plan import AbstractFeedback, Family, FixedSine
from .steps import Segment, Step, Tone


class HeldDwell(FixedSine, AbstractFeedback):
    """A dwell whose base motion is held at a level by feedback, before and during the recording."""

    family: ClassVar[Family] = Family.DWELL
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.DWELL,)
    kind: Literal["held_dwell"] = "held_dwell"
    base_level: BaseLevel
    """Level of the base that feedback holds."""
    settling: Settling = Settling()
    """Criteria by which the motion counts as settled before the recording."""
    duration_s: PositiveFloat
    """Recording time of the settled motion [s]."""
    update_s: PositiveFloat = 1.0
    """Interval at which the level is measured, and corrected if needed, during the recording [s]."""

    @property
    def playing_s(self) -> float:
        """Longest wait for settling plus recording time [s]."""
        return self.settling.longest_wait_s + self.duration_s

    @property
    def segment(self) -> Segment:
        """Segment of the recording that begins after settling."""
        return Segment(SegmentLabel.DWELL, {"frequency_hz": self.frequency_hz})

    def steps(self) -> Iterator[Step]:
        """Yield one step: the recording at the largest amplitude setting, without the wait before it."""
        yield Step(Tone(self.frequency_hz), 0.0, self.duration_s, self.segment)
