"""The engine's server: on loopback, with a token, and a thread for each connection.

`serving` makes an engine visible to other programs, with a watchdog that enforces deadlines while the
engine's own thread is busy.
"""

import errno
import hmac
import secrets
import selectors
import socket
from _thread import start_new_thread
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from functools import reduce
from operator import or_
from threading import Lock, Thread
from time import monotonic, sleep
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from ..errors import AcquisitionError
from ..host.toml_file import FrozenModel
from ..stopping.program import Watchdog
from ..stopping.stop import DescriptorReserve
from ._client import EngineAddress, Hello, announce
from ._request_handler import RequestHandler
from ._status import ConnectionRole
from ._verbs import VERBS, answer_message
from ._wire import HELLO, REQUESTS, EngineError, IncomingMessage, Message, WireError, receive, refusal, send

# Admission: connections without the token are limited in number, time and size.
# One thread reads them all and buffers at most `WAITING_MOST` x 1 kB. If there are more connections, or the
# process cannot open more files, the connection that has waited longest is closed. A client with the token
# sends it at once, so it is admitted even among thousands of clients without a token.

WAITING_MOST = 64
GREETING_S = 2.0
"""Time after which a connection that has not shown the token is closed [s]."""
YOUNG_S = 0.01
"""Shortest time that a connection has to show the token, even if there are many connections [s]."""
_NO_ROOM = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})

Admitted = Callable[[socket.socket, ConnectionRole], None]


@dataclass(frozen=True)
class _Waiting:
    since_s: float
    incoming: IncomingMessage


