"""The engine's server: loopback, a token, and one thread a connection, which alone may wait for its viewer.

`serving` makes an engine one that others find and ask, with a watchdog that enforces deadlines while the
engine's own thread is at work.
"""

import hmac
import json
import secrets
import socket
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from threading import Event, Thread

from pydantic import ValidationError

from ..errors import AcquisitionError
from ._address import EngineAddress
from ._announcement import announced
from ._connection import Hello
from ._errors import EngineError
from ._request_handler import RequestHandler
from ._state import ConnectionRole
from ._verbs import DONE, REQUEST, VERBS
from ._wire import Message, WireError, receive, send


def answered(handler: RequestHandler, message: Message) -> Message:
    """Do what a message asks for; what is refused comes back as one sentence."""
    try:
        arguments = dict(REQUEST.validate_json(message.text))
        verb = VERBS[arguments.pop("ask")]
        return verb.answer.written(handler.carry_out(verb, arguments))
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(str(part) for part in detail["loc"])
        return refused(
            f"what was asked is not understood ({where}: {detail['msg']}); nothing was done", error
        )
    except AcquisitionError as error:
        return refused(str(error), error)


def refused(sentence: str, error: Exception) -> Message:
    """Say no."""
    return Message(json.dumps({"refused": sentence, "kind": type(error).__name__}).encode())


LOOPBACK = "127.0.0.1"
GREETING_S = 5.0
"""How long a connection may take to say who it is [s]."""


class Server:
    """Answers through a request handler. Nobody is let in without the token."""

    def __init__(self, handler: RequestHandler, host: str = LOOPBACK, port: int = 0) -> None:
        self._handler = handler
        self._token = secrets.token_urlsafe(32)
        self._listening = socket.create_server((host, port))
        Thread(target=self._accept, name="engine server", daemon=True).start()

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
            role = self._let_in(connection)
            if role is None:
                return
            connection.settimeout(None)
            while True:
                message = receive(connection)
                if role is ConnectionRole.ATTENDING:
                    self._handler.note_presence()
                send(connection, answered(self._handler, message))

    def _let_in(self, connection: socket.socket) -> ConnectionRole | None:
        """Say what the connection is for, or turn it away."""
        try:
            hello = Hello.model_validate_json(receive(connection).text)
        except ValidationError:
            hello = Hello(token="")
        if hmac.compare_digest(hello.token.encode(), self._token.encode()):
            if hello.role is ConnectionRole.ATTENDING:
                self._handler.note_presence()
            send(connection, DONE.written(None))
            return hello.role
        send(connection, refused("the token is not this engine's; nobody was let in", EngineError()))
        return None


def spoken(address: EngineAddress) -> str:
    """Put an address into one line of JSON, as an engine's process says it to the one that started it."""
    return json.dumps(address.model_dump())


INTERVAL_S = 0.05
"""How often deadlines are looked at [s]."""


class Watchdog:
    """Lets the request handler enforce its deadlines at every `INTERVAL_S`, until closed."""

    def __init__(self, handler: RequestHandler) -> None:
        self._handler = handler
        self._closing = Event()
        self._thread = Thread(target=self._run, name="engine watchdog", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._closing.wait(INTERVAL_S):
            self._handler.enforce_deadlines()


@contextmanager
def serving(handler: RequestHandler, what: str, host: str = LOOPBACK) -> Iterator[Server]:
    """Serve a request handler; ``what`` is shown to those who look for an engine."""
    with ExitStack() as inside:
        server = inside.enter_context(closing(Server(handler, host)))
        inside.enter_context(closing(Watchdog(handler)))
        inside.enter_context(announced(server.address, what))
        yield server
