"""Record until results reach a required accuracy: targets, and times of the analyses."""

from typing import Annotated

from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import NumberWith

from ..host.toml_file import FrozenModel

FEWEST_REALISATIONS = 4
"""Number of realisations before the first analysis; fewer do not suffice to estimate the scatter."""
SHORTEST_S = 2.0
"""Default time before the first analysis [s]; a shorter recording is analysed only at its end."""
LOOK_FACTOR = 2.0**0.5
"""Ratio of the recorded time at one analysis to the recorded time at the previous analysis."""


Wish = Annotated[float, Field(gt=0, lt=1), NumberWith("%")]
"""Required accuracy of a result: half the width of its 95 % interval, relative to its value."""


class Until(FrozenModel):
    """Record until the bound on the error of every result named here is small enough.

    The planned time is never exceeded. The bounds hold in 95 % of recordings, including those that end early.
    They include noise and scatter, which a longer recording reduces, but not calibration uncertainty.
    """

    resonance_hz: Wish | None = None
    """Required uncertainty of the frequency of every resonance under noise excitation: ``"0.1 %"``."""
    transmissibility: Wish | None = None
    """Required error bound of the transmissibility at every resonance found in noise: ``"2 %"``."""
    response_i: Wish | None = None
    """Required error bound of Response I of a dwell or of each step: ``"1 %"``."""
    response_ii: Wish | None = None
    """Required error bound of Response II of a dwell or of each step: ``"1 %"``."""
    shortest_s: PositiveFloat = SHORTEST_S
    """Recorded time before the first analysis of a dwell, a step or streamed noise [s]; at most the planned
    time."""

    @model_validator(mode="after")
    def _wants_something(self) -> "Until":
        if not self.required_bounds:
            raise ValueError("'until' names no result; give one, such as response_i = '1 %'")
        return self

    @property
    def required_bounds(self) -> dict[str, float]:
        """Required relative bounds by name of the result."""
        return {name: wish for name in WISHES if (wish := getattr(self, name)) is not None}


WISHES = ("resonance_hz", "transmissibility", "response_i", "response_ii")
"""Names of the results that `Until` may require."""
