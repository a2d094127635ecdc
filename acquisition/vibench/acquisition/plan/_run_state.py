"""The states of a run."""

from enum import StrEnum


class RunState(StrEnum):
    """Where a run stands.

    ::

        idle -> checking -> armed -> ramping_up -> settling -> recording -> ramping_down -> finished
                    |          |          ^            (next waveform)           |
                    |          |          +--------------------------------------+
                    |          |     (held: any of these stays as it is for a while)
                    |          +-> ramping_down -> stopped    (asked to stop)
                    +-> failed <- from every state            (limit, check, driver, disk)

    From ``armed`` to ``ramping_down`` the generator's output may be on; in every other state it is off,
    but for the low-level part of ``checking``.
    """

    IDLE = "idle"
    CHECKING = "checking"
    ARMED = "armed"
    RAMPING_UP = "ramping_up"
    SETTLING = "settling"
    RECORDING = "recording"
    HELD = "held"
    RAMPING_DOWN = "ramping_down"
    FINISHED = "finished"
    STOPPED = "stopped"
    FAILED = "failed"
