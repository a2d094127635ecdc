"""Outcome of a simulation with advice for the user; returned as a value, not raised as an exception."""

from enum import IntEnum

_TEXTS = (
    "reached the end time",
    "more impacts than allowed: raise max_impact_rate_hz, shorten the run, or look for chatter",
    "the motion overflows or loses all its digits: lower the drive, or check the specimen's numbers",
    "a contact made no progress: start less deep in a stop, request less accuracy, or check the specimen",
    "more steps than allowed: a mode is very fast; check masses and stiffnesses, or run shorter",
)


class Outcome(IntEnum):
    """Outcome of a run, with the codes of the engine."""

    REACHED_END = 0
    TOO_MANY_IMPACTS = 1
    NOT_FINITE = 2
    STALLED = 3
    TOO_LONG = 4

    @property
    def text(self) -> str:
        """Description of the outcome and advice for the user."""
        return _TEXTS[self]
