"""A heartbeat: tells an engine, from whoever must not freeze unnoticed, that it is alive."""

from contextlib import suppress

from ._address import EngineAddress
from ._connection import connected
from ._state import ConnectionRole
from ._verbs import VERBS
from ._wire import send

READ_BYTES = 1 << 20


class Heartbeat:
    """A connection of its own, on which nothing is wanted and every answer is thrown away.

    Any thread of a viewer may beat, one at a time: a beat takes tens of microseconds and waits for nobody.
    """

    def __init__(self, address: EngineAddress) -> None:
        self._connection = connected(address, ConnectionRole.ATTENDING)
        self._connection.settimeout(0)

    def beat(self, still_s: float = 0.0) -> None:
        """Say that somebody is there; an engine that has gone is noticed by whoever waits for answers.

        ``still_s`` [s]: for how long whoever looks, a window's own thread, has stood still meanwhile.
        """
        with suppress(OSError):  # nothing more to throw away, or the engine has gone
            while self._connection.recv(READ_BYTES):
                continue
        with suppress(OSError):  # it does not read at the moment, or has gone
            send(self._connection, VERBS["beat"].message(still_s=still_s))

    def close(self) -> None:
        """End the connection. Legal at any time."""
        self._connection.close()
