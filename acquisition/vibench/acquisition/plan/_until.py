"""Recording until a result is known well enough: what is wanted, and how far a recording has come."""

import re
from typing import Annotated

from pydantic import BeforeValidator, Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from ..host.toml_file import FrozenModel

FEWEST_REALISATIONS = 4
"""Of noise before its first look: fewer have too little scatter to state a bound by."""
LOOK_FACTOR = 2.0**0.5
"""Recorded time of a look over that of the one before."""


def _share(given: object) -> object:
    if not isinstance(given, str):
        return given
    found = re.fullmatch(r"\s*(\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\s*%\s*", given, re.ASCII)
    if found is None:
        raise ValueError('give a share of the value, like "0.5 %" or 0.005')
    return 0.01 * float(found[1])


Wish = Annotated[
    float, Field(gt=0, lt=1), BeforeValidator(_share, json_schema_input_type=PositiveFloat | str)
]
"""Half width of the 95 % interval over the value."""


class Until(FrozenModel):
    """Record until every result named here is known this well; the plan's own time is the longest.

    A bound holds in 95 % of recordings, also of those that end by it. It states noise and chance, which
    recording time reduces, and leaves out calibrations, which it does not reduce.
    """

    resonance_hz: Wish | None = None
    """Of the frequency of every resonance that noise shows: ``"0.1 %"``."""
    transmissibility: Wish | None = None
    """Of the transmissibility at every resonance that noise shows: ``"2 %"``."""
    response_i: Wish | None = None
    """Of Response I of a dwell or of each step: ``"1 %"``."""
    response_ii: Wish | None = None
    """Of Response II of a dwell or of each step: ``"1 %"``."""
    shortest_s: PositiveFloat = 2.0
    """Recorded before the first look, of a dwell, a step or streamed noise [s]."""

    @model_validator(mode="after")
    def _wants_something(self) -> "Until":
        if not self.wishes:
            raise ValueError('it names no result; give for example response_i = "1 %"')
        return self

    @property
    def wishes(self) -> dict[str, float]:
        """What is wanted, by the name of the result."""
        return {name: wish for name in WISHES if (wish := getattr(self, name)) is not None}


WISHES = ("resonance_hz", "transmissibility", "response_i", "response_ii")
"""Results that a plan may name."""


class UntilProgress(FrozenModel):
    """How well results are known so far."""

    wishes: dict[str, PositiveFloat]
    """Wanted bounds of 95 %, relative, by result."""
    bounds: dict[str, NonNegativeFloat | None] = Field(default_factory=dict)
    """Bounds at the last look; None where none can be stated yet. Empty before the first look."""
    looked_s: NonNegativeFloat = 0.0
    """Recorded at the last look [s]."""
    longest_s: PositiveFloat
    """Recorded time at which the recording ends anyway [s]."""
    looks: int = 0
    is_reached: bool = False
    hindrance: str = ""
    """Why nothing can be stated; empty otherwise."""
    stretch: PositiveInt = 1
    """Number of the step; 1 where there is one stretch."""

    @property
    def needed_s(self) -> float | None:
        """Recorded time that the wishes need, as scatter falls with the root of time [s]; None if unknown."""
        found = [(self.bounds.get(name), wish) for name, wish in self.wishes.items()]
        shares = [bound / wish for bound, wish in found if bound is not None]
        if self.is_reached or len(shares) < len(found):
            return self.looked_s if self.is_reached else None
        return self.looked_s * max(1.0, *shares) ** 2

    @property
    def sentence(self) -> str:
        """Bounds, targets and the time left in words."""
        parts = []
        for name, wish in self.wishes.items():
            bound = self.bounds.get(name)
            known = "not known yet" if bound is None else f"± {100 * bound:.2g} %"
            parts.append(f"{name} {known} of {100 * wish:.2g} %")
        said = ", ".join(parts)
        if self.hindrance:
            return f"{said} ({self.hindrance})"
        if self.is_reached:
            return f"{said}: reached"
        needed_s = self.needed_s
        if needed_s is None:
            return said
        if needed_s > self.longest_s:
            return f"{said}, not within {self.longest_s:.3g} s"
        return f"{said}, about {needed_s - self.looked_s:.3g} s left"
