"""Where one SCPI message ends and what it consists of: units, headers, parameters, binary blocks."""

from collections.abc import Iterator
from dataclasses import dataclass

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
