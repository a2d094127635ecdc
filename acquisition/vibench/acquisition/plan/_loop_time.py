"""Delay of a bench's feedback, which limits the unstable motions that feedback can hold (decision 0065)."""

from ..rig import Rig

LOOK_S = 0.2
"""Averaging time of one measurement by the feedback loop [s]; longer if ten periods take longer."""
LOOK_PERIODS = 10
_COMMANDS = 2
"""Number of generator commands per change of the drive: amplitude and frequency."""


def look_s(frequency_hz: float) -> float:
    """Return the averaging time of one measurement by the feedback loop [s]."""
    return max(LOOK_S, LOOK_PERIODS / frequency_hz)


def loop_time_s(rig: Rig, frequency_hz: float) -> float:
    """Return the delay from a motion to the corrected drive: averaging and generator commands [s]."""
    return look_s(frequency_hz) + _COMMANDS * rig.generator.settle_s
