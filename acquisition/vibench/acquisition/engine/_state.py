"""Where an engine stands, and whether its run is supervised."""

from enum import StrEnum


class EngineState(StrEnum):
    """Where an engine stands.

    ::

        closed -> opening -> ready -> armed -> running -> ready
                    |        |  ^               |    ^
                    |        v  |               v    |
                    |       checking           held -+     (and ramping_down, on every way out)
                    +-> fault <- an instrument was lost: open again
    """

    CLOSED = "closed"
    OPENING = "opening"
    READY = "ready"
    CHECKING = "checking"
    ARMED = "armed"
    RUNNING = "running"
    HELD = "held"
    RAMPING_DOWN = "ramping_down"
    FAULT = "fault"


DRIVING = frozenset({EngineState.RUNNING, EngineState.HELD, EngineState.RAMPING_DOWN})
"""The drive may be on, for a recording."""
SOUNDING = DRIVING | {EngineState.CHECKING}
"""The drive may be on, if only for the small sine of a check."""


class Supervision(StrEnum):
    """Whether a run needs somebody who looks."""

    ATTENDED = "attended"
    """Nobody has asked for `VIEWER_PATIENCE_S`: the run is aborted."""
    UNATTENDED = "unattended"
    """A campaign that is left alone: viewers may come and go."""


class ConnectionRole(StrEnum):
    """What a connection is for."""

    ATTENDING = "attending"
    """Whoever answers for the run: it goes on only while this one asks."""
    VISITING = "visiting"
    """A look from elsewhere: it keeps nothing running."""


VIEWER_PATIENCE_S = 0.5
"""How long an attended run goes on while nobody asks [s]."""
