"""Settings of feedback: criteria for settled motion and for jumps, and base levels to be held."""

from math import pi
from typing import Annotated, Self

from pydantic import Field, PositiveFloat, model_validator

from ..host.toml_file import FrozenModel

MOST_PERIODS = 100_000
Share = Annotated[float, Field(gt=0, lt=1)]
HeldMetres = Annotated[float, Field(ge=1e-15, le=1)]
"""Displacement to be held [m]. The bounds only catch wrong units; no sensor or shaker reaches them."""
HeldMetresPerS2 = Annotated[float, Field(ge=1e-9, le=1e5)]
"""Acceleration to be held [m/s2]. The bounds only catch wrong units; no shaker reaches 10 000 g."""


class Settling(FrozenModel):
    """Criteria by which the motion of the specimen counts as settled.

    Amplitude and phase of the first four harmonics are measured once per drive period. The motion is settled
    with period k if these values repeat after k drive periods. A motion that does not repeat is settled if
    its statistics are constant.
    """

    tolerance: Share = 0.01
    """Largest deviation between repetitions of the motion, relative to the motion's rms value."""
    periods: int = Field(default=80, ge=12, le=MOST_PERIODS)
    """Number of drive periods over which the motion must repeat."""
    longest_period: int = Field(default=8, ge=1, le=32)
    """Longest motion period that is searched for, in drive periods."""
    aperiodic_periods: int = Field(default=400, ge=100, le=MOST_PERIODS)
    """Number of drive periods over which a non-repeating motion must have constant statistics."""
    shortest_wait_s: float = Field(default=0.2, ge=0, le=600)
    """Shortest wait for settling at every frequency [s]."""
    longest_wait_s: float = Field(default=15.0, gt=0, le=3600)
    """Longest wait at every frequency [s]; after this wait, the motion is recorded as not settled."""

    @model_validator(mode="after")
    def _waits_in_order(self) -> Self:
        if self.shortest_wait_s > self.longest_wait_s:
            raise ValueError(
                f"shortest_wait_s = {self.shortest_wait_s:g} is longer than longest_wait_s = "
                f"{self.longest_wait_s:g}; lower the first or raise the second"
            )
        return self


class BaseLevel(FrozenModel):
    """Level of the base's motion that feedback holds by adjusting the generator's amplitude.

    Only the fundamental of the base motion is held; impacts add motion at other frequencies.
    ``amplitude_vpp`` of the plan is then the largest setting that feedback may use.
    """

    acceleration_m_per_s2: HeldMetresPerS2 | None = None
    """Peak acceleration of the fundamental [m/s2]; give either this or ``displacement_m``."""
    displacement_m: HeldMetres | None = None
    """Peak displacement of the fundamental at every frequency [m]; give this or ``acceleration_m_per_s2``."""
    tolerance: Share = 0.025
    """Allowed deviation of the measured level from the level to be held, relative to that level."""
    most_change: float = Field(default=1.25, gt=1, le=4)
    """Largest factor by which one correction changes the amplitude setting."""

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        if (self.acceleration_m_per_s2 is None) == (self.displacement_m is None):
            raise ValueError("give either acceleration_m_per_s2 or displacement_m, and not both")
        return self

    @property
    def quantity(self) -> str:
        """The quantity of the base motion that is held: ``"acceleration"`` or ``"displacement"``."""
        return "acceleration" if self.displacement_m is None else "displacement"

    @property
    def text(self) -> str:
        """The held level as text with its unit."""
        if self.displacement_m is not None:
            return f"{1e6 * self.displacement_m:g} µm"
        return f"{self.acceleration_m_per_s2:g} m/s²"

    def acceleration_at(self, frequency_hz: float) -> float:
        """Return the peak base acceleration to be held at ``frequency_hz`` [m/s2]."""
        if self.displacement_m is not None:
            return self.displacement_m * (2 * pi * frequency_hz) ** 2
        assert self.acceleration_m_per_s2 is not None, "the validator requires one of the two"
        return self.acceleration_m_per_s2


class JumpSearch(FrozenModel):
    """Criteria by which a change between two steps counts as a jump, and the accuracy of its location."""

    factor: float = Field(default=1.5, gt=1, le=100)
    """A change of Response II (fundamental of m0 over base) by more than this factor counts as a jump."""
    resolution_hz: PositiveFloat = 0.25
    """Largest allowed spacing of the two frequencies that enclose a located jump [Hz]."""
    most_searches: int = Field(default=6, ge=1, le=50)
    """Largest number of searches for jumps in one pass, including those at steep changes without a jump."""
