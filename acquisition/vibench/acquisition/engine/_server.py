"""The engine's door: loopback, a token, and one thread a connection, which alone may wait for its viewer."""

import hmac
import json
import secrets
import socket
from contextlib import suppress
from threading import Thread

from pydantic import ValidationError

from . import _requests as ask
from ._address import EngineAddress
from ._answers import DONE, answered, refused
from ._errors import EngineError
from ._request_handler import Desk
from ._state import Visit
from ._wire import WireError, receive, send

LOOPBACK = "127.0.0.1"
GREETING_S = 5.0
"""How long a connection may take to say who it is [s]."""


class Server:
    """Answers for a desk. Nobody is let in without the token, from this computer or another."""

    def __init__(self, desk: Desk, host: str = LOOPBACK, port: int = 0) -> None:
        self._desk = desk
        self._token = secrets.token_urlsafe(32)
        self._listening = socket.create_server((host, port))
        Thread(target=self._accept, name="engine door", daemon=True).start()

    @property
    def address(self) -> EngineAddress:
        """Where it listens."""
        host, port = self._listening.getsockname()[:2]
        return EngineAddress(host=host, port=port, token=self._token)

    def close(self) -> None:
        """Let nobody in any more."""
        self._listening.close()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listening.accept()
            except OSError:  # closed
                return
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            Thread(target=self._serve, args=(connection,), name="engine viewer", daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        """Answer one viewer until it goes. A viewer that does not read blocks this thread, and no other."""
        with connection, suppress(WireError, OSError):
            connection.settimeout(GREETING_S)
            visit = self._let_in(connection)
            if visit is None:
                return
            connection.settimeout(None)
            while True:
                message = receive(connection)
                if visit is Visit.ATTENDING:
                    self._desk.heard()
                send(connection, answered(self._desk, message))

    def _let_in(self, connection: socket.socket) -> Visit | None:
        """Say what the connection is for, or turn it away."""
        try:
            hello = ask.Hello.model_validate_json(receive(connection).text)
        except ValidationError:
            hello = ask.Hello(token="")
        if hmac.compare_digest(hello.token.encode(), self._token.encode()):
            if hello.visit is Visit.ATTENDING:
                self._desk.heard()
            send(connection, DONE)
            return hello.visit
        send(connection, refused("the token is not this engine's; nobody was let in", EngineError()))
        return None


def spoken(address: EngineAddress) -> str:
    """Put an address into one line of JSON, as an engine's process says it to the one that started it."""
    return json.dumps(address.model_dump())
