"""Mutants of JSON documents: values of other types and sizes, additional and missing keys."""

import json
import random
from typing import Any

from .byte_mutants import FLOATS, mutate_bytes
from .text_mutants import TEXTS

NUMBERS = (0, -1, 1, 0.5, 2**31, 2**63, -(2**63) - 1, 10**400, 1e-320, *FLOATS)
OTHERS = (None, True, False, [], {}, [[]], [None] * 50, {"": {}}, {"ask": "stop"}, "2026-01-01", 1 << 70)


def mutate_json(document: Any, chance: random.Random) -> bytes:
    """Change one to three places of a document; sometimes a few bytes too."""
    changed = json.loads(json.dumps(document))
    for _ in range(chance.randint(1, 3)):
        changed = _change(changed, chance)
    text = json.dumps(changed).encode()
    if chance.random() < 0.04:
        depth = chance.choice((50, 900, 20_000))
        return b'{"a":' * depth + text + b"}" * depth
    return mutate_bytes(text, chance) if chance.random() < 0.1 else text


def _change(document: Any, chance: random.Random) -> Any:
    """Go down to a random place and replace the value there."""
    if chance.random() < 0.93:
        if isinstance(document, dict) and document:
            key = chance.choice(list(document))
            match chance.randrange(8):
                case 0:
                    return {name: value for name, value in document.items() if name != key}
                case 1:
                    return {
                        **document,
                        chance.choice(("unknown", "", "ask", "kind", key * 2)): value_of(chance),
                    }
                case _:
                    return {**document, key: _change(document[key], chance)}
        if isinstance(document, list) and document:
            at = chance.randrange(len(document))
            if chance.random() < 0.2:
                return document + [document[at]] * chance.choice((1, 3, 300))
            return [*document[:at], _change(document[at], chance), *document[at + 1 :]]
    if isinstance(document, int | float) and chance.random() < 0.5:
        return chance.choice(NUMBERS)
    return value_of(chance)


def value_of(chance: random.Random) -> Any:
    """Return a value of any type."""
    return chance.choice((chance.choice(NUMBERS), chance.choice(TEXTS), chance.choice(OTHERS)))
