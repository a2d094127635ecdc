"""Mutants of texts: TOML, and lines of fields as in CSV and universal files."""

import random
import re

from .byte_mutants import mutate_bytes

NUMBERS = (
    "0", "-0.0", "-1", "1", "2", "1e9", "1000000000", "1e-300", "1e300", "1.7976931348623157e308", "-1e308",
    "nan", "-nan", "inf", "-inf", "9223372036854775807", "9223372036854775808", "-9223372036854775809",
    "1" + "0" * 400, "-1" + "0" * 400, "0." + "0" * 400 + "1", "0xffffffffffffffff", "1_000", "1e", "00",
    "1.5.2",
)  # fmt: skip
"""Values at which sums, counts and conversions often fail; some are not numbers."""
TEXTS = (
    "", " ", "a", "a" * 300, "x" * 100_000, "../../etc/passwd", "/", ".", "..", "con", "a/b", "a\\b",
    "é" * 130, "\u202e", "\U0001f600", "\x00", "\n", "%s%n{}", "[bold]red[/]", "[/]", "true", "nan",
    "linear", "hertz", "power:0", "power:1e9", "power:-3", "power:3+", "power:" + "9" * 400,
    "power:" + "+".join(str(each) for each in range(1, 60)),
)  # fmt: skip
"""Texts at which names, paths and markup often fail."""
OTHER_VALUES = (
    "true", "false", "[]", "{}", "[[]]", "[1, 'a', 2.5]", "{ a = 1 }",
    "{ start = 1, stop = 2, step = 1e-300 }", "{ start = 0, stop = 1e300, step = 1 }",
    "{ start = 2, stop = 1, step = 1 }", "{ start = nan, stop = nan, step = nan }",
    "{ start = 0, stop = 9e6, step = 1 }", "{ start = 1, stop = 1" + "0" * 400 + ", step = 1 }",
    "2026-03-01", "2026-03-01T12:00:00Z", "9999-12-31T23:59:59-23:59", "0001-01-01T00:00:00+23:59",
    "12:00:00", "[" * 900 + "]" * 900, "{a=" * 900 + "1" + "}" * 900,
    "[" + ", ".join(["1e-6"] * 5000) + "]", "[" + ", ".join(map(str, range(1, 3000))) + "]",
)  # fmt: skip
"""Values of the wrong type, and tables and lists that are too large."""
KEYS = (
    "",
    "name",
    "kind",
    "unknown",
    "a.b",
    "a" * 300,
    '"quoted key"',
    "defaults",
    "__class__",
    "é",
    "start",
)
MOST_AT_ONCE = 4

_VALUE = re.compile(
    r"""(?P<text>"[^"\n]*"|'[^'\n]*')|(?P<number>(?<![\w.])[-+]?\d[\d_.eE+-]*)|(?P<word>\b(?:true|false)\b)"""
)
_KEY = re.compile(r"(?m)(?P<key>[A-Za-z_][A-Za-z0-9_]*)\s*=")


def mutate_toml(text: str, chance: random.Random, others: tuple[str, ...] = ()) -> bytes:
    """Change a few values, keys, lines or tables of a TOML file; sometimes a few bytes too."""
    changes = [_other_value] * 6 + [_near_number] * 3 + [_other_key] * 2
    changes += [_without_line, _line_twice, _exchange_lines, _other_table]
    if others:
        changes.append(lambda held, by: _line_from(held, by, by.choice(others)))
    for _ in range(chance.randint(1, MOST_AT_ONCE)):
        text = chance.choice(changes)(text, chance)
    content = text.encode("utf-8", errors="surrogatepass")
    return mutate_bytes(content, chance) if chance.random() < 0.08 else content


def any_value(chance: random.Random) -> str:
    """Return a value of any type as TOML."""
    match chance.randrange(4):
        case 0:
            return _quote(chance.choice(TEXTS))
        case 1:
            return chance.choice(OTHER_VALUES)
        case _:
            return chance.choice(NUMBERS)


