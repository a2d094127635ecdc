"""The engine's server: loopback, a token, and one thread a connection, which alone may wait for its viewer.

`serving` makes an engine one that others find and ask, with a watchdog that enforces deadlines while the
engine's own thread is at work.
"""

import json
import secrets
import socket
from _thread import start_new_thread
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from threading import Lock
from time import monotonic

from pydantic import ValidationError

from ..errors import AcquisitionError
from ..stopping.watchdog import Watchdog
from ._address import EngineAddress
from ._admission import Admission
from ._announcement import announced
from ._request_handler import RequestHandler
from ._state import ConnectionRole
from ._verbs import DONE, REQUEST, VERBS
from ._wire import REQUESTS, Message, receive, refused, send


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


LOOPBACK = "127.0.0.1"
VIEWERS_MOST = 16
"""With one more, the one that has asked nothing for longest is let go: a frozen one holds 20 MB."""
REQUEST_S = 10.0
"""How long a request may take, from its first byte to its last [s]."""


@dataclass
class _Viewer:
    connection: socket.socket
    role: ConnectionRole
    asked_s: float


class Server:
    """Answers through a request handler. Nobody is let in without the token."""

    def __init__(self, handler: RequestHandler, host: str = LOOPBACK, port: int = 0) -> None:
        self._handler = handler
        self._token = secrets.token_urlsafe(32)
        self._viewers: dict[int, _Viewer] = {}
        self._coming_and_going = Lock()
        self._listening = socket.create_server((host, port))
        self._admission = Admission(self._listening, self._token, self._welcome, self._make_room)

    @property
    def address(self) -> EngineAddress:
        """Where it listens."""
        host, port = self._listening.getsockname()[:2]
        return EngineAddress(host=host, port=port, token=self._token)

    def close(self) -> None:
        """Let nobody in any more."""
        self._admission.close()
        self._listening.close()

    def _welcome(self, connection: socket.socket, role: ConnectionRole) -> None:
        """Serve a viewer that has shown the token, in a thread of its own."""
        viewer = _Viewer(connection, role, monotonic())
        with self._coming_and_going:
            self._viewers[id(viewer)] = viewer
            surplus = len(self._viewers) - VIEWERS_MOST
        if surplus > 0:
            self._make_room()
        try:
            # Does not wait until it runs, as Thread.start does: for ever, where memory is exhausted.
            start_new_thread(self._serve, (viewer,))
        except RuntimeError:  # the system gives no more threads
            self._leave(viewer)

    def _make_room(self) -> None:
        """Let go of who has asked nothing for longest; of one that attends only if there is no other."""
        with self._coming_and_going:
            viewers = sorted(
                self._viewers.values(),
                key=lambda each: (each.role is ConnectionRole.ATTENDING, each.asked_s),
            )
        if viewers:
            # Wakes its thread, wherever that waits; closing alone would not.
            with suppress(OSError):
                viewers[0].connection.shutdown(socket.SHUT_RDWR)

    def _leave(self, viewer: _Viewer) -> None:
        with self._coming_and_going:
            self._viewers.pop(id(viewer), None)
        viewer.connection.close()

    def _serve(self, viewer: _Viewer) -> None:
        """Answer one viewer until it goes. A viewer that does not read blocks this thread, and no other."""
        try:
            self._note(viewer)
            send(viewer.connection, DONE.written(None))
            while True:
                message = receive(viewer.connection, REQUESTS, REQUEST_S)
                self._note(viewer)
                send(viewer.connection, answered(self._handler, message))
        except OSError:  # it has gone, or does not speak this protocol
            pass
        finally:
            self._leave(viewer)

    def _note(self, viewer: _Viewer) -> None:
        viewer.asked_s = monotonic()
        if viewer.role is ConnectionRole.ATTENDING:
            self._handler.note_presence()


def spoken(address: EngineAddress) -> str:
    """Put an address into one line of JSON, as an engine's process says it to the one that started it."""
    return json.dumps(address.model_dump())


@contextmanager
def serving(handler: RequestHandler, what: str, host: str = LOOPBACK) -> Iterator[Server]:
    """Serve a request handler at ``host``; ``what`` is shown to those who look for an engine.

    Raises
    ------
    AcquisitionError
        When the state folder cannot be written: nobody could stop what cannot be found.

    """
    with ExitStack() as inside:
        server = inside.enter_context(closing(Server(handler, host)))
        inside.enter_context(closing(Watchdog(handler.enforce_deadlines, "engine watchdog")))
        inside.enter_context(announced(server.address, what, handler.stop))
        yield server