class Admission:
    """Admission of connections: passes on the connections that show the token."""

    def __init__(
        self, listening: socket.socket, token: str, admitted: Admitted, make_room: Callable[[], None]
    ) -> None:
        """Accept connections; if no file descriptor is left, ``make_room`` closes an admitted connection."""
        self._listening = listening
        self._token = token.encode()
        self._admitted = admitted
        self._make_room = make_room
        self._waiting: dict[socket.socket, _Waiting] = {}  # ordered from the oldest to the newest
        self._reserve = DescriptorReserve()
        self._wake, self._woken = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        listening.setblocking(False)  # noqa: FBT003 - the socket's own parameter
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._selector.register(listening, selectors.EVENT_READ)
        self._thread = Thread(target=self._run, name="engine admission", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop accepting connections."""
        with suppress(OSError):
            self._wake.send(b"x")
        self._thread.join()
        self._wake.close()
        self._woken.close()

    def _run(self) -> None:
        while True:
            # Reserve a file descriptor: a connection can use it when the limit of open files is reached.
            with suppress(OSError):
                self._reserve.hold()
            ready = {key.fileobj for key, _ in self._selector.select(self._timeout_s())}
            if self._woken in ready:
                break
            for connection in [each for each in self._waiting if each in ready]:
                self._receive(connection)
            self._turn_away_late_ones()
            if self._listening in ready:
                self._accept()
        for connection in tuple(self._waiting):
            self._turn_away(connection)
        self._selector.close()
        self._reserve.release()

    def _timeout_s(self) -> float | None:
        oldest = next(iter(self._waiting.values()), None)
        return None if oldest is None else max(0.0, oldest.since_s + GREETING_S - monotonic())

    def _accept(self) -> None:
        oldest = next(iter(self._waiting.values()), None)
        if oldest is not None and len(self._waiting) >= WAITING_MOST:
            if monotonic() - oldest.since_s < YOUNG_S:
                sleep(YOUNG_S / 10)  # first read what the waiting clients may have sent
                return
            self._turn_away(next(iter(self._waiting)))
        try:
            connection, _ = self._accept_client()
        except OSError as error:
            if error.errno in _NO_ROOM:
                sleep(YOUNG_S)
            return  # otherwise the client has closed the connection
        with suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)  # noqa: FBT003 - the socket's own parameter
        self._waiting[connection] = _Waiting(monotonic(), IncomingMessage(HELLO))
        self._selector.register(connection, selectors.EVENT_READ)

    def _accept_client(self) -> tuple[socket.socket, object]:
        """Accept the next connection; if no file descriptor is left, close the least important connection."""
        try:
            return self._listening.accept()
        except OSError as error:
            if error.errno not in _NO_ROOM:
                raise
        if self._waiting:
            self._turn_away(next(iter(self._waiting)))
        elif not self._reserve.release():
            self._make_room()
        return self._listening.accept()

    def _receive(self, connection: socket.socket) -> None:
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
                send(
                    connection,
                    refusal("the token is not valid here; the connection was closed", EngineError()),
                )
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


_REQUESTS: Any = Annotated[reduce(or_, (verb.request for verb in VERBS.values())), Field(discriminator="ask")]
REQUEST: TypeAdapter[FrozenModel] = TypeAdapter(_REQUESTS, config=FrozenModel.model_config)
"""Validator of the JSON text of a request."""


def answer_to(handler: RequestHandler, message: Message) -> Message:
    """Carry out the request in a message, and return the answer, or one sentence if the engine refuses."""
    try:
        arguments = dict(REQUEST.validate_json(message.text))
        verb = VERBS[arguments.pop("ask")]
        return answer_message(handler.carry_out(verb, arguments))
    except ValidationError as error:
        detail = error.errors()[0]
        where = ".".join(str(part) for part in detail["loc"])
        return refusal(f"the request is not valid ({where}: {detail['msg']}); nothing was done", error)
    except AcquisitionError as error:
        return refusal(str(error), error)


LOOPBACK = "127.0.0.1"
VIEWERS_MOST = 16
"""Largest number of viewers (20 MB each if they do not read); one more replaces the longest silent one."""
REQUEST_S = 10.0
"""Time limit for receiving a request, from its first byte to its last [s]."""


@dataclass
class _Viewer:
    connection: socket.socket
    role: ConnectionRole
    request_s: float


class Server:
    """Server that answers requests through a request handler; every connection needs the token."""

    def __init__(self, handler: RequestHandler, host: str = LOOPBACK) -> None:
        self._handler = handler
        self._token = secrets.token_urlsafe(32)
        self._viewers: dict[int, _Viewer] = {}
        self._coming_and_going = Lock()
        self._listening = socket.create_server((host, 0))
        self._admission = Admission(self._listening, self._token, self._welcome, self._make_room)

    @property
    def address(self) -> EngineAddress:
        """Address and token of the server."""
        host, port = self._listening.getsockname()[:2]
        return EngineAddress(host=host, port=port, token=self._token)

    def close(self) -> None:
        """Stop accepting connections."""
        self._admission.close()
        self._listening.close()

    def _welcome(self, connection: socket.socket, role: ConnectionRole) -> None:
        """Serve a viewer that has shown the token, in its own thread."""
        viewer = _Viewer(connection, role, monotonic())
        with self._coming_and_going:
            self._viewers[id(viewer)] = viewer
            surplus = len(self._viewers) - VIEWERS_MOST
        if surplus > 0:
            self._make_room()
        try:
            # Do not use Thread.start, which waits until the thread runs: without free memory, for ever.
            start_new_thread(self._serve, (viewer,))
        except RuntimeError:  # the system refuses further threads
            self._leave(viewer)

    def _make_room(self) -> None:
        """Disconnect the viewer that has been silent longest; an attending viewer only if no other exists."""
        with self._coming_and_going:
            viewers = sorted(
                self._viewers.values(),
                key=lambda each: (each.role is ConnectionRole.ATTENDING, each.request_s),
            )
        if viewers:
            # Shut the connection down: this wakes the viewer's thread from any wait, which closing does not.
            with suppress(OSError):
                viewers[0].connection.shutdown(socket.SHUT_RDWR)

    def _leave(self, viewer: _Viewer) -> None:
        with self._coming_and_going:
            self._viewers.pop(id(viewer), None)
        viewer.connection.close()

    def _serve(self, viewer: _Viewer) -> None:
        """Answer one viewer until it disconnects. A viewer that does not read blocks only this thread."""
        try:
            self._note(viewer)
            send(viewer.connection, answer_message(None))
            while True:
                message = receive(viewer.connection, REQUESTS, REQUEST_S)
                self._note(viewer)
                send(viewer.connection, answer_to(self._handler, message))
        except OSError:  # the viewer has disconnected, or does not use this protocol
            pass
        finally:
            self._leave(viewer)

    def _note(self, viewer: _Viewer) -> None:
        viewer.request_s = monotonic()
        if viewer.role is ConnectionRole.ATTENDING:
            self._handler.note_presence()


@contextmanager
def serving(handler: RequestHandler, what: str, host: str = LOOPBACK) -> Iterator[Server]:
    """Serve a request handler at ``host``; ``what`` describes the engine to other programs.

    Raises AcquisitionError when the state folder cannot be written: an unannounced engine cannot be stopped.
    """
    with ExitStack() as inside:
        server = inside.enter_context(closing(Server(handler, host)))
        inside.enter_context(closing(Watchdog(handler.enforce_deadlines, "engine watchdog")))
        inside.enter_context(announce(server.address, what, handler.stop))
        yield server
