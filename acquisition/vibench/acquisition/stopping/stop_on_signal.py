"""Every signal that would end or stop a program is a stop of its run: the first asks, the second insists."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from .program import Program, facts_of_this_process, reached
from .stop import Cause, StopLevel, StopRequest, StopSwitch

LEFT_TO_THE_DEAD_MAN = ("SIGKILL", "SIGSTOP", "SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL")
"""No program can catch the first two; the others repeat the faulty instruction after any handler."""
_HARMLESS = ("SIGCHLD", "SIGCLD", "SIGURG", "SIGWINCH", "SIGCONT", "SIGINFO")
"""By default these neither end nor stop a process."""
_PAUSES = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
"""Stop a process, as Ctrl-Z does; a terminal sends the last two again and again."""
_ALWAYS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK", "SIGXCPU")
"""Always heeded; other signals are heeded only if the program does not handle them."""


@contextmanager
def stop_on_signal(switch: StopSwitch, what: str = "a script") -> Iterator[None]:
    """While inside, a stop from outside the program is asked of ``switch``.

    ``vibench stop`` finds the program and leaves its stop in the state folder, whatever thread this is;
    ``what`` is what it is called there. In the main thread, the only one to which Python delivers signals,
    every signal is a stop that would end or stop the program (`heeded_signals`). SIGHUP stays ignored where
    it was ignored before (nohup): such a run is meant to go on.

    The first ramps down and ends the run as stopped: Ctrl-C as the plan ends, the others faster. A second
    raises KeyboardInterrupt, which silences the generator without the measured ramp. Later ones are
    ignored, so that impatience cannot interrupt the silencing; so is a second Ctrl-Z.

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
        name = signal_name(number)
        if name in _PAUSES:
            signal.signal(number, signal.SIG_IGN)
        received.append(number)
        match len(received):
            case 1:
                cause = Cause.KEYBOARD if name == "SIGINT" else Cause.TERMINATED
                switch.ask(StopRequest.by(cause, f"{name}: stopped from the keyboard or by the system"))
            case 2:
                raise KeyboardInterrupt

    before = {number: signal.signal(number, on_signal) for number in heeded_signals()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def signal_name(number: int) -> str:
    """Return the name of a signal; real-time signals have only a number."""
    known = {each.value: each.name for each in signal.Signals}
    return known.get(number, f"signal {number}")


def heeded_signals() -> list[int]:
    """Return the signals that are stops while something drives: those that would end or stop the process.

    A signal that the program handles itself, or ignores, does neither. Those in `LEFT_TO_THE_DEAD_MAN` cannot
    be heeded.
    """
    return [number for number in sorted(signal.valid_signals()) if _is_heeded(number)]


def _is_heeded(number: int) -> bool:
    name, handler = signal_name(number), signal.getsignal(number)
    if name in LEFT_TO_THE_DEAD_MAN or name in _HARMLESS:
        return False
    if name in _ALWAYS:
        return name != "SIGHUP" or handler is not signal.SIG_IGN
    # A handler of this module belongs to a run around this one, with another switch.
    return handler is signal.SIG_DFL or getattr(handler, "__module__", "") == __name__
