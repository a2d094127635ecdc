"""Ctrl-C and a polite kill end a run softly: the first asks, the second insists."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from .run import Run

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def cancel_on_signal(run: Run) -> Iterator[None]:
    """While inside, SIGINT and SIGTERM cancel ``run``.

    The first ramps down and ends the run as stopped. A second raises KeyboardInterrupt, which
    silences the generator without the measured ramp. Later ones are ignored, so that impatience
    cannot interrupt the silencing. Outside the main thread, where Python delivers no signals,
    nothing is changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []

    def on_signal(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        received.append(number)
        match len(received):
            case 1:
                run.cancel(f"{signal.Signals(number).name}: cancelled from the keyboard or by the system")
            case 2:
                raise KeyboardInterrupt

    before = {number: signal.signal(number, on_signal) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
