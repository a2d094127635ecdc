"""The engine's watchman: looks after attendance while the engine's own thread is at work."""

from threading import Event, Thread

from ._request_handler import Desk

INTERVAL_S = 0.05
"""How often attendance is looked at [s]."""


class Watch:
    """Lets a desk look after its engine at every `INTERVAL_S`, until closed."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._closing = Event()
        self._thread = Thread(target=self._run, name="engine watch", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._closing.wait(INTERVAL_S):
            self._desk.look_after()
