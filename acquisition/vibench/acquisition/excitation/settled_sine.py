"""A stepped sine that records each step after measurements have shown that the motion has settled."""

from typing import ClassVar, Literal

from pydantic import Field, PositiveFloat

from ..recording import SegmentLabel
from .feedback import BaseLevel, JumpSearch, Settling
from .plan import AbstractFeedback
from .stepped_sine import FrequencySteps

GLIDE_TONE_S = 0.1
"""Duration of each intermediate tone between two frequencies of the list [s]."""


class SettledSine(FrequencySteps, AbstractFeedback):
    """A stepped sine that waits for settled motion, stays on its branch and locates jumps.

    The phase is continuous from one frequency to the next. The recording contains the result of each step:
    period, waiting time, level of the base, and how the branch was reached.
    """

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP, SegmentLabel.SEARCH)
    most_steps: ClassVar[int] = 600
    """Largest number of steps: an event table must hold four events per step, plus those of searches."""
    kind: Literal["settled_sine"] = "settled_sine"
    settling: Settling = Settling()
    base_level: BaseLevel | None = None
    """Level of the base to be held; if absent, ``amplitude_vpp`` stays constant."""
    jumps: JumpSearch | None = None
    """Criteria to locate jumps between steps; if absent, jumps are not searched for."""
    glide_step_hz: PositiveFloat = 0.5
    """Largest frequency step while the tone moves between two frequencies of the list [Hz]."""
    search_s: float = Field(default=120.0, gt=0, le=7200)
    """Longest search for one jump [s]; after it, the last frequency interval is the result."""

    @property
    def playing_s(self) -> float:
        """Duration of all steps and searches if each wait takes its longest time [s]."""
        passes = sum(1 for _ in self.passes())
        steps_s = len(self.rising_hz) * (self.settling.longest_wait_s + self.record_s)
        glides = (self.rising_hz[-1] - self.rising_hz[0]) / self.glide_step_hz + len(self.rising_hz)
        searches = 0 if self.jumps is None else self.jumps.most_searches
        return passes * (steps_s + glides * GLIDE_TONE_S + searches * self.search_s)
