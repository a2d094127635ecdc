"""Messages between engine and clients: a short binary header, a JSON text, and optional samples.

Nothing executable is sent: data from another process are parsed as JSON or read as numbers, never unpickled.
The length declared in a header allocates no memory: only received bytes are stored, and each side limits the
length of a message.
"""

import json
import socket
import struct
from dataclasses import dataclass
from time import monotonic

from ..errors import AcquisitionError

HEAD = struct.Struct("!4sII")
MAGIC = b"VBE1"
PIECE_BYTES = 1 << 18
"""Largest number of bytes read at once."""


@dataclass(frozen=True)
class Bounds:
    """Largest size of an accepted message [bytes]."""

    text_bytes: int
    payload_bytes: int = 0


HELLO = Bounds(1_000)
"""Limit for the first message of a connection, which contains the token."""
REQUESTS = Bounds(32_000_000)
"""Limit for requests: a campaign may have thousands of measurements, but no request contains samples."""
ANSWERS = Bounds(32_000_000, 64_000_000)


class WireError(ConnectionError):
    """Error: the other side of the connection has disconnected, or does not use this protocol."""


@dataclass(frozen=True)
class Message:
    """A received message: a JSON text and the bytes after it."""

    text: bytes
    payload: bytes = b""


class IncomingMessage:
    """A message that is received in pieces."""

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self._came = bytearray()
        self._text_end = self._end = HEAD.size
        self._has_head = False

    @property
    def missing(self) -> int:
        """Number of bytes still to read; 0 when the message is complete."""
        return self._end - len(self._came)

    def take(self, piece: bytes) -> None:
        """Add received bytes, at most `missing`; raises WireError if they are not a message."""
        if not piece:
            raise WireError("the other side closed the connection")
        self._came += piece
        if not self._has_head and self.missing == 0:
            self._read_head()

    def message(self) -> Message:
        """Return the message, after all its bytes were received."""
        came = memoryview(self._came)
        return Message(bytes(came[HEAD.size : self._text_end]), bytes(came[self._text_end :]))

    def _read_head(self) -> None:
        magic, text_bytes, payload_bytes = HEAD.unpack(self._came)
        is_ours = magic == MAGIC
        if not is_ours or text_bytes > self._bounds.text_bytes or payload_bytes > self._bounds.payload_bytes:
            raise WireError("the received data are not a message of this protocol; the connection was closed")
        self._has_head = True
        self._text_end += text_bytes
        self._end = self._text_end + payload_bytes


def refusal(sentence: str, error: Exception) -> Message:
    """Return a message that refuses a request, with one sentence."""
    return Message(json.dumps({"refused": sentence, "kind": type(error).__name__}).encode())


def send(connection: socket.socket, message: Message) -> None:
    """Send one message; raises OSError when the other side has disconnected."""
    head = HEAD.pack(MAGIC, len(message.text), len(message.payload))
    connection.sendall(head + message.text)
    if message.payload:
        connection.sendall(message.payload)


def receive(connection: socket.socket, bounds: Bounds, within_s: float | None = None) -> Message:
    """Return the next message; waits up to the connection's timeout, then ``within_s`` after the first byte.

    Raises WireError when the connection ends or when the data are not a message, and TimeoutError when no
    message comes in time.
    """
    incoming = IncomingMessage(bounds)
    patience_s, until_s = connection.gettimeout(), None
    try:
        while incoming.missing:
            incoming.take(connection.recv(min(incoming.missing, PIECE_BYTES)))
            if within_s is not None:
                until_s = monotonic() + within_s if until_s is None else until_s
                # A timeout of 0 would make the socket non-blocking.
                connection.settimeout(max(until_s - monotonic(), 1e-3))
    finally:
        connection.settimeout(patience_s)
    return incoming.message()


class EngineError(AcquisitionError):
    """The engine refuses a request; the text gives the state of the engine and what is allowed."""


class EngineGone(EngineError, ConnectionError):
    """The process of the engine has ended, or cannot be reached."""


class EngineSilent(EngineGone):
    """The engine has not answered in time; its process may still run."""
