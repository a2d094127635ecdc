"""Response-controlled stepped sine: feedback holds the response of m0 at every frequency."""

from typing import Literal

from pydantic import Field, PositiveFloat

from vibench.sim import PhaseReference

from .feedback import HeldMetres, Share
from .plan import AbstractFeedback
from .settled_sine import GLIDE_TONE_S
from .stepped_sine import FrequencySteps


class HeldResponse(FrequencySteps, AbstractFeedback):
    """A stepped sine whose setting is corrected until m0 has a given amplitude, at every frequency.

    A level of the base may allow several responses, but each response belongs to only one level of the base.
    Curves at constant response are therefore single-valued. A set of them yields the curves at constant
    level, including unstable parts (Karaagacli and Ozguven, Vibration 3 (2020) 19). Feedback can hold motions
    that are stable at constant voltage, and unstable ones that diverge more slowly than feedback acts.
    """

    kind: Literal["held_response"] = "held_response"
    response_m: HeldMetres
    """Amplitude of the fundamental of m0's motion, to be held [m]."""
    response_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0 that is held: relative to the base, or absolute."""
    tolerance: Share = 0.01
    """Allowed relative deviation from ``response_m``; two measurements in a row must be within it."""
    most_change: float = Field(default=1.25, gt=1, le=4)
    """Largest factor by which one correction changes the amplitude setting."""
    start_share: Share = 0.02
    """Initial setting at the first frequency, as a fraction of ``amplitude_vpp``."""
    longest_wait_s: PositiveFloat = 20.0
    """Longest wait for ``response_m`` at a frequency [s]; the step's note states whether it was reached."""
    glide_step_hz: PositiveFloat = 0.5
    """Largest frequency step while the tone moves between two frequencies of the list [Hz]."""

    @property
    def level_text(self) -> str:
        """Display text for the held response and the largest amplitude setting."""
        words = f"{self.response_of.value} motion of m0 held at {1e6 * self.response_m:g} µm"
        return f"{words}, at most {self.amplitude_vpp:g} Vpp"

    @property
    def playing_s(self) -> float:
        """Duration of all steps if each wait takes its longest time [s]."""
        passes = sum(1 for _ in self.passes())
        glides = (self.rising_hz[-1] - self.rising_hz[0]) / self.glide_step_hz + len(self.rising_hz)
        steps_s = len(self.rising_hz) * (self.longest_wait_s + self.record_s)
        return passes * (steps_s + glides * GLIDE_TONE_S)
