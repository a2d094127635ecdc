"""Where one SCPI message ends and what it consists of: units, headers, parameters, binary blocks."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from .scpi_header import mnemonic_matches
from .scpi_status import ErrorCode, ScpiError

SEPARATOR = ord(";")
COMMA = ord(",")
NEWLINE = ord("\n")
BLOCK = ord("#")
QUOTES = frozenset(b"\"'")
LONGEST_MESSAGE = 1 << 22
"""Bytes of one message (assumed); the longest that is of use is a waveform of a million points, 2 MB."""
WHITE_SPACE = frozenset(b" \t\r")
DIGITS = frozenset(b"0123456789")


@dataclass(frozen=True)
class Unit:
    """One command or query of a message, as it was written."""

    header: str
    """``"SOUR1:FREQ"`` without the question mark, not yet resolved against a path."""
    asks: bool
    """Whether the header ends in a question mark."""
    parameters: tuple[bytes, ...]
    """Raw parameters without surrounding white space; a block keeps its ``#`` header."""
    starts_line: bool
    """Whether the unit opens a line, so that its header counts from the root."""


def block_length(data: bytes, start: int) -> int | None:
    """Return how many bytes a block that begins at ``start`` occupies, or None while that is unknown.

    Definite: ``#<d><n><n bytes>``; indefinite: ``#0`` up to the end of the message
    (IEEE 488.2-1992, 7.7.6). A ``#`` that begins no block occupies one byte.
    """
    if start + 1 >= len(data):
        return None
    if data[start + 1] not in DIGITS:
        return 1
    digits = int(data[start + 1 : start + 2])
    if digits == 0:
        return max(len(data) - start, 2)
    number = data[start + 2 : start + 2 + digits]
    if not all(byte in DIGITS for byte in number):
        return 1
    if len(number) < digits:
        return None
    return 2 + digits + int(number)


def _marks(data: bytes, ends_blocks: int | None = None) -> Iterator[tuple[int, int]]:
    """Yield (position, byte) of every separator, comma and newline outside quotes and blocks.

    Stops early, without a mark, at a block or string whose end has not arrived yet. A block of indefinite
    length goes on to the end, or to a byte: a stream has no other sign for the end of its message.
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
            if ends_blocks is not None and data[position + 1 : position + 2] == b"0":
                found = data.find(ends_blocks, position)
                length = None if found < 0 else found - position
            if length is None or position + length > len(data):
                return
            position += length
        else:
            if byte in (SEPARATOR, COMMA, NEWLINE):
                yield position, byte
            position += 1


def message_end(data: bytes) -> int | None:
    """Return where the first complete message in a byte stream ends (after its newline), or None.

    A newline inside a quoted string or a binary block does not end a message: an uploaded waveform may
    well contain the byte 0x0A. One of indefinite length ends at the first newline: nothing else ends it here.
    """
    for position, byte in _marks(data, ends_blocks=NEWLINE):
        if byte == NEWLINE:
            return position + 1
    return None


def units(message: bytes) -> list[Unit]:
    """Split a complete message into its units; empty units vanish."""
    found: list[Unit] = []
    pieces: list[bytes] = []
    begin = 0
    starts_line = True
    for position, byte in [*_marks(message), (len(message), NEWLINE)]:
        pieces.append(message[begin:position])
        begin = position + 1
        if byte == COMMA:
            continue
        unit = _unit(pieces, starts_line=starts_line)
        pieces = []
        if unit is not None:
            found.append(unit)
            starts_line = False
        if byte == NEWLINE:
            starts_line = True
    return found


def _unit(pieces: list[bytes], *, starts_line: bool) -> Unit | None:
    """Read header and parameters from the text between two separators."""
    first = _trimmed(pieces[0])
    if not first and len(pieces) == 1:
        return None
    header_end = next((i for i, byte in enumerate(first) if byte in WHITE_SPACE), len(first))
    header = first[:header_end].decode("ascii", errors="replace")
    parameters = [_trimmed(first[header_end:]), *(_trimmed(piece) for piece in pieces[1:])]
    if parameters == [b""]:
        parameters = []
    return Unit(
        header=header.removesuffix("?"),
        asks=header.endswith("?"),
        parameters=tuple(parameters),
        starts_line=starts_line,
    )


def _trimmed(piece: bytes) -> bytes:
    """Drop white space around a parameter, but never a byte of a block's data."""
    piece = piece.lstrip(b" \t\r")
    if piece.startswith(b"#"):
        length = block_length(piece, 0) or len(piece)
        return piece[: max(length, 1)] if length > 1 else piece.rstrip(b" \t\r")
    return piece.rstrip(b" \t\r")


