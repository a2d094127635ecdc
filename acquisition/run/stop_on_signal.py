"""Ctrl-C and a polite kill end a run softly: the first asks, the second insists."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from .stop import Cause, StopRequest, StopSwitch

CAUSES = {signal.SIGINT: Cause.KEYBOARD, signal.SIGTERM: Cause.TERMINATED}
if hasattr(signal, "SIGHUP"):  # Windows has none
    CAUSES[signal.SIGHUP] = Cause.TERMINATED


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
                cause = CAUSES[signal.Signals(number)]
                switch.ask(StopRequest.by(cause, f"{name}: stopped from the keyboard or by the system"))
            case 2:
                raise KeyboardInterrupt

    heeded = [number for number in CAUSES if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, on_signal) for number in heeded}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
