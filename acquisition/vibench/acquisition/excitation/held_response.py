"""Sines one after the other with a constant response: response-controlled stepped sines."""

from typing import Literal

from pydantic import Field, PositiveFloat

from vibench.sim import PhaseReference

from .feedback import BaseLevel, HeldMetres, Share
from .plan import AbstractFeedback
from .settled_sine import GLIDE_TONE_S
from .stepped_sine import FrequencySteps


class HeldResponse(FrequencySteps, AbstractFeedback):
    """A stepped sine whose setting is corrected until m0 has a given amplitude, at every frequency.

    One level of the base may have several responses, but a response has one level of the base. So curves of
    constant response are single-valued, and a set of them gives those of constant level, including unstable
    parts (Karaagacli and Ozguven, Vibration 3 (2020) 19). Motions can be held that are stable under constant
    voltage, or that grow more slowly than feedback acts.
    """

    kind: Literal["held_response"] = "held_response"
    response_m: HeldMetres
    """Amplitude of m0's fundamental to be held [m]."""
    response_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0: relative to the base, or absolute."""
    tolerance: Share = 0.01
    """Relative tolerance that two measurements in a row must meet."""
    most_change: float = Field(default=1.25, gt=1, le=4)
    """Largest factor of one change of the setting."""
    start_share: Share = 0.02
    """Setting at the start of the first frequency, over ``amplitude_vpp``."""
    longest_wait_s: PositiveFloat = 20.0
    """Longest wait [s]; the step is then recorded and flagged."""
    glide_step_hz: PositiveFloat = 0.5
    """Largest frequency step of the tone between two frequencies of the list [Hz]."""

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """Empty: feedback holds the response, not a level of the base."""
        return ()

    @property
    def level_text(self) -> str:
        """The response, and the largest setting."""
        words = f"{self.response_of.value} motion of m0 held at {1e6 * self.response_m:g} µm"
        return f"{words}, at most {self.amplitude_vpp:g} Vpp"

    @property
    def playing_s(self) -> float:
        """All steps with the longest waits [s]."""
        passes = sum(1 for _ in self.passes())
        glides = (self.rising_hz[-1] - self.rising_hz[0]) / self.glide_step_hz + len(self.rising_hz)
        steps_s = len(self.rising_hz) * (self.longest_wait_s + self.record_s)
        return passes * (steps_s + glides * GLIDE_TONE_S)
