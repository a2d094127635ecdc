"""A heartbeat: tells an engine, from whoever must not freeze unnoticed, that it is alive; waits for
nothing.
"""

import socket
from contextlib import suppress

from . import _requests as ask
from ._address import EngineAddress
from ._client import PATIENCE_S
from ._errors import EngineGone
from ._state import ConnectionRole
from ._wire import Message, receive, send

READ_BYTES = 1 << 20
_BEAT = Message(ask.Beat().model_dump_json().encode())


class Heartbeat:
    """A connection of its own, on which nothing is wanted and every answer is thrown away.

    A viewer's thread that paints can beat at any time: a beat takes some ten microseconds, takes no lock
    and lets no other thread in between.
    """

    def __init__(self, address: EngineAddress) -> None:
        hello = ask.Hello(token=address.token, role=ConnectionRole.ATTENDING)
        try:
            self._connection = socket.create_connection((address.host, address.port), PATIENCE_S)
            send(self._connection, Message(hello.model_dump_json().encode()))
            receive(self._connection)
        except OSError as error:
            raise EngineGone(
                f"no engine answers at {address.host}:{address.port} ({error}); start one, or see whether it "
                "has ended"
            ) from error
        self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
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
