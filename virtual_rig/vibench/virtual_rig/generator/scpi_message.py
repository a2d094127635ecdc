"""Parser of SCPI messages: their ends, units, headers, parameters and binary blocks."""

import math
import re
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

QUEUE_LENGTH = 20
"""Maximum number of errors in the queue before "Queue overflow" (assumed depth; SCPI requires >= 2)."""


class ErrorCode(IntEnum):
    """SCPI-1999 error numbers (volume 2, chapter 21.8) that the instrument uses."""

    NO_ERROR = 0
    SYNTAX_ERROR = -102
    DATA_TYPE_ERROR = -104
    PARAMETER_NOT_ALLOWED = -108
    MISSING_PARAMETER = -109
    UNDEFINED_HEADER = -113
    HEADER_SUFFIX_OUT_OF_RANGE = -114
    EXPONENT_TOO_LARGE = -123
    INVALID_SUFFIX = -131
    INVALID_BLOCK_DATA = -161
    SETTINGS_CONFLICT = -221
    DATA_OUT_OF_RANGE = -222
    ILLEGAL_PARAMETER_VALUE = -224
    OUT_OF_MEMORY = -225
    HARDWARE_MISSING = -241
    QUEUE_OVERFLOW = -350
    QUERY_INTERRUPTED = -410
    QUERY_UNTERMINATED = -420
    QUERY_DEADLOCKED = -430

    @property
    def text(self) -> str:
        """Text that SYST:ERR? returns with the error number."""
        words = self.name.replace("_", " ").capitalize()
        kind, _, problem = words.partition(" ")
        return f"{kind} {problem.upper()}" if kind == "Query" else words


class ScpiError(Exception):
    """Refusal of a command, with the error number for the error queue."""

    def __init__(self, code: ErrorCode) -> None:
        super().__init__(f'{int(code)},"{code.text}"')
        self.code = code


BYTE = 255


_OPERATION_COMPLETE, _POWER_ON = 1, 128
"""Bits of the standard event status register (IEEE 488.2-1992, 11.5.1); error bits are in `Status`."""


class Status:
    """Error queue and event register of one instrument."""

    def __init__(self) -> None:
        self._errors: deque[ErrorCode] = deque()
        self._events = _POWER_ON

    def report(self, code: ErrorCode) -> None:
        """Queue an error and set its bit in the event register."""
        hundred = -int(code) // 100
        self._events |= 1 << (6 - hundred)  # bit 5: command, 4: execution, 3: device, 2: query error
        if len(self._errors) < QUEUE_LENGTH:
            self._errors.append(code)
        else:
            self._errors[-1] = ErrorCode.QUEUE_OVERFLOW

    def next_error(self) -> ErrorCode:
        """Return and remove the oldest error; return NO_ERROR if the queue is empty."""
        return self._errors.popleft() if self._errors else ErrorCode.NO_ERROR

    def take_events(self) -> int:
        """Return and clear the event register."""
        events, self._events = self._events, 0
        return events

    def operation_complete(self) -> None:
        """Record that all operations are complete (``*OPC``)."""
        self._events |= _OPERATION_COMPLETE

    def clear(self) -> None:
        """Clear queue and event register (``*CLS``)."""
        self._errors.clear()
        self._events = 0


_NODE = re.compile(r"(?P<short>\*?[A-Z]+)(?P<rest>[a-z]*)(?P<suffix>#?)")


def header_pattern(header: str) -> re.Pattern[str]:
    """Return the pattern of a header in the notation of manuals; its group ``suffix`` matches the number.

    Capitals are the short form, brackets enclose optional parts, and # is an optional number.
    ``[SOURce#:]FREQuency[:FIXed]`` matches ``FREQ``, ``source2:frequency:fix`` and so on.
    """
    expression = header.replace("[", "(?:").replace("]", ")?").replace("*", r"\*")
    return re.compile(_NODE.sub(_node_expression, expression), re.IGNORECASE)


def _node_expression(node: re.Match[str]) -> str:
    rest = f"(?:{node['rest']})?" if node["rest"] else ""
    suffix = r"(?P<suffix>\d{1,3})?" if node["suffix"] else ""
    return f"{node['short']}{rest}{suffix}"


def mnemonic_matches(word: str, mnemonic: str) -> bool:
    """Return whether a word is the long or the short form of a mnemonic such as ``SINusoid``, in any case."""
    return word.upper() in (short_form(mnemonic), mnemonic.upper())


def short_form(mnemonic: str) -> str:
    """Return the capitals of a mnemonic, which the instrument uses in replies."""
    return "".join(letter for letter in mnemonic if not letter.islower())


SEPARATOR = ord(";")
COMMA = ord(",")
NEWLINE = ord("\n")
BLOCK = ord("#")
QUOTES = frozenset(b"\"'")
LONGEST_MESSAGE = 1 << 22
"""Largest message [bytes] (assumed); the longest useful message, a waveform of a million points, has 2 MB."""
DIGITS = frozenset(b"0123456789")


