"""Protocol of HELIC-DAQ, version 3, according to its docs/protocol.md: frames over TCP, samples over UDP."""

import binascii
import socket
import struct
import threading
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import InstrumentError, InstrumentLost

VERSION = 3
MAGIC = 0x4C48
ANSWER_S = 2.0
"""Longest wait for a reply [s]."""
_HEAD = struct.Struct("<HBBH")
_PACKET = struct.Struct("<HBBIIIHH")
_ERRORS = {
    1: "bad frame",
    2: "unknown type",
    3: "bad index",
    4: "bad length",
    5: "read-only",
    6: "bad value",
    7: "busy",
}


class Ask(IntEnum):
    """Message types."""

    PARAMETERS = 1
    SOURCES = 2
    GET = 3
    SET = 4
    STREAM_SETUP = 7
    STREAM_START = 8
    STREAM_STOP = 9
    STATUS = 10
    ERROR = 255


@dataclass(frozen=True)
class Parameter:
    """Description of one parameter of the board."""

    index: int
    layout: struct.Struct
    count: int


@dataclass(frozen=True, eq=False)
class Packet:
    """Consecutive samples of the requested sources."""

    number: int
    first: int
    """Index of the first sample."""
    values: NDArray[np.float64]
    """Shape (sources, samples)."""

    @property
    def following(self) -> int:
        """Index of the sample after the last one in this packet."""
        return self.first + self.values.shape[1]


def frame(ask: int, sequence: int, payload: bytes) -> bytes:
    """Return the bytes of a message, with header and checksum."""
    body = struct.pack("<BBH", ask, sequence, len(payload)) + payload
    return struct.pack("<H", MAGIC) + body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))


