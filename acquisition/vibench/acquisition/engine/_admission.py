"""Who is let in: connections that have not shown the token yet are few, brief and small.

One thread reads them all, and holds at most `WAITING_MOST` x 1 kB of what they say. Where there are more, or
the process may open no more files, the one that has waited longest makes room: whoever has the token shows
it at once, and is let in among thousands that have not.
"""

import errno
import hmac
import os
import selectors
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from threading import Thread
from time import monotonic, sleep

from pydantic import ValidationError

from ._connection import Hello
from ._errors import EngineError
from ._state import ConnectionRole
from ._wire import HELLO, IncomingMessage, Message, WireError, refused, send

WAITING_MOST = 64
GREETING_S = 2.0
"""A connection that has not shown the token by then is closed [s]."""
YOUNG_S = 0.01
"""However many come, each may take so long to say who it is [s]."""
_NO_ROOM = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})

Admitted = Callable[[socket.socket, ConnectionRole], None]


@dataclass(frozen=True)
class _Waiting:
    since_s: float
    incoming: IncomingMessage


class Admission:
    """Accepts connections, and hands on those that show the token."""

    def __init__(
        self, listening: socket.socket, token: str, admitted: Admitted, make_room: Callable[[], None]
    ) -> None:
        """``make_room``: closes a connection that was let in before, when there is no other way."""
        self._listening = listening
        self._token = token.encode()
        self._admitted = admitted
        self._make_room = make_room
        self._waiting: dict[socket.socket, _Waiting] = {}  # the longest waiting first
        self._reserve: int | None = None
        self._wake, self._woken = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        listening.setblocking(False)  # noqa: FBT003 - the socket's own parameter
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._selector.register(listening, selectors.EVENT_READ)
        self._thread = Thread(target=self._run, name="engine admission", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Let nobody in any more."""
        with suppress(OSError):
            self._wake.send(b"x")
        self._thread.join()
        self._wake.close()
        self._woken.close()

    def _run(self) -> None:
        while True:
            self._keep_reserve()
            ready = {key.fileobj for key, _ in self._selector.select(self._timeout_s())}
            if self._woken in ready:
                break
            for connection in [each for each in self._waiting if each in ready]:
                self._hear(connection)
            self._turn_away_late_ones()
            if self._listening in ready:
                self._accept()
        for connection in tuple(self._waiting):
            self._turn_away(connection)
        self._selector.close()
        self._give_reserve()

    def _timeout_s(self) -> float | None:
        oldest = next(iter(self._waiting.values()), None)
        return None if oldest is None else max(0.0, oldest.since_s + GREETING_S - monotonic())

    def _accept(self) -> None:
        oldest = next(iter(self._waiting.values()), None)
        if oldest is not None and len(self._waiting) >= WAITING_MOST:
            if monotonic() - oldest.since_s < YOUNG_S:
                sleep(YOUNG_S / 10)  # what they say may be on its way: it is heard first
                return
            self._turn_away(next(iter(self._waiting)))
        try:
            connection, _ = self._accepted()
        except OSError as error:
            if error.errno in _NO_ROOM:
                sleep(YOUNG_S)
            return  # else: whoever came has gone again
        with suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)  # noqa: FBT003 - the socket's own parameter
        self._waiting[connection] = _Waiting(monotonic(), IncomingMessage(HELLO))
        self._selector.register(connection, selectors.EVENT_READ)

    def _accepted(self) -> tuple[socket.socket, object]:
        """Accept the next connection, with the room of what is least needed where there is no other."""
        try:
            return self._listening.accept()
        except OSError as error:
            if error.errno not in _NO_ROOM:
                raise
        if self._waiting:
            self._turn_away(next(iter(self._waiting)))
        elif not self._give_reserve():
            self._make_room()
        return self._listening.accept()

    def _hear(self, connection: socket.socket) -> None:
        incoming = self._waiting[connection].incoming
        try:
            incoming.take(connection.recv(incoming.missing))
        except BlockingIOError:
            return
        except (WireError, OSError):
            self._turn_away(connection)
            return
        if incoming.missing == 0:
            self._judge(connection, incoming.message())

    def _judge(self, connection: socket.socket, message: Message) -> None:
        try:
            hello = Hello.model_validate_json(message.text)
        except ValidationError:
            hello = Hello(token="")
        if not hmac.compare_digest(hello.token.encode(), self._token):
            with suppress(OSError):
                send(connection, refused("the token is not this engine's; nobody was let in", EngineError()))
            self._turn_away(connection)
            return
        self._forget(connection)
        connection.setblocking(True)  # noqa: FBT003 - the socket's own parameter
        self._admitted(connection, hello.role)

    def _turn_away_late_ones(self) -> None:
        late_s = monotonic() - GREETING_S
        for connection in [each for each, waiting in self._waiting.items() if waiting.since_s <= late_s]:
            self._turn_away(connection)

    def _turn_away(self, connection: socket.socket) -> None:
        self._forget(connection)
        connection.close()

    def _forget(self, connection: socket.socket) -> None:
        self._selector.unregister(connection)
        del self._waiting[connection]

    def _keep_reserve(self) -> None:
        """Hold a descriptor that a connection can be given when the process may open no more."""
        if self._reserve is None:
            with suppress(OSError):
                self._reserve = os.open(os.devnull, os.O_RDONLY)

    def _give_reserve(self) -> bool:
        if self._reserve is None:
            return False
        os.close(self._reserve)
        self._reserve = None
        return True