@dataclass(frozen=True)
class Unit:
    """One command or query of a message, as written."""

    header: str
    """Header as sent, such as ``"SOUR1:FREQ"``, without the question mark."""
    asks: bool
    parameters: tuple[bytes, ...]
    """Raw parameters without surrounding white space; a block keeps its ``#`` header."""
    starts_line: bool
    """Whether the unit is the first of its line; the header is then relative to the root."""


def block_length(data: bytes, start: int) -> int | None:
    """Return the length of a block that begins at ``start``, or None while it is unknown.

    A block is ``#<d><n><n bytes>`` (IEEE 488.2-1992, 7.7.6). Any other ``#`` counts as one byte.
    """
    if start + 1 >= len(data):
        return None
    digits = int(data[start + 1 : start + 2]) if data[start + 1] in DIGITS else 0
    number = data[start + 2 : start + 2 + digits]
    if digits == 0 or not all(byte in DIGITS for byte in number):
        return 1
    if len(number) < digits:
        return None
    return 2 + digits + int(number)


def _marks(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield (position, byte) of every separator, comma and newline outside quotes and blocks.

    Stops at a block or string whose end has not arrived.
    """
    position = 0
    while position < len(data):
        byte = data[position]
        if byte in QUOTES:
            end = data.find(byte, position + 1)
            if end < 0:
                return
            position = end + 1
        elif byte == BLOCK:
            length = block_length(data, position)
            if length is None or position + length > len(data):
                return
            position += length
        else:
            if byte in (SEPARATOR, COMMA, NEWLINE):
                yield position, byte
            position += 1


def message_end(data: bytes) -> int | None:
    """Return the end of the first complete message (after its newline), or None.

    A newline inside a quoted string or a binary block does not end a message, because an uploaded waveform
    may contain the byte 0x0A.
    """
    for position, byte in _marks(data):
        if byte == NEWLINE:
            return position + 1
    return None


def units(message: bytes) -> list[Unit]:
    """Return the units of a complete message; empty units are omitted."""
    found: list[Unit] = []
    pieces: list[bytes] = []
    begin = 0
    starts_line = True
    for position, byte in [*_marks(message), (len(message), NEWLINE)]:
        pieces.append(_trim(message[begin:position]))
        begin = position + 1
        if byte == COMMA:
            continue
        if pieces != [b""]:
            header, *first = pieces[0].split(maxsplit=1) or [b""]
            parameters = (b"".join(first), *pieces[1:])
            found.append(
                Unit(
                    header=header.decode("ascii", errors="replace").removesuffix("?"),
                    asks=header.endswith(b"?"),
                    parameters=() if parameters == (b"",) else parameters,
                    starts_line=starts_line,
                )
            )
            starts_line = False
        pieces = []
        starts_line |= byte == NEWLINE
    return found


def _trim(piece: bytes) -> bytes:
    """Remove white space around a header or a parameter, but do not change the data bytes of a block."""
    piece = piece.lstrip(b" \t\r")
    length = (block_length(piece, 0) or 0) if piece.startswith(b"#") else 0
    return piece[:length] if length > 1 else piece.rstrip(b" \t\r")


INFINITE = 9.9e37
"""SCPI's number for infinity (SCPI-1999, volume 1, 7.2.1.4)."""

# SCPI multipliers: M is milli except before HZ, where it is mega (SCPI-1999, volume 1, 7.1.4.3).
FREQUENCY_UNITS: Mapping[str, float] = {
    "": 1.0,
    "UHZ": 1e-6,
    "HZ": 1.0,
    "KHZ": 1e3,
    "MHZ": 1e6,
    "MAHZ": 1e6,
    "GHZ": 1e9,
}
VOLTAGE_UNITS: Mapping[str, float] = {"": 1.0, "UV": 1e-6, "MV": 1e-3, "V": 1.0, "KV": 1e3}
AMPLITUDE_UNITS: Mapping[str, float] = {
    **VOLTAGE_UNITS,
    "UVPP": 1e-6,
    "MVPP": 1e-3,
    "VPP": 1.0,
}
RESISTANCE_UNITS: Mapping[str, float] = {"": 1.0, "OHM": 1.0, "KOHM": 1e3, "MOHM": 1e6}
PERCENT_UNITS: Mapping[str, float] = {"": 1.0, "PCT": 1.0, "%": 1.0}
NO_UNITS: Mapping[str, float] = {"": 1.0}

_NUMBER = re.compile(r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?)\s*(?P<unit>[A-Z%]*)", re.IGNORECASE)


def text(parameter: bytes) -> str:
    """Return a parameter of a command as text."""
    try:
        return parameter.decode("ascii")
    except UnicodeDecodeError:
        raise ScpiError(ErrorCode.DATA_TYPE_ERROR) from None


def number(parameter: bytes, units: Mapping[str, float]) -> float:
    """Return the value of ``1.5kHz`` or ``INF`` in the base unit.

    Raises ScpiError: -131 for a wrong unit, -104 for text that is not a number.
    """
    if mnemonic_matches(text(parameter), "INFinity"):
        return INFINITE
    value, unit = number_and_unit(parameter)
    if unit not in units:
        raise ScpiError(ErrorCode.INVALID_SUFFIX)
    return _finite(value * units[unit])


def _finite(value: float) -> float:
    """Refuse an overflow with -123, exponent too large (SCPI-1999, volume 2, 21.8.9)."""
    if not math.isfinite(value):
        raise ScpiError(ErrorCode.EXPONENT_TOO_LARGE)
    return value


def number_and_unit(parameter: bytes) -> tuple[float, str]:
    """Return number and unit of a parameter: 31.0 and ``"DEG"`` for ``31 deg``."""
    found = _NUMBER.fullmatch(text(parameter))
    if found is None:
        raise ScpiError(ErrorCode.DATA_TYPE_ERROR)
    return _finite(float(found["number"])), found["unit"].upper()


def integer(parameter: bytes) -> int:
    """Return an integer; fractions are rounded, as SCPI requires."""
    return round(number(parameter, NO_UNITS))


def boolean(parameter: bytes) -> bool:
    """Return whether a parameter (ON, OFF or a number) means on; a number that rounds to zero means off."""
    word = text(parameter).upper()
    if word in ("ON", "OFF"):
        return word == "ON"
    return integer(parameter) != 0


def block(parameter: bytes) -> bytes:
    """Return the data of a binary block of definite length (IEEE 488.2-1992, 7.7.6)."""
    if not parameter.startswith(b"#") or block_length(parameter, 0) != len(parameter):
        raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
    return parameter[2 + int(parameter[1:2]) :]


def numbers(parameter: bytes, order: str) -> NDArray[np.int32]:
    """Return the 16-bit numbers of a binary block; ``order`` is their type for numpy, such as ``">u2"``."""
    data = block(parameter)
    if len(data) % 2:
        raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
    return np.frombuffer(data, dtype=order).astype(np.int32)


def as_block(data: bytes) -> bytes:
    """Return data as an IEEE 488.2 block of definite length."""
    count = str(len(data))
    return f"#{len(count)}{count}".encode("ascii") + data


def as_number(value: float) -> bytes:
    """Return a number in the instrument's format: ``1.5E+03``, ``9.9E+37``, ``0.0E+00``."""
    mantissa, exponent = f"{value + 0.0:.11E}".split("E")  # adding 0.0 turns -0.0 into 0.0
    whole, _, decimals = mantissa.partition(".")
    return f"{whole}.{decimals.rstrip('0') or '0'}E{int(exponent):+03d}".encode("ascii")


Codes = NDArray[np.uint16]

USER_MEMORIES = 256
EDIT_MEMORY = "EMEM"
_MIDDLE_CODE = 8191
_POWER_ON_POINTS = 1000
"""Number of points of the edit memory after power-on (assumed, as in the AFG3000 series)."""


class ArbitraryMemory:
    """Edit memory and further memories, by name; stored waveforms are immutable."""

    def __init__(self, points: tuple[int, int], top_code: int) -> None:
        """``points`` are the smallest and largest number of points of a waveform."""
        self.top_code = top_code
        self._points = points
        self._waveforms: dict[str, Codes] = {}
        self.define(_POWER_ON_POINTS)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all non-empty memories, the edit memory first."""
        return tuple(self._waveforms)

    def codes(self, name: str) -> Codes:
        """Return the codes of a memory; an empty memory is refused with -224."""
        try:
            return self._waveforms[name]
        except KeyError:
            raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE) from None

    def define(self, points: int) -> None:
        """Set the edit memory to ``points`` points at zero volts."""
        self._check_length(points)
        self.store(EDIT_MEMORY, np.full(points, _MIDDLE_CODE))

    def store(self, name: str, codes: NDArray[np.integer[Any]]) -> None:
        """Store codes from 0 to ``top_code`` in a memory."""
        self._check_length(codes.size)
        if codes.min() < 0 or codes.max() > self.top_code:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        self._waveforms[name] = codes.astype(np.uint16)
        self._waveforms[name].flags.writeable = False

    def copy(self, source: str, target: str) -> None:
        """Copy one memory to another."""
        self._waveforms[target] = self.codes(source)

    def clear(self) -> None:
        """Empty all memories except the edit memory."""
        self._waveforms = {EDIT_MEMORY: self._waveforms[EDIT_MEMORY]}

    def _check_length(self, points: int) -> None:
        fewest, most = self._points
        if not fewest <= points <= most:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)


def memory_name(parameter: bytes) -> str:
    """Return the canonical name of a memory; other words are refused with -224."""
    word = text(parameter).upper()
    if word in ("EMEM", "EMEMORY"):
        return EDIT_MEMORY
    number = word.removeprefix("USER") or "0"
    if word.startswith("USER") and number.isdigit() and int(number) < USER_MEMORIES:
        return f"USER{int(number)}"
    raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
