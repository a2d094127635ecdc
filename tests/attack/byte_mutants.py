"""Mutants of binary files and frames with numbers at fixed positions."""

import random
import struct

EDGES = (
    *(0, 1, 2),
    *(edge for bits in (8, 16, 32) for edge in (2 ** (bits - 1) - 1, 2 ** (bits - 1), 2**bits - 1)),
    *(2**63, 2**64 - 1),
)
"""Values at which counts and lengths often fail."""
FLOATS = (float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 5e-324, -0.0, 0.0)
MOST_AT_ONCE = 6


def mutate_bytes(content: bytes, chance: random.Random, others: tuple[bytes, ...] = ()) -> bytes:
    """Change a few places of ``content``; ``others`` are files of the same format that give pieces."""
    data = bytearray(content)
    changes = [_flip, _overwrite, _overwrite_float, _cut, _repeat, _insert, _end_early, _blank]
    if others:
        changes.append(lambda held, by: _graft(held, by, by.choice(others)))
    for _ in range(chance.randint(1, MOST_AT_ONCE)):
        chance.choice(changes)(data, chance)
    return bytes(data)


def _place(data: bytearray, chance: random.Random) -> int:
    """Return a random position; headers are preferred, since they describe the format."""
    if not data:
        return 0
    return chance.randrange(min(len(data), 512)) if chance.random() < 0.4 else chance.randrange(len(data))


def _flip(data: bytearray, chance: random.Random) -> None:
    if data:
        data[_place(data, chance)] ^= 1 << chance.randrange(8)


def _overwrite(data: bytearray, chance: random.Random) -> None:
    size = chance.choice((1, 2, 4, 8))
    number = chance.choice(EDGES) % 2 ** (8 * size)
    at = _place(data, chance)
    data[at : at + size] = number.to_bytes(size, chance.choice(("little", "big")))


def _overwrite_float(data: bytearray, chance: random.Random) -> None:
    at = _place(data, chance)
    number = struct.pack(chance.choice("<>") + "d", chance.choice(FLOATS))
    data[at : at + len(number)] = number


def _cut(data: bytearray, chance: random.Random) -> None:
    at = _place(data, chance)
    del data[at : at + chance.choice((1, 2, 7, 64, 1000))]


def _repeat(data: bytearray, chance: random.Random) -> None:
    at = _place(data, chance)
    piece = bytes(data[at : at + chance.choice((1, 4, 64, 512))])
    data[at:at] = piece * chance.choice((1, 2, 50))


def _insert(data: bytearray, chance: random.Random) -> None:
    at = _place(data, chance)
    data[at:at] = chance.randbytes(chance.choice((1, 3, 8, 100)))


def _end_early(data: bytearray, chance: random.Random) -> None:
    del data[_place(data, chance) :]


def _blank(data: bytearray, chance: random.Random) -> None:
    at = _place(data, chance)
    count = min(chance.choice((8, 64, 512)), len(data) - at)
    data[at : at + count] = bytes([chance.choice((0, 0xFF))]) * count


def _graft(data: bytearray, chance: random.Random, other: bytes) -> None:
    at = _place(data, chance)
    begin = _place(bytearray(other), chance)
    data[at:] = other[begin:]