INFINITE = 9.9e37
"""What SCPI sends for infinity (SCPI-1999, volume 1, 7.2.1.4)."""

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
    """Decode a parameter that must be plain text."""
    try:
        return parameter.decode("ascii")
    except UnicodeDecodeError:
        raise ScpiError(ErrorCode.DATA_TYPE_ERROR) from None


def number(parameter: bytes, units: Mapping[str, float]) -> float:
    """Read ``1.5kHz`` or ``INF``: the value in the base unit.

    Raises ScpiError: -131 for a unit that does not belong here, -104 for what is no number.
    """
    if mnemonic_matches(text(parameter), "INFinity"):
        return INFINITE
    value, unit = number_and_unit(parameter)
    if unit not in units:
        raise ScpiError(ErrorCode.INVALID_SUFFIX)
    return _finite(value * units[unit])


def _finite(value: float) -> float:
    """Refuse what overflows: -123, the exponent is too large (SCPI-1999, volume 2, 21.8.9)."""
    if not math.isfinite(value):
        raise ScpiError(ErrorCode.EXPONENT_TOO_LARGE)
    return value


def number_and_unit(parameter: bytes) -> tuple[float, str]:
    """Split ``31 deg`` into 31.0 and ``"DEG"``."""
    found = _NUMBER.fullmatch(text(parameter))
    if found is None:
        raise ScpiError(ErrorCode.DATA_TYPE_ERROR)
    return _finite(float(found["number"])), found["unit"].upper()


def integer(parameter: bytes) -> int:
    """Read a whole number; fractions are rounded, as SCPI asks."""
    return round(number(parameter, NO_UNITS))


def boolean(parameter: bytes) -> bool:
    """Read ON, OFF or a number; anything that rounds to zero is OFF."""
    word = text(parameter).upper()
    if word in ("ON", "OFF"):
        return word == "ON"
    return integer(parameter) != 0


def block(parameter: bytes) -> bytes:
    """Return the data of a definite or indefinite binary block (IEEE 488.2-1992, 7.7.6)."""
    if not parameter.startswith(b"#") or not parameter[1:2].isdigit():
        raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
    digits = int(parameter[1:2])
    if digits == 0:
        return parameter[2:]
    number = parameter[2 : 2 + digits]
    if not number.isdigit() or len(parameter) != 2 + digits + int(number):
        raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
    return parameter[2 + digits :]


def as_block(data: bytes) -> bytes:
    """Wrap data as a definite-length block."""
    count = str(len(data))
    return f"#{len(count)}{count}".encode("ascii") + data


def as_number(value: float) -> bytes:
    """Write a number the way the instrument answers: ``1.5E+03``, ``9.9E+37``, ``0.0E+00``."""
    sign, digits, exponent = Decimal(repr(float(f"{value:.12g}"))).normalize().as_tuple()
    if not isinstance(exponent, int) or not any(digits):
        return b"0.0E+00"
    mantissa = "".join(map(str, digits))
    power = exponent + len(mantissa) - 1
    return f"{'-' if sign else ''}{mantissa[0]}.{mantissa[1:] or '0'}E{power:+03d}".encode("ascii")
