"""Outcome of a simulation: a value, not an exception. Its text tells the user what to change."""

from enum import IntEnum

_TEXTS = (
    "reached the end time",
    "more impacts than allowed: raise max_impact_rate_hz, cut runs of over 6e7 impacts, or suspect chatter",
    "the motion overflows or loses all its digits: lower the drive, or check the specimen's numbers",
    "a contact made no progress: start less deep in a stop, request less accuracy, or check the specimen",
    "more steps than allowed: a mode is very fast; check masses and stiffnesses, or run shorter",
)


class Outcome(IntEnum):
    """The codes that the engine returns."""

    REACHED_END = 0
    TOO_MANY_IMPACTS = 1
    NOT_FINITE = 2
    STALLED = 3
    TOO_LONG = 4

    @property
    def text(self) -> str:
        """What happened and what to change, for the user."""
        return _TEXTS[self]
