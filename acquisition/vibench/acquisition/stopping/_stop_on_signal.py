"""Ctrl-C and a polite kill end a run softly: the first asks, the second insists."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from ._stop import Cause, StopRequest, StopSwitch

CAUSES = {"SIGINT": Cause.KEYBOARD, "SIGTERM": Cause.TERMINATED, "SIGHUP": Cause.TERMINATED}
"""By name, since Windows has no SIGHUP."""


@contextmanager
def stop_on_signal(switch: StopSwitch) -> Iterator[None]:
    """While inside, SIGINT, SIGTERM and SIGHUP (the terminal was closed) ask ``switch`` for a stop.

    SIGHUP stays ignored where it was ignored before (nohup): such a run is meant to go on.

    The first ramps down and ends the run as stopped: Ctrl-C as the plan ends, the others faster. A second
    raises KeyboardInterrupt, which silences the generator without the measured ramp. Later ones are
    ignored, so that impatience cannot interrupt the silencing. Outside the main thread, where Python
    delivers no signals, nothing is changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []

    def on_signal(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        received.append(number)
        name = signal.Signals(number).name
        match len(received):
            case 1:
                switch.ask(
                    StopRequest.by(CAUSES[name], f"{name}: stopped from the keyboard or by the system")
                )
            case 2:
                raise KeyboardInterrupt

    before = {number: signal.signal(number, on_signal) for number in _heeded()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _heeded() -> list[signal.Signals]:
    """All but a SIGHUP that whoever started the program has chosen to ignore."""
    known = [signal.Signals[name] for name in CAUSES if name in signal.Signals.__members__]
    return [each for each in known if each.name != "SIGHUP" or signal.getsignal(each) is not signal.SIG_IGN]
