"""Ctrl-C as a request: what is under way comes to its end and is kept. A second one ends the program."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def watch_interrupt() -> Iterator[Callable[[], bool]]:
    """Give a question: whether Ctrl-C has been pressed since."""
    before = signal.getsignal(signal.SIGINT)
    pressed: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        pressed.append(number)
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(pressed)
    finally:
        signal.signal(signal.SIGINT, before)
