"""The generator on a raw TCP socket, for programs outside Python: lines in, lines out.

The real AFG1022 has no network port; this is a way into the simulation, opened with
``TCPIP0::127.0.0.1::<port>::SOCKET`` and newline as the termination character.
"""

import socketserver
import threading
from contextlib import suppress
from types import TracebackType
from typing import Protocol

from .scpi_instrument import Reply
from .scpi_message import LONGEST_MESSAGE, message_end

LOOPBACK = "127.0.0.1"
_RECEIVE_BYTES = 65536


class ScpiDevice(Protocol):
    """What stands behind the socket."""

    def execute(self, message: bytes) -> Reply:
        """Carry out one complete message and return its reply."""


class ScpiSocket:
    """A server that listens on this machine only, unless another host is given; a context manager.

    Parameters
    ----------
    device
        The instrument; several clients may talk to it at once.
    port
        0 takes a free one; see ``port`` and ``resource_name``.
    host
        Address to listen on. SCPI has no password: anyone who reaches the port commands the generator.

    """

    def __init__(self, device: ScpiDevice, port: int = 0, host: str = LOOPBACK) -> None:
        self._closing = threading.Event()
        self._server = _server(device, (host, port), self._closing)
        self._thread = threading.Thread(target=self._server.serve_forever, name="scpi-socket", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """The port that is listened on."""
        return int(self._server.server_address[1])

    @property
    def resource_name(self) -> str:
        """The VISA address of the socket."""
        return f"TCPIP0::{self._server.server_address[0]!s}::{self.port}::SOCKET"

    def close(self) -> None:
        """Stop listening. Legal at any time."""
        self._closing.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> "ScpiSocket":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Server(socketserver.ThreadingTCPServer):
    """One thread for each client, none of which keeps the process alive."""

    daemon_threads = True
    allow_reuse_address = True
    block_on_close = False


def _server(device: ScpiDevice, address: tuple[str, int], closing: threading.Event) -> _Server:
    class Session(socketserver.BaseRequestHandler):
        """One client: collects bytes until a message ends, and answers it."""

        def handle(self) -> None:
            """Serve until the client leaves or sends no end of message."""
            pending = b""
            while len(pending) < LONGEST_MESSAGE:  # a client that never ends one is disconnected
                try:
                    received = self.request.recv(_RECEIVE_BYTES)
                except ConnectionError:
                    return
                if not received:
                    return
                pending += received
                while (end := message_end(pending)) is not None:
                    message, pending = pending[:end], pending[end:]
                    self._answer(message)

        def _answer(self, message: bytes) -> None:
            reply = device.execute(message)
            if reply.delay_s and closing.wait(reply.delay_s):
                return  # the server closed while the instrument was still thinking
            if reply.data:
                # A client that has left wants no answer.
                with suppress(ConnectionError):
                    self.request.sendall(reply.data)

    return _Server(address, Session)
