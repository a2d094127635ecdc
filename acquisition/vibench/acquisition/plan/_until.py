"""Recording until a result is known well enough: what a plan wants to know, and when to look."""

import re
from typing import Annotated

from pydantic import BeforeValidator, Field, PositiveFloat, model_validator

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
