"""Messages on a stream: a short binary head, a JSON text, and samples behind it where there are any.

Nothing that is executable is ever sent: what comes from another process is parsed as JSON or taken as
numbers, never unpickled. What is declared costs no memory: only what has come is held, and each side says
how long a message may be.
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
"""Most that is read at once."""


@dataclass(frozen=True)
class Bounds:
    """The longest message that is taken."""

    text_bytes: int
    payload_bytes: int = 0


HELLO = Bounds(1_000)
"""Before the token was shown."""
REQUESTS = Bounds(32_000_000)
"""A campaign of thousands of measurements; no request carries samples."""
ANSWERS = Bounds(32_000_000, 64_000_000)


class WireError(ConnectionError):
    """The other side is gone, or does not speak this protocol."""


@dataclass(frozen=True)
class Message:
    """A JSON text and the bytes behind it."""

    text: bytes
    payload: bytes = b""


class IncomingMessage:
    """A message that comes in pieces."""

    def __init__(self, bounds: Bounds) -> None:
        self._bounds = bounds
        self._came = bytearray()
        self._text_end = self._end = HEAD.size
        self._has_head = False

    @property
    def missing(self) -> int:
        """Bytes to read before anything more can be said; 0 when the message is complete."""
        return self._end - len(self._came)

    def take(self, piece: bytes) -> None:
        """Take what has come, at most `missing` bytes; raises WireError for what is no message."""
        if not piece:
            raise WireError("the other side closed the connection")
        self._came += piece
        if not self._has_head and self.missing == 0:
            self._read_head()

    def message(self) -> Message:
        """Return the complete message."""
        came = memoryview(self._came)
        return Message(bytes(came[HEAD.size : self._text_end]), bytes(came[self._text_end :]))

    def _read_head(self) -> None:
        magic, text_bytes, payload_bytes = HEAD.unpack(self._came)
        is_ours = magic == MAGIC
        if not is_ours or text_bytes > self._bounds.text_bytes or payload_bytes > self._bounds.payload_bytes:
            raise WireError("what came over the connection is no message of this protocol; it was closed")
        self._has_head = True
        self._text_end += text_bytes
        self._end = self._text_end + payload_bytes


def refusal(sentence: str, error: Exception) -> Message:
    """Say no, in one sentence."""
    return Message(json.dumps({"refused": sentence, "kind": type(error).__name__}).encode())


def send(connection: socket.socket, message: Message) -> None:
    """Send one message; raises OSError when the other side is gone."""
    head = HEAD.pack(MAGIC, len(message.text), len(message.payload))
    connection.sendall(head + message.text)
    if message.payload:
        connection.sendall(message.payload)


def receive(connection: socket.socket, bounds: Bounds, within_s: float | None = None) -> Message:
    """Wait for one message, as long as the connection's timeout allows; from its first byte on ``within_s``.

    Raises WireError when the connection ends, or what comes is not a message, and TimeoutError when it does
    not come in time.
    """
    incoming = IncomingMessage(bounds)
    patience_s, until_s = connection.gettimeout(), None
    try:
        while incoming.missing:
            incoming.take(connection.recv(min(incoming.missing, PIECE_BYTES)))
            if within_s is not None:
                until_s = monotonic() + within_s if until_s is None else until_s
                # Not 0: that would mean not to wait at all.
                connection.settimeout(max(until_s - monotonic(), 1e-3))
    finally:
        connection.settimeout(patience_s)
    return incoming.message()


class EngineError(AcquisitionError):
    """The engine does not do what was asked; the text says what state it is in and what is allowed."""


class EngineGone(EngineError, ConnectionError):
    """The engine's process has ended, or cannot be reached."""


class EngineSilent(EngineGone):
    """The engine has not answered in time; its process may live."""
