"""Messages on a stream: a short binary head, a JSON text, and samples behind it where there are any.

Nothing that is executable is ever sent: what comes from another process is parsed as JSON or taken as
numbers, never unpickled.
"""

import socket
import struct
from dataclasses import dataclass

HEAD = struct.Struct("!4sII")
MAGIC = b"VBE1"
LONGEST_TEXT = 32_000_000
"""A campaign of thousands of measurements; anything longer is not ours."""
LONGEST_PAYLOAD = 64_000_000


class WireError(ConnectionError):
    """The other side is gone, or does not speak this protocol."""


@dataclass(frozen=True)
class Message:
    """A JSON text and the bytes behind it."""

    text: bytes
    payload: bytes = b""


def send(connection: socket.socket, message: Message) -> None:
    """Send one message; raises OSError when the other side is gone."""
    head = HEAD.pack(MAGIC, len(message.text), len(message.payload))
    connection.sendall(head + message.text + message.payload)


def receive(connection: socket.socket) -> Message:
    """Wait for one message.

    Raises
    ------
    WireError
        When the connection ends, or what comes is not a message.

    """
    magic, text_bytes, payload_bytes = HEAD.unpack(_exactly(connection, HEAD.size))
    if magic != MAGIC or text_bytes > LONGEST_TEXT or payload_bytes > LONGEST_PAYLOAD:
        raise WireError("what came over the connection is no message of this protocol; it was closed")
    return Message(_exactly(connection, text_bytes), _exactly(connection, payload_bytes))


def _exactly(connection: socket.socket, count: int) -> bytes:
    parts = bytearray(count)
    view = memoryview(parts)
    while view:
        got = connection.recv_into(view)
        if got == 0:
            raise WireError("the other side closed the connection")
        view = view[got:]
    return bytes(parts)
