"""How fast a bench's feedback acts: what tells which unstable motions it can hold."""

from ..rig import Rig

LOOK_S = 0.2
"""Time between two looks of the feedback at the motion [s]; ten periods at least."""
LOOK_PERIODS = 10
_COMMANDS = 2
"""For one change of the drive: amplitude and frequency."""


def look_s(frequency_hz: float) -> float:
    """Return the time over which the feedback looks at a motion before it acts [s]."""
    return max(LOOK_S, LOOK_PERIODS / frequency_hz)


def loop_time_s(rig: Rig, frequency_hz: float) -> float:
    """Give the time from a motion to the drive that answers it: a look, and the generator's commands [s]."""
    return look_s(frequency_hz) + _COMMANDS * rig.generator.settle_s
