"""An instrument with a table of SCPI commands: executes messages, returns replies, and queues errors."""

import math
import socketserver
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

from . import scpi_message as scpi
from .channel_output import ChannelSettings

CHANNELS = 2
_RANGE_ROUNDING = 1e-9
"""Relative tolerance at range limits, for numbers converted from other units."""

Setter = Callable[..., None]
"""Function that executes a command, given instrument, channel and parameters."""
Query = Callable[..., bytes]
"""Function that returns the reply, given instrument, channel and the query's parameters."""


@dataclass(frozen=True)
class Command:
    """One command; without ``write`` it is query-only, without ``ask`` write-only."""

    header: str
    """Header of the command in the notation of manuals, see `header_pattern`."""
    source: str
    write: Setter | None = None
    ask: Query | None = None
    takes: int = 1
    """Number of parameters of the command."""
    query_takes: int = 0
    """Number of parameters of the query."""
    channels: int = CHANNELS
    """Highest numeric suffix of the header, such as 2 in ``SOUR2``."""


def number(
    header: str,
    source: str,
    field: str,
    units: Mapping[str, float],
    limits: Callable[[ChannelSettings], tuple[float, float]],
    default: float,
    decimals: int,
    *,
    channels: int = CHANNELS,
    scale: Callable[[ChannelSettings], float] = lambda _: 1.0,
    largest: float = math.nan,
) -> Command:
    """Return the command of a numeric ``field``, in ``units``, rounded to ``decimals``.

    ``scale`` is the ratio of displayed value to field. ``INFINITE`` selects ``largest``, if given.
    """

    def write(generator: Any, channel: int, parameter: bytes) -> None:
        settings = generator.settings(channel)
        shown = scpi.number(parameter, units)
        low, high = limits(settings)
        if shown >= scpi.INFINITE and not math.isnan(largest):
            shown = largest
        elif low - _RANGE_ROUNDING * abs(low) <= shown <= high + _RANGE_ROUNDING * abs(high):
            shown = round(shown, decimals)
        elif generator.quirks.out_of_range_becomes_default:
            shown = min(max(default, low), high)
        else:
            raise scpi.ScpiError(scpi.ErrorCode.DATA_OUT_OF_RANGE)
        generator.configure(channel, replace(settings, **{field: shown / scale(settings)}))

    def ask(generator: Any, channel: int) -> bytes:
        settings = generator.settings(channel)
        shown = getattr(settings, field) * scale(settings)
        return scpi.as_number(scpi.INFINITE if math.isinf(shown) else shown)

    return Command(header, source, write, ask, channels=channels)


def setting(
    header: str,
    source: str,
    get: Callable[[Any], Any],
    put: Callable[[Any, Any], ChannelSettings],
    *,
    parse: Callable[[bytes], Any] = scpi.boolean,
    show: Callable[[Any], bytes] = lambda is_on: b"1" if is_on else b"0",
    channels: int = CHANNELS,
) -> Command:
    """Return the command of a setting that ``get`` reads and ``put`` replaces; by default on or off."""

    def write(generator: Any, channel: int, parameter: bytes) -> None:
        generator.configure(channel, put(generator.settings(channel), parse(parameter)))

    def ask(generator: Any, channel: int) -> bytes:
        return show(get(generator.settings(channel)))

    return Command(header, source, write, ask, channels=channels)


def choice(
    header: str,
    source: str,
    words: Iterable[str],
    get: Callable[[Any], str],
    put: Callable[[Any, Any], ChannelSettings],
    channels: int = CHANNELS,
) -> Command:
    """Return the command of a setting whose values are words, with the short form in capitals."""

    def parse(parameter: bytes) -> str:
        word = scpi.text(parameter)
        for candidate in words:
            if scpi.mnemonic_matches(word, candidate):
                return candidate
        raise scpi.ScpiError(scpi.ErrorCode.ILLEGAL_PARAMETER_VALUE)

    def show(word: str) -> bytes:
        return scpi.short_form(word).encode("ascii")

    return setting(header, source, get, put, parse=parse, show=show, channels=channels)


LONGEST_REPLY = 1 << 20
"""Largest reply to one message [bytes]; useful replies have up to 17 kB."""


@dataclass(frozen=True)
class Quirks:
    """Documented peculiarities of the firmware; the defaults describe FV:V1.0.2.

    Sources: hardware reference, sections 1.1, 1.2 and 1.4.
    """

    first_identity_after_clear_is_empty: bool = True
    """The first ``*IDN?`` after ``*CLS`` returns an empty line."""
    high_impedance_has_ohm_sign: bool = True
    """``OUTP:IMP?`` at high impedance returns ``9.9E+37`` and an ohm sign in GBK, not ASCII."""
    unknown_is_syntax_error: bool = True
    """An unknown command queues -102; an unknown query also gets an empty line (if False: -113, no reply)."""
    out_of_range_becomes_default: bool = True
    """A number out of range silently sets the parameter's default (if False: -222 and no change)."""
    panel_load_ohm: float | None = None
    """Load set at the panel [ohm], for a unit without ``OUTP:IMP`` (reported by one driver); else None."""


