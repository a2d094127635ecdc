"""What is tried again, and how often, when nobody is there to ask."""

from enum import StrEnum

from pydantic import Field, NonNegativeFloat, PositiveInt

from ..host import FrozenModel


class Retryable(StrEnum):
    """Failures that another attempt may mend."""

    DATA_LOST = "data_lost"
    """Samples were overwritten before they were read."""
    INSTRUMENT_LOST = "instrument_lost"
    """Cable, power or server gone: the bench is closed and opened again first."""
    INSTRUMENT_FAULT = "instrument_fault"
    """An instrument refused a command, or is held by another program; the bench is opened again first."""
    CHECK_FAILED = "check_failed"
    """The bench did not answer at low level as it should."""
    LIMIT = "limit"
    """A measured value passed a limit."""
    OVER_RANGE = "over_range"
    """The recording is complete, but an input was near its full scale while it counted."""


class RetryPolicy(FrozenModel):
    """How often a point is tried, and after which failures."""

    attempts: PositiveInt = Field(default=1, le=100)
    """At each point, the first one included; every attempt is a file of its own."""
    on: tuple[Retryable, ...] = (Retryable.DATA_LOST, Retryable.INSTRUMENT_LOST, Retryable.INSTRUMENT_FAULT)
    reopen_for_s: NonNegativeFloat = Field(default=60.0, le=86400)
    """How long a lost instrument is looked for before the campaign ends [s]."""
