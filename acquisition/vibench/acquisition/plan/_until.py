"""Recording until results reach a required accuracy: targets, and times of the analyses."""

from typing import Annotated

from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import NumberWith

from ..host.toml_file import FrozenModel

FEWEST_REALISATIONS = 4
"""Number of realisations before the first analysis: fewer have too little scatter for a bound."""
SHORTEST_S = 2.0
"""Default time before the first analysis [s]; a shorter plan is analysed at its end."""
LOOK_FACTOR = 2.0**0.5
"""Ratio of the recorded times at two successive analyses."""


Wish = Annotated[float, Field(gt=0, lt=1), NumberWith("%")]
"""Half width of the 95 % interval over the value."""


class Until(FrozenModel):
    """Record until the bound of every result named here is small enough, at most for the plan's time.

    The bounds hold in 95 % of recordings, also if they end a recording. They contain noise and chance, which
    recording time reduces, but no calibrations.
    """

    resonance_hz: Wish | None = None
    """Bound of the frequency of every resonance found in noise: ``"0.1 %"``."""
    transmissibility: Wish | None = None
    """Bound of the transmissibility at every resonance found in noise: ``"2 %"``."""
    response_i: Wish | None = None
    """Bound of Response I of a dwell or of each step: ``"1 %"``."""
    response_ii: Wish | None = None
    """Bound of Response II of a dwell or of each step: ``"1 %"``."""
    shortest_s: PositiveFloat = SHORTEST_S
    """Recorded time before the first analysis of a dwell, a step or streamed noise [s]; at most its planned
    time."""

    @model_validator(mode="after")
    def _wants_something(self) -> "Until":
        if not self.wishes:
            raise ValueError('it names no result; give for example response_i = "1 %"')
        return self

    @property
    def wishes(self) -> dict[str, float]:
        """Targets by the name of the result."""
        return {name: wish for name in WISHES if (wish := getattr(self, name)) is not None}


WISHES = ("resonance_hz", "transmissibility", "response_i", "response_ii")
"""Results that a plan may name."""