@dataclass(frozen=True)
class Reply:
    """Reply to one message; empty if the message contains no query."""

    data: bytes
    delay_s: float = 0.0


class ScpiInstrument:
    """An instrument that executes messages one after another; calls are thread-safe.

    Parameters
    ----------
    clock
        Function that returns the rig time of a command's arrival [s]. It is called outside the instrument's
        lock, because it may need a lock that is held during rendering.
    identity
        Reply to ``*IDN?``.
    commands
        Commands in addition to the common commands.
    """

    def __init__(
        self, clock: Callable[[], float], identity: str, quirks: Quirks, commands: tuple[Command, ...]
    ) -> None:
        self.quirks = quirks
        self.status = scpi.Status()
        self.lock = threading.RLock()
        self.now_s = 0.0
        """Rig time of the current message's arrival [s]."""
        self.clock = clock
        self.commands = (*commands, *COMMON_COMMANDS)
        self._patterns = [(scpi.header_pattern(command.header), command) for command in self.commands]
        self._identity = identity
        self._identity_is_due_empty = False
        self._next_delay_s = 0.0
        self._next_is_corrupted = False

    def execute(self, message: bytes) -> Reply:
        """Execute one complete message and return its reply."""
        now_s = self.clock()
        with self.lock:
            self.now_s = now_s
            answers = self._answers(message)
            if not answers:
                return Reply(b"")
            data = b";".join(answers) + b"\n"
            delay_s, self._next_delay_s = self._next_delay_s, 0.0
            if self._next_is_corrupted:
                self._next_is_corrupted = False
                spoilt = (byte if place % 2 else byte ^ scpi.BYTE for place, byte in enumerate(data[:-1]))
                data = bytes(spoilt) + data[-1:]
            return Reply(data, delay_s)

    def report(self, code: scpi.ErrorCode) -> None:
        """Queue an error of the interface, such as an unread reply or a read without a preceding query."""
        with self.lock:
            self.status.report(code)

    def delay_next_reply(self, delay_s: float) -> None:
        """Delay the next reply; if a read by the host times out, the next read receives the delayed reply."""
        with self.lock:
            self._next_delay_s = delay_s

    def corrupt_next_reply(self) -> None:
        """Corrupt the next reply: change every second byte, from the first, but keep the last byte."""
        with self.lock:
            self._next_is_corrupted = True

    def identity(self) -> bytes:
        """Return the identity; given this quirk, the first query after ``*CLS`` has an empty reply."""
        is_empty, self._identity_is_due_empty = self._identity_is_due_empty, False
        return b"" if is_empty else self._identity.encode("ascii")

    def clear_status(self) -> None:
        """Clear the error queue and the event register."""
        self.status.clear()
        self._identity_is_due_empty = self.quirks.first_identity_after_clear_is_empty

    def next_error(self) -> bytes:
        """Return and remove the oldest error of the queue."""
        code = self.status.next_error()
        return f'{int(code)},"{code.text}"'.encode("ascii")

    def _answers(self, message: bytes) -> list[bytes]:
        """Execute all units of a message in order and return the replies."""
        prefix = ""  # node of the command tree from which headers start (SCPI-1999, 1, 6.2.4)
        answers: list[bytes] = []
        room = LONGEST_REPLY
        for unit in scpi.units(message):
            if unit.header.startswith("*"):
                header = unit.header
            else:
                is_at_root = unit.starts_line or unit.header.startswith(":")
                header = unit.header.removeprefix(":") if is_at_root else prefix + unit.header
                prefix = header[: header.rfind(":") + 1]
            if unit.asks and room < 0:
                continue
            try:
                answer = self._obey(header, unit)
            except scpi.ScpiError as error:
                self.status.report(error.code)
                continue
            if answer is None:
                continue
            answers.append(answer)
            room -= len(answer)
            if room < 0:  # no reply can be read until the message ends (IEEE 488.2, 6.3.1.7)
                answers.clear()
                self.status.report(scpi.ErrorCode.QUERY_DEADLOCKED)
        return answers

    def _obey(self, header: str, unit: scpi.Unit) -> bytes | None:
        """Execute one unit of a message; return the reply if the unit is a query."""
        command, suffix = self._find(header)
        act = None if command is None else command.ask if unit.asks else command.write
        if command is None or act is None:
            # Refuse an unknown header in the same way as the firmware.
            if not self.quirks.unknown_is_syntax_error:
                raise scpi.ScpiError(scpi.ErrorCode.UNDEFINED_HEADER)
            self.status.report(scpi.ErrorCode.SYNTAX_ERROR)
            return b"" if unit.asks else None
        if not 1 <= suffix <= command.channels:
            raise scpi.ScpiError(scpi.ErrorCode.HEADER_SUFFIX_OUT_OF_RANGE)
        takes = command.query_takes if unit.asks else command.takes
        if len(unit.parameters) < takes or not all(unit.parameters[:takes]):
            raise scpi.ScpiError(scpi.ErrorCode.MISSING_PARAMETER)
        if len(unit.parameters) > takes:
            raise scpi.ScpiError(scpi.ErrorCode.PARAMETER_NOT_ALLOWED)
        return act(self, suffix, *unit.parameters)

    def _find(self, header: str) -> tuple[Command | None, int]:
        """Return the command of a header, and its numeric suffix."""
        for pattern, command in self._patterns:
            if found := pattern.fullmatch(header):
                return command, int(found.groupdict().get("suffix") or 1)
        return None, 1


