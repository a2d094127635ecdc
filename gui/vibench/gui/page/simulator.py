"""The window's end of the process that simulates: asks, receives, and drops what nobody wants any more."""

import sys
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.context import SpawnProcess

from PySide6.QtCore import QObject, QTimer

from vibench.analysis.simulation.progress import PartialResult
from vibench.analysis.simulation.worker import Asked, Begin, Cancel, Ended, Grown, Order, serve

if sys.platform == "win32":
    from multiprocessing.connection import PipeConnection as Connection
else:
    from multiprocessing.connection import Connection

POLL_MS = 50
MOST_AT_ONCE = 200
"""Messages taken in one go: a fast answer must not keep the window from drawing."""


class Simulator(QObject):
    """One process for as long as the page lives: to start it once is enough.

    Parameters
    ----------
    page
        What asks.
    grown
        Told pieces of the answer to the last request.
    ended
        Told when the last request has its whole answer.
    died
        Told when the process ended by itself; the next request begins another.

    """

    def __init__(
        self,
        page: QObject,
        grown: Callable[[tuple[PartialResult, ...]], None],
        ended: Callable[[], None],
        died: Callable[[str], None],
    ) -> None:
        super().__init__(page)
        self._grown, self._ended, self._died = grown, ended, died
        page.destroyed.connect(self.close)
        self._process: SpawnProcess | None = None
        self._connection: Connection[Order, Grown | Ended] | None = None
        self._number = 0
        self._is_busy = False
        self._timer = QTimer(self)
        self._timer.setInterval(POLL_MS)
        self._timer.timeout.connect(self._hear)

    @property
    def is_busy(self) -> bool:
        """Whether an answer is still to come."""
        return self._is_busy

    def begin(self, request: Asked) -> None:
        """Ask; the answer to an earlier request is dropped."""
        connection = self._connected()
        self._number += 1
        self._is_busy = True
        connection.send(Begin(self._number, request))
        self._timer.start()

    def cancel(self) -> None:
        """Want no answer any more, from this moment on."""
        self._number += 1
        self._is_busy = False
        if self._connection is not None and self._is_alive():
            self._connection.send(Cancel())

    def close(self) -> None:
        """End the process."""
        self._timer.stop()
        self._is_busy = False
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None

    def _connected(self) -> "Connection[Order, Grown | Ended]":
        if self._connection is None or not self._is_alive():
            self.close()
            context = get_context("spawn")
            self._connection, theirs = context.Pipe()
            self._process = context.Process(target=serve, args=(theirs,), name="simulator", daemon=True)
            self._process.start()
            theirs.close()
        assert self._connection is not None
        return self._connection

    def _is_alive(self) -> bool:
        return self._process is not None and self._process.is_alive()

    def _hear(self) -> None:
        connection = self._connection
        if connection is None:
            return
        try:
            for _ in range(MOST_AT_ONCE):
                if not connection.poll():
                    break
                self._take(connection.recv())
        except (EOFError, OSError):
            was_busy = self._is_busy
            self.close()
            if was_busy:
                self._died("The process that simulates has ended.")
            return
        if not self._is_busy and not connection.poll():
            self._timer.stop()

    def _take(self, message: Grown | Ended) -> None:
        if message.number != self._number:
            return
        match message:
            case Grown():
                self._grown(message.parts)
            case Ended():
                self._is_busy = False
                self._ended()
