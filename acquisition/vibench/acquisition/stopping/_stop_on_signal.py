"""Ctrl-C, a polite kill and `vibench stop` end a run softly: the first signal asks, the second insists."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from ._program import Program, facts_of_this_process, reached
from ._stop import Cause, StopLevel, StopRequest, StopSwitch

CAUSES = {
    "SIGINT": Cause.KEYBOARD,
    # The second last: Ctrl-Break of Windows; the last: no more time of the processor.
    **dict.fromkeys(("SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK", "SIGXCPU"), Cause.TERMINATED),
}
"""By name, since no system has them all: what would end the program at once, and leave the drive on."""


@contextmanager
def stop_on_signal(switch: StopSwitch, what: str = "a script") -> Iterator[None]:
    """While inside, a stop from outside the program is asked of ``switch``.

    ``vibench stop`` finds the program and leaves its stop in the state folder, whatever thread this is;
    ``what`` is what it is called there. SIGINT, SIGTERM and SIGHUP (the terminal was closed) are stops in
    the main thread, the only one to which Python delivers signals; so is whatever else would end the program
    (`CAUSES`). SIGHUP stays ignored where it was ignored before (nohup): such a run is meant to go on.

    The first ramps down and ends the run as stopped: Ctrl-C as the plan ends, the others faster. A second
    raises KeyboardInterrupt, which silences the generator without the measured ramp. Later ones are
    ignored, so that impatience cannot interrupt the silencing.

    Raises
    ------
    AcquisitionError
        When the state folder cannot be written: nobody could stop what cannot be found.

    """

    def press(level: StopLevel, reason: str) -> None:
        switch.ask(StopRequest(Cause.OPERATOR, level, reason))

    program = Program.model_validate(facts_of_this_process(what))
    with _signals(switch), reached(press, program):
        yield


@contextmanager
def _signals(switch: StopSwitch) -> Iterator[None]:
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

    before = {number: signal.signal(number, on_signal) for number in heeded_signals()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def heeded_signals() -> list[signal.Signals]:
    """Give what ends a program softly: not a SIGHUP that whoever started it has chosen to ignore."""
    known = [signal.Signals[name] for name in CAUSES if name in signal.Signals.__members__]
    return [each for each in known if each.name != "SIGHUP" or signal.getsignal(each) is not signal.SIG_IGN]
