"""The process that simulates for a window: it computes one request after another, and can be told to stop."""

import os
import signal
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection

from ._answers import Piece, Trouble
from ._growing import simulate
from ._request import SimulationRequest


@dataclass(frozen=True)
class Begin:
    """Compute this; what was being computed is dropped."""

    number: int
    request: SimulationRequest


@dataclass(frozen=True)
class Cancel:
    """Compute nothing any more."""


@dataclass(frozen=True)
class Grown:
    """More of an answer."""

    number: int
    pieces: tuple[Piece, ...]


@dataclass(frozen=True)
class Ended:
    """There is no more of an answer; it was cancelled, or it is complete."""

    number: int


Order = Begin | Cancel


def serve(connection: "Connection[Grown | Ended, Order]") -> None:
    """Obey until the other end is closed."""
    # Ctrl-C belongs to whoever began this process, and ends it by closing the connection.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError):
        os.nice(5)  # A window, and a measurement, come first.
    waiting: Begin | None = None
    with suppress(EOFError, BrokenPipeError):
        while True:
            match waiting or connection.recv():
                case Begin() as begin:
                    waiting = _computed(connection, begin)
                case Cancel():
                    waiting = None


def _computed(connection: "Connection[Grown | Ended, Order]", begin: Begin) -> Begin | None:
    """Compute one request; gives the next, when it came meanwhile."""
    following: Begin | None = None
    is_over = False

    def is_cancelled() -> bool:
        nonlocal following, is_over
        while connection.poll():
            order = connection.recv()
            following = order if isinstance(order, Begin) else None
            is_over = True
        return is_over

    def tell(pieces: tuple[Piece, ...]) -> None:
        connection.send(Grown(begin.number, pieces))

    try:
        simulate(begin.request, tell, is_cancelled)
    except ValueError as error:
        tell((Trouble(str(error)),))
    connection.send(Ended(begin.number))
    return following
