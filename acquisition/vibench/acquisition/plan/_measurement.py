"""The plan of one measurement: what is played, how it is ramped, when the run must end itself.

A point: one recording that a campaign wants, and the chain of points that it belongs to.
"""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, PositiveFloat, PositiveInt, model_validator

from ..excitation.kinds import Excitation
from ..host.toml_file import FrozenModel

_NAME = r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$"


def _is_of_a_file(said: object) -> object:
    if isinstance(said, str) and re.search(_NAME, said) is None:
        raise ValueError("it names a file; give 1 to 64 letters a to z, digits, _ and -, not _ or - first")
    return said


Name = Annotated[str, Field(pattern=_NAME), BeforeValidator(_is_of_a_file)]
"""Becomes part of a file's name: letters, digits, ``_`` and ``-``, at most 64 of them."""

LONGEST_S = 30 * 86400.0
"""Of one recording: a month [s]."""
Fraction = Annotated[float, Field(gt=0, le=1)]

FEWEST_STAIRS = 4
"""Of a ramp: fewer would be steps."""


class OnOverload(StrEnum):
    """What the run does when an input or the vibrometer passes 95 % of its range."""

    FLAG = "flag"
    """Mark the samples in the recording and go on: nothing breaks, the analysis leaves them out."""
    STOP = "stop"
    """Ramp down and end the run."""


class OnChange(StrEnum):
    """What the run does when the live twin finds that the specimen is no longer what it was."""

    NOTE = "note"
    """Note it as an event in the recording and go on."""
    STOP = "stop"
    """Ramp down and end the run; the live twin is started for it where nobody has."""


class InRunLimits(FrozenModel):
    """When the running measurement must end itself: fractions of the rig's own limits."""

    base_acceleration: Fraction = 1.0
    """Of the shaker's acceleration limit, measured at the base."""
    base_velocity: Fraction = 1.0
    """Of the shaker's velocity limit, integrated from the acceleration at the base."""
    stroke: Fraction = 1.0
    """Of the shaker's stroke limit, integrated twice."""
    force: Fraction = 1.0
    """Of the shaker's force limit: the coil's, from its current, and the one that moves the table."""
    amplifier_voltage: Fraction = 1.0
    """Of the amplifier's clipping voltage, measured at its output."""
    current: Fraction = 1.0
    """Of the coil's peak current and of the amplifier's limiter (rms); the current is the amplifier voltage,
    less what the moving coil induces, over the coil's resistance."""
    specimen_amplitude: Fraction = 1.0
    """Of the specimen's amplitude limit: the main mass against the base, from the vibrometer."""
    on_overload: OnOverload = OnOverload.FLAG
    on_changed_specimen: OnChange = OnChange.NOTE


class Measurement(FrozenModel):
    """One excitation, from ramp up to ramp down, into one recording."""

    name: Name
    excitation: Excitation
    ramp_s: PositiveFloat = Field(default=1.0, le=60)
    """Time of a half-cosine ramp from silence to full amplitude, and back [s]."""
    ramp_step_s: PositiveFloat = 0.05
    """The ramp is a staircase of amplitude settings; this is one stair [s]."""
    repeats: PositiveInt = Field(default=1, le=1000)
    """How many recordings a campaign makes of it."""
    limits: InRunLimits = InRunLimits()
    notes: str = ""

    @model_validator(mode="after")
    def _ramp_has_stairs(self) -> Self:
        if self.ramp_step_s * FEWEST_STAIRS > self.ramp_s * (1 + 1e-9):
            raise ValueError(
                f"ramp_step_s = {self.ramp_step_s:g} leaves fewer than {FEWEST_STAIRS} stairs in a ramp of "
                f"{self.ramp_s:g} s; give at most {self.ramp_s / FEWEST_STAIRS:g}"
            )
        return self

    @model_validator(mode="after")
    def _ends_within_a_month(self) -> Self:
        length_s = self.excitation.playing_s
        if length_s > LONGEST_S:
            raise ValueError(
                f"one measurement would play for {length_s:.4g} s, allowed are {LONGEST_S:g} s (30 days); "
                "shorten it, or make several of it"
            )
        return self


@dataclass(frozen=True)
class Point:
    """One recording of a campaign."""

    name: str
    """Of its recording, without ``.h5``; different from every other point's."""
    measurement: Measurement
    chain: str = ""
    """Points of one chain follow each other on one branch; empty for a point that stands alone."""
