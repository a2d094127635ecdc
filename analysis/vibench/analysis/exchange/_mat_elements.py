"""The elements of a MATLAB 5 file, looked at before they are read: scipy's reader crashes on wrong types.

Layout: MathWorks, MAT-File Format, "Level 5 MAT-file format": a head of 128 bytes, then elements of a tag
(type, bytes) and data, padded to eight bytes; matrices hold elements, compressed ones hold one.
"""

import struct
import zlib
from pathlib import Path

HEAD_BYTES, TAG_BYTES = 128, 8
MATRIX, COMPRESSED = 14, 15
PLAIN = frozenset({*range(1, 8), 9, 12, 13, 16, 17, 18})
"""Types of numbers and of text."""
SMALL_BYTES = 4
"""An element of up to this many bytes may lie in its tag."""
DEEPEST = 30
"""Cells in structs in cells: more is nothing that anybody measured."""
LARGEST_BYTES = 2**31
"""Of one variable, unpacked."""


def require_whole(path: Path) -> None:
    """Raise ValueError for a file whose elements do not lie within each other, or have unknown types."""
    content = memoryview(path.read_bytes())
    if len(content) < HEAD_BYTES:
        raise ValueError("it ends within its head")
    order = {b"IM": "<", b"MI": ">"}.get(bytes(content[HEAD_BYTES - 2 : HEAD_BYTES]))
    # Version 4 has no such head: its reader knows few types, and checks them.
    if order is not None:
        _look(content[HEAD_BYTES:], order, 0)


def _look(content: memoryview, order: str, depth: int) -> None:
    """Go through the elements that follow each other."""
    if depth > DEEPEST:
        raise ValueError(f"more than {DEEPEST} structs or cells lie within each other")
    while len(content) >= TAG_BYTES:
        kind, size = struct.unpack(f"{order}II", content[:TAG_BYTES])
        if kind >> 16:  # small: type and size share four bytes, data are in the other four
            _require_plain(kind & 0xFFFF)
            if kind >> 16 > SMALL_BYTES:
                raise ValueError(f"a small element of {kind >> 16} bytes")
            content = content[TAG_BYTES:]
            continue
        data = content[TAG_BYTES : TAG_BYTES + size]
        if len(data) < size:
            raise ValueError(f"an element of {size} bytes, and {len(data)} are left")
        match kind:
            case _ if kind == MATRIX:
                _look(data, order, depth + 1)
            case _ if kind == COMPRESSED:
                _look(memoryview(_unpacked(data)), order, depth + 1)
            case _:
                _require_plain(kind)
        padding = 0 if kind == COMPRESSED else -size % TAG_BYTES
        content = content[TAG_BYTES + size + padding :]


def _require_plain(kind: int) -> None:
    if kind not in PLAIN:
        raise ValueError(f"an element of the unknown type {kind}")


def _unpacked(data: memoryview) -> bytes:
    unpacking = zlib.decompressobj()
    found = unpacking.decompress(data, LARGEST_BYTES)
    if unpacking.unconsumed_tail:
        raise ValueError(f"a variable of more than {LARGEST_BYTES} bytes")
    return found