class HelicLink:
    """One connection to a board; any thread may use it."""

    def __init__(self, host: str, port: int, stream_port: int) -> None:
        self.where = f"{host}:{port}"
        self._turn = threading.RLock()
        self._sequence = 0
        self._host, self._stream_port = host, stream_port
        try:
            self._control = socket.create_connection((host, port), ANSWER_S)
        except OSError as error:
            raise InstrumentLost(
                f"no HELIC-DAQ board answers at {self.where} ({error}). Nothing was played; check its "
                "power, its network, and whether another program uses its only connection"
            ) from error
        self._control.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._samples = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._samples.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        try:
            self._discover()
        except BaseException:
            self.close()
            raise

    def _discover(self) -> None:
        status = self.request(Ask.STATUS)
        if status[0] != VERSION:
            raise InstrumentError(
                f"the board at {self.where} has version {status[0]} of HELIC-DAQ's protocol, but this driver "
                f"needs version {VERSION}. Nothing was played; install firmware of that version"
            )
        _, count, _, self.rate_hz, _ = struct.unpack("<BHBfI", status)
        self.parameters: dict[str, Parameter] = {}
        while len(self.parameters) < count:
            self._take_page(self.request(Ask.PARAMETERS, struct.pack("<H", len(self.parameters))))
        words = self.request(Ask.SOURCES).decode("ascii").split("\0")
        self.sources = dict(zip(words[0::2], words[1::2], strict=False))
        """Unit of each source by name, in the order of the source numbers."""

    def _take_page(self, page: bytes) -> None:
        first, following = struct.unpack_from("<HH", page)
        place = 4
        for index in range(first, following):
            end = page.index(b"\0", place)
            kind, number = struct.unpack_from("<cH", page, end + 1)
            # An array of characters is one text; other arrays have ``number`` values.
            letter = kind.decode("ascii")
            layout = struct.Struct(f"<{number}{'s' if letter == 'c' else letter}")
            self.parameters[page[place:end].decode("ascii")] = Parameter(index, layout, number)
            place = end + 5
        if following != len(self.parameters) or following == first:
            raise InstrumentError(
                f"the board at {self.where} lists its parameters out of order ({first} to {following}). "
                "Nothing was played; install firmware of version 3"
            )

    def request(self, ask: Ask, payload: bytes = b"", what: str = "") -> bytes:
        """Send one frame, and return the payload of the reply."""
        with self._turn:
            self._sequence = (self._sequence + 1) % 256
            try:
                self._control.sendall(frame(ask, self._sequence, payload))
                head = self._receive(_HEAD.size)
                magic, kind, sequence, length = _HEAD.unpack(head)
                rest = self._receive(length + 2)
            except OSError as error:
                raise InstrumentLost(
                    f"the board at {self.where} does not answer ({error or type(error).__name__}). Its gate "
                    "closes by itself at most 10 s after the connection was lost; check its power and its "
                    "network"
                ) from error
            expected = self._sequence
        answer, (crc,) = rest[:-2], struct.unpack("<H", rest[-2:])
        if magic != MAGIC or sequence != expected or crc != binascii.crc_hqx(head[2:] + answer, 0xFFFF):
            raise InstrumentError(
                f"the host at {self.where} is not a HELIC-DAQ board: its frame is damaged. Nothing more was "
                "sent; correct controller.resource"
            )
        if kind == Ask.ERROR:
            raise InstrumentError(
                f"the board at {self.where} refused {what or ask.name.lower()}: "
                f"{_ERRORS.get(answer[0], f'error {answer[0]}')}. The board was silenced; check which values "
                "its firmware allows"
            )
        return answer

    def _receive(self, count: int) -> bytes:
        parts = b""
        while len(parts) < count:
            part = self._control.recv(count - len(parts))
            if not part:
                raise ConnectionError("the board closed the connection")
            parts += part
        return parts

    def get(self, *names: str) -> tuple[Any, ...]:
        """Return the values of parameters: numbers, or bytes for an array of characters."""
        wanted = [self.parameters[name] for name in names]
        answer = self.request(Ask.GET, struct.pack(f"<{len(wanted)}H", *(each.index for each in wanted)))
        return tuple(
            value
            for each, place in zip(
                wanted, np.cumsum([0, *(each.layout.size for each in wanted)]), strict=False
            )
            for value in each.layout.unpack_from(answer, int(place))
        )

    def set(self, name: str, *values: float) -> None:
        """Write all values of a parameter."""
        parameter = self.parameters[name]
        self.request(
            Ask.SET,
            struct.pack("<H", parameter.index) + parameter.layout.pack(*values),
            f"{values[:1]} as {name}",
        )

    def stream(self, sources: tuple[str, ...]) -> None:
        """Start streaming every sample of the given sources."""
        names = list(self.sources)
        numbers = bytes(names.index(each) for each in sources)
        self._samples.bind(("", 0))
        # After this datagram, a firewall accepts the samples as a reply.
        self._samples.sendto(b"\0", (self._host, self._stream_port))
        self.request(Ask.STREAM_STOP)
        self.request(Ask.STREAM_SETUP, struct.pack("<HIB", 1, 0, len(numbers)) + numbers)
        self.request(Ask.STREAM_START, struct.pack("<H", self._samples.getsockname()[1]))

    def read_packets(self, timeout_s: float) -> list[Packet]:
        """Wait for samples, and return all packets that have arrived."""
        packets: list[Packet] = []
        self._samples.settimeout(timeout_s)
        try:
            while True:
                packets += self._packet(self._samples.recv(2048))
                self._samples.settimeout(0.0)
        except (TimeoutError, BlockingIOError):
            return packets

    def _packet(self, datagram: bytes) -> list[Packet]:
        if len(datagram) < _PACKET.size:
            return []
        magic, version, width, number, first, _, _, count = _PACKET.unpack_from(datagram)
        if magic != MAGIC or version != VERSION or len(datagram) != _PACKET.size + 4 * width * count:
            return []
        values = np.frombuffer(datagram, "<f4", offset=_PACKET.size).reshape(count, width)
        return [Packet(number, first, values.T.astype(np.float64))]

    def close(self) -> None:
        """Close the connection; the board then closes its gate at once."""
        self._control.close()
        self._samples.close()
