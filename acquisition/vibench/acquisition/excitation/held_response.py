"""Sines one after the other, the response's amplitude held at each: response-controlled stepped sines."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field, PositiveFloat

from vibench.sim import PhaseReference

from ..recording import SegmentLabel
from .feedback import BaseLevel, HeldMetres, Share
from .plan import AbstractFeedback
from .settled_sine import GLIDE_TONE_S
from .stepped_sine import FrequencySteps
from .steps import Segment, Step, Tone


class HeldResponse(FrequencySteps, AbstractFeedback):
    """A stepped sine whose setting is corrected until m0 moves as far as asked, at every frequency.

    Where the base's level has several answers, a response has one level of the base: curves of
    constant response are single-valued, and a set of them gives those of constant level, unstable parts
    included (Karaagacli and Ozguven, Vibration 3 (2020) 19). What can be held is what the chain's own motion
    under the voltage leaves stable, or grows slower than feedback acts.
    """

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP,)
    kind: Literal["held_response"] = "held_response"
    response_m: HeldMetres
    """Amplitude of m0's fundamental to be held [m]."""
    response_of: PhaseReference = PhaseReference.RELATIVE
    """Which motion of m0 that is: the one against the base, or the absolute one."""
    tolerance: Share = 0.01
    """How far it may be from that, as a share, twice in a row."""
    most_change: float = Field(default=1.25, gt=1, le=4)
    """The setting changes by at most this factor at once."""
    start_share: Share = 0.02
    """Setting from which the first frequency is started, over ``amplitude_vpp``."""
    longest_wait_s: PositiveFloat = 20.0
    """Wait no longer than this; the step is then recorded and flagged [s]."""
    glide_step_hz: PositiveFloat = 0.5
    """On its way from one frequency to the next the tone takes no larger steps than this [Hz]."""

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """None: the base follows."""
        return ()

    @property
    def level_text(self) -> str:
        """The response, and the setting that it may take."""
        words = f"{self.response_of.value} motion of m0 held at {1e6 * self.response_m:g} µm"
        return f"{words}, at most {self.amplitude_vpp:g} Vpp"

    @property
    def playing_s(self) -> float:
        """All steps with the longest waits [s]."""
        passes = sum(1 for _ in self.passes())
        glides = (self.rising_hz[-1] - self.rising_hz[0]) / self.glide_step_hz + len(self.rising_hz)
        steps_s = len(self.rising_hz) * (self.longest_wait_s + self.record_s)
        return passes * (steps_s + glides * GLIDE_TONE_S)

    def segment(self, frequency_hz: float, direction: str) -> Segment:
        """Name the recording of a step."""
        return Segment(SegmentLabel.STEP, {"frequency_hz": frequency_hz, "direction": direction})

    def steps(self) -> Iterator[Step]:
        """One step for every frequency of the list, without its wait, at the largest setting."""
        for direction, frequencies_hz in self.passes():
            for frequency_hz in frequencies_hz:
                yield Step(Tone(frequency_hz), 0.0, self.record_s, self.segment(frequency_hz, direction))
