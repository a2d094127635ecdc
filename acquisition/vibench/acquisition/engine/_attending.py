"""``python -m vibench.acquisition.engine._attending``: process of an `Attendant`, with few imports.

On its standard input, the process receives a line with the engine's address, then one byte whenever the
parent program shows that it is responsive. The process ends with the parent program.
"""

import json
import os
import socket
import sys
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from time import monotonic

from ._wire import ANSWERS, Message, receive, send

BEAT_S = 0.04
"""Interval between heartbeats to the engine [s]."""
STOPPED = ("T", "t", "Z", "X")
"""State letters in ``/proc`` of a suspended or dead process (Linux)."""
LEAST_OWN = 0.25
"""Smallest counted fraction of the time without input bytes; the rest may be waits for a processor."""


class _Program:
    """State of the parent program, from its bytes on the standard input and from ``/proc``."""

    def __init__(self) -> None:
        self._folder = Path(f"/proc/{os.getppid()}")
        self._lived_s, self._own_s = monotonic(), 0.0
        self._seen_s = (self._lived_s, self._lived_s, self._processor_s)
        Thread(target=self._follow, name="follow program", daemon=True).start()

    def still_s(self) -> float:
        """Return how long the program has sent no byte [s], excluding its waits for a processor.

        In state R (runnable), only its processor time counts: Linux reports a wait only when it is over.
        """
        lived_s = self._lived_s  # before reading the clock: a byte may arrive meanwhile
        now_s, worked_s = monotonic(), self._processor_s
        seen_s, lived_then_s, worked_then_s = self._seen_s
        self._seen_s = (now_s, lived_s, worked_s)
        if lived_s != lived_then_s:
            self._own_s = 0.0
        passed_s = now_s - max(seen_s, lived_s)
        self._own_s += min(passed_s, worked_s - worked_then_s) if self._state == "R" else passed_s
        return max(self._own_s, LEAST_OWN * (now_s - lived_s))

    @property
    def is_stopped(self) -> bool:
        return self._state in STOPPED

    @property
    def _state(self) -> str:
        return self._read_proc("stat").rpartition(") ")[2][:1]

    @property
    def _processor_s(self) -> float:
        return 1e-9 * int((self._read_proc("schedstat").split() or ["0"])[0])

    def _read_proc(self, name: str) -> str:
        try:
            return (self._folder / name).read_text()
        except OSError:
            return ""

    def _follow(self) -> None:
        while os.read(sys.stdin.fileno(), 65536):
            self._lived_s = monotonic()
        os._exit(0)  # exit at once, although the other thread still waits


def main() -> None:
    """Send heartbeats until the engine or the parent program has ended."""
    message = json.loads(sys.stdin.buffer.readline())
    program, clock = _Program(), Event()
    with suppress(OSError), socket.create_connection(message["address"]) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _exchange(connection, message["hello"])
        while True:
            if not program.is_stopped:
                _exchange(connection, json.dumps({"ask": "beat", "still_s": program.still_s()}))
            clock.wait(BEAT_S)


def _exchange(connection: socket.socket, text: str) -> None:
    send(connection, Message(text.encode()))
    receive(connection, ANSWERS)


if __name__ == "__main__":
    main()