def _quote(text: str) -> str:
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in text) + '"'


def _other_value(text: str, chance: random.Random) -> str:
    found = list(_VALUE.finditer(text))
    if not found:
        return text
    one = chance.choice(found)
    # Values of the same type are chosen more often, since others are refused at once.
    match one.lastgroup, chance.random() < 0.6:
        case "number", True:
            value = chance.choice(NUMBERS)
        case "text", True:
            value = _quote(chance.choice(TEXTS))
        case _:
            value = any_value(chance)
    return text[: one.start()] + value + text[one.end() :]


def _near_number(text: str, chance: random.Random) -> str:
    """Scale a number or change its sign, as a typing error does."""
    found = [each for each in _VALUE.finditer(text) if each.lastgroup == "number"]
    if not found:
        return text
    one = chance.choice(found)
    try:
        number = float(one.group().replace("_", ""))
    except ValueError:
        return text
    value = repr(number * chance.choice((-1.0, 1e-3, 1e3, 1e6, 1e-6, 1e9, 0.5, 2.0, 1e12)))
    return text[: one.start()] + value + text[one.end() :]


def _other_key(text: str, chance: random.Random) -> str:
    found = list(_KEY.finditer(text))
    if not found:
        return text
    one = chance.choice(found)
    begin, end = one.span("key")
    key = chance.choice((*KEYS, chance.choice(found)["key"]))
    return text[:begin] + key + text[end:]


def _lines(text: str) -> list[str]:
    return text.split("\n")


def _without_line(text: str, chance: random.Random) -> str:
    lines = _lines(text)
    del lines[chance.randrange(len(lines))]
    return "\n".join(lines)


def _line_twice(text: str, chance: random.Random) -> str:
    lines = _lines(text)
    at = chance.randrange(len(lines))
    lines[at:at] = [lines[at]] * chance.choice((1, 1, 2, 40))
    return "\n".join(lines)


def _exchange_lines(text: str, chance: random.Random) -> str:
    lines = _lines(text)
    a, b = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return "\n".join(lines)


def _other_table(text: str, chance: random.Random) -> str:
    lines = _lines(text)
    heads = [number for number, line in enumerate(lines) if line.startswith("[")]
    if not heads:
        return f"[{chance.choice(KEYS)}]\n{text}"
    at = chance.choice(heads)
    head = lines[at].strip()
    inner = head.strip("[]")
    lines[at] = chance.choice(
        (f"[[{inner}]]", f"[{inner}]", f"[{inner}.{inner}]", f"[{'.'.join([inner] * 200)}]", "")
    )
    return "\n".join(lines)


def _line_from(text: str, chance: random.Random, other: str) -> str:
    lines = _lines(text)
    lines.insert(chance.randrange(len(lines) + 1), chance.choice(_lines(other)))
    return "\n".join(lines)


_FIELD = re.compile(r"[^,;\s]+")


def mutate_fields(text: str, chance: random.Random) -> bytes:
    """Change a few fields or lines of a text table; sometimes a few bytes too."""
    for _ in range(chance.randint(1, MOST_AT_ONCE)):
        text = chance.choice((_other_field, _other_field, _without_line, _line_twice, _exchange_lines))(
            text, chance
        )
    content = text.encode("utf-8", errors="surrogatepass")
    return mutate_bytes(content, chance) if chance.random() < 0.25 else content


def _other_field(text: str, chance: random.Random) -> str:
    # The header describes all other lines, so it is changed as often as all other lines together.
    room = text if chance.random() < 0.5 else text[:1500]
    found = list(_FIELD.finditer(room))
    if not found:
        return text
    one = chance.choice(found)
    value = chance.choice(
        (chance.choice(NUMBERS), chance.choice(TEXTS), one.group() * 2, "", ",", ";;", "1,5")
    )
    return text[: one.start()] + value + text[one.end() :]
