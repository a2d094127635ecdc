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
    """Nobody has asked for too long (`patience_s`): the run is aborted."""
    UNATTENDED = "unattended"
    """A campaign that is left alone: viewers may come and go."""


class ConnectionRole(StrEnum):
    """What a connection is for."""

    ATTENDING = "attending"
    """Whoever answers for the run: it goes on only while this one asks."""
    VISITING = "visiting"
    """A look from elsewhere: it keeps nothing running."""


VIEWER_PATIENCE_S = 0.5
"""How long an attended run at a limit of the rig goes on while nobody asks [s]."""
LONGEST_PATIENCE_S = 10.0
"""More cannot be granted to any drive [s]."""
HUNG_FACTOR = 4.0
"""A viewer that is there and says that its window stands still is given so many times the patience."""


def hung_patience_s(granted_s: float) -> float:
    """How long a drive may go on while a window stands still that is granted ``granted_s`` in silence [s]."""
    return min(HUNG_FACTOR * granted_s, LONGEST_PATIENCE_S)


def patience_s(longest_s: float, use: float) -> float:
    """How long a drive may go on while nobody looks: the closer to a limit, the shorter [s].

    ``use`` is the share of the tightest limit; ``longest_s`` [s] is what was granted far from all of them.
    """
    return max(VIEWER_PATIENCE_S, min(longest_s, VIEWER_PATIENCE_S / max(use, 1e-9)))
