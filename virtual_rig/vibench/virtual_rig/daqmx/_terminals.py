"""Terminals of clocks and triggers: what they are called, and which one a task waits for."""

from ._devices import Device
from ._timing import Timing

START_TRIGGER = "StartTrigger"
SAMPLE_CLOCK = "SampleClock"
_OWN_CLOCKS = ("", "onboardclock")


def terminal(device: Device, side: str, signal: str) -> str:
    """Name the terminal of a device's timing engine, ``"/Dev1/ai/StartTrigger"`` for example."""
    return f"/{device.clock_name}/{side}/{signal}"


def awaited_terminal(timing: Timing, own_clock: str) -> str:
    """Name the terminal whose edge makes a task begin; empty: its own start.

    Another task's sample clock begins to tick with that task, so waiting for it is waiting for its start.
    """
    if timing.trigger_source:
        return timing.trigger_source
    source = timing.clock_source.lower()
    is_own = source in _OWN_CLOCKS or source == own_clock.lower()
    return "" if is_own else timing.clock_source.replace(SAMPLE_CLOCK, START_TRIGGER)
