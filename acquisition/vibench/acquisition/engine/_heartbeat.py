"""A heartbeat: tells an engine, from whoever must not freeze unnoticed, that it is alive."""

from contextlib import suppress

from ._address import EngineAddress
from ._connection import connected
from ._state import ConnectionRole
from ._verbs import VERBS
from ._wire import send

READ_BYTES = 1 << 20
_BEAT = VERBS["beat"].message()


class Heartbeat:
    """A connection of its own, on which nothing is wanted and every answer is thrown away.

    A viewer's thread that paints can beat at any time: a beat takes some ten microseconds, takes no lock
    and lets no other thread in between.
    """

    def __init__(self, address: EngineAddress) -> None:
        self._connection = connected(address, ConnectionRole.ATTENDING)
        self._connection.settimeout(0)

    def beat(self) -> None:
        """Say that somebody is there; an engine that has gone is noticed by whoever waits for answers."""
        with suppress(OSError):  # nothing more to throw away, or the engine has gone
            while self._connection.recv(READ_BYTES):
                continue
        with suppress(OSError):  # it does not read at the moment, or has gone
            send(self._connection, _BEAT)

    def close(self) -> None:
        """End the connection. Legal at any time."""
        self._connection.close()
