"""Answers put into the text of a commented configuration; comments on what was not asked stay."""

import json
import re
import tomllib
from collections.abc import Mapping
from datetime import date
from typing import Any

from ..errors import ConfigurationError

_KEY = r"^(?P<key>{key}[ \t]*=[ \t]*)(?P<value>{value})(?P<comment>[ \t]*(?:#.*)?)$"
_VALUE = r"\"[^\"]*\"|\{[^}]*\}|[^\s#]+"
_CHANNEL = "daq.channels."


def value_in(text: str, key: str) -> str:
    """Give what the template holds, as it is written; empty where it says nothing of the key."""
    found = _place(text, key)
    return "" if found is None else found.group("value")


def with_answer(text: str, key: str, answer: str, note: str) -> str:
    """Put an answer in the place of what the template holds, with a note who gave it.

    Raises ConfigurationError when it is of another kind than what stands there (a word for a number, no
    date), or the template has no such table.
    """
    found = _place(text, key)
    if found is not None:
        begin, end = found.span()
        line = f"{found.group('key')}{_literal(found.group('value'), answer, key, note)}  # {note}"
        return text[:begin] + line + text[end:]
    begin, end, name = _table(text, key)
    if end == 0:
        raise ConfigurationError(f"the template has no place for {key}; leave it out of the answers")
    header = text.index("\n", begin) + 1
    return f"{text[:header]}{name} = {_guessed(answer)}  # {note}\n{text[header:]}"


def place_of(content: Mapping[str, Any], key: str) -> tuple[str | int, ...]:
    """Return the path of a question's key in the content of a configuration."""
    if not key.startswith(_CHANNEL):
        return tuple(key.split("."))
    role, _, name = key.removeprefix(_CHANNEL).partition(".")
    roles = [channel.get("role") for channel in content["daq"]["channels"]]
    return ("daq", "channels", roles.index(role), name)


def _guessed(answer: str) -> str:
    """Write an answer to what the template says nothing of: a number where it reads as one."""
    try:
        return _as_toml(answer)
    except ValueError:
        return json.dumps(answer, ensure_ascii=False)


def _as_toml(number: str) -> str:
    """Write a number as TOML does, which has no .5 and no 010; raises ValueError where it is none."""
    value = float(number)
    try:
        tomllib.loads(f"number = {number}")
    except tomllib.TOMLDecodeError:
        return repr(value)
    return number


def _place(text: str, key: str) -> re.Match[str] | None:
    begin, end, name = _table(text, key)
    pattern = re.compile(_KEY.format(key=re.escape(name), value=_VALUE), re.MULTILINE)
    return pattern.search(text, begin, end)


def _table(text: str, key: str) -> tuple[int, int, str]:
    """Find the stretch of text in which a key stands, and its name there."""
    if key.startswith(_CHANNEL):
        role, _, name = key.removeprefix(_CHANNEL).partition(".")
        begins = [found.start() for found in re.finditer(r"^\[\[daq\.channels\]\]$", text, re.MULTILINE)]
        for begin in begins:
            end = _end(text, begin + 1)
            if f'role = "{role}"' in text[begin:end]:
                return begin, end, name
        return 0, 0, name
    table, _, name = key.rpartition(".")
    if not table:
        return 0, _end(text, 0), name
    found = re.search(rf"^\[{re.escape(table)}\]$", text, re.MULTILINE)
    return (0, 0, name) if found is None else (found.start(), _end(text, found.end()), name)


def _end(text: str, begin: int) -> int:
    following = re.compile(r"^\[", re.MULTILINE).search(text, begin)
    return len(text) if following is None else following.start()


def _literal(held: str, answer: str, key: str, note: str) -> str:
    """Write an answer in the kind of what it takes the place of."""
    value: Any = tomllib.loads(f"value = {held}")["value"]
    match value:
        case str() if "/" in value:  # a sensitivity with its unit
            return _guessed(answer)
        case str():
            return json.dumps(answer, ensure_ascii=False)
        case dict():
            return f"{{ value = {_number(answer, key)}, source = {json.dumps(note, ensure_ascii=False)} }}"
        case date():
            try:
                return date.fromisoformat(answer).isoformat()
            except ValueError as error:
                raise ConfigurationError(f"{key}: {answer!r} is no date; give one as 2026-02-10") from error
        case _:
            return _number(answer, key)


def _number(answer: str, key: str) -> str:
    try:
        return _as_toml(answer)
    except ValueError as error:
        if "/" in answer:  # a sensitivity with its unit
            return json.dumps(answer, ensure_ascii=False)
        raise ConfigurationError(f"{key}: {answer!r} is no number; give one, such as 0.1 or 2e-3") from error