# fmt: off
COMMON_COMMANDS = (
    Command("*IDN", "IEEE 488.2, 10.14", ask=lambda each, _: each.identity()),
    Command("*CLS", "IEEE 488.2, 10.3", lambda each, _: each.clear_status(), takes=0),
    Command("*WAI", "IEEE 488.2, 10.39", lambda *_: None, takes=0),
    Command("*OPC", "IEEE 488.2, 10.18",
        lambda each, _: each.status.operation_complete(), lambda *_: b"1", takes=0),
    Command("*ESR", "IEEE 488.2, 10.12", ask=lambda each, _: b"%d" % each.status.take_events()),
    Command("SYSTem:ERRor[:NEXT]", "SCPI-1999, volume 2, 21.8", ask=lambda each, _: each.next_error()),
)
# fmt: on


# The generator on a raw TCP socket, for programs without Python. The real AFG1022 has no network port. Open
# ``TCPIP0::127.0.0.1::<port>::SOCKET``. Each message and each reply is one line.

LOOPBACK = "127.0.0.1"
_RECEIVE_BYTES = 65536


class ScpiDevice(Protocol):
    """Device that a socket makes available."""

    def execute(self, message: bytes) -> Reply:
        """Execute one complete message, and return the reply."""


class ScpiSocket(socketserver.ThreadingTCPServer):
    """A server for this computer only, because SCPI has no password; used as a context manager.

    Parameters
    ----------
    device
        The instrument; several clients may use it at once.
    port
        Port number; 0 selects a free port. See ``port`` and ``resource_name``.
    """

    daemon_threads = True  # a client's thread does not keep the process alive
    allow_reuse_address = True
    block_on_close = False

    def __init__(self, device: ScpiDevice, port: int = 0) -> None:
        super().__init__((LOOPBACK, port), _Session)
        self.device = device
        self.closing = threading.Event()
        self.port = int(self.server_address[1])
        """TCP port of the server."""
        self.resource_name = f"TCPIP0::{LOOPBACK}::{self.port}::SOCKET"
        """The VISA address of the socket."""
        # Every 0.02 s, the server looks whether it must end; close() waits for this end.
        serve = partial(self.serve_forever, 0.02)
        self._thread = threading.Thread(target=serve, name="scpi-socket", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the server; allowed at any time."""
        self.closing.set()
        self.shutdown()
        self.server_close()
        self._thread.join()

    def __exit__(self, *_: object) -> None:
        self.close()


class _Session(socketserver.BaseRequestHandler):
    """One client of the socket; its bytes are collected until a message is complete and can be answered."""

    server: ScpiSocket

    def handle(self) -> None:
        """Serve until the client disconnects or exceeds the message length."""
        pending = b""
        while len(pending) < scpi.LONGEST_MESSAGE:  # disconnect a client that never ends its message
            try:
                received = self.request.recv(_RECEIVE_BYTES)
            except ConnectionError:
                return
            if not received:
                return
            pending += received
            while (end := scpi.message_end(pending)) is not None:
                message, pending = pending[:end], pending[end:]
                self._answer(message)

    def _answer(self, message: bytes) -> None:
        reply = self.server.device.execute(message)
        if reply.delay_s and self.server.closing.wait(reply.delay_s):
            return  # the server was closed during the delay
        if reply.data:
            # The client may have disconnected.
            with suppress(ConnectionError):
                self.request.sendall(reply.data)
