"""TOML files out: a plan as text that reads back as exactly the same plan."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from pydantic import BaseModel

from ..errors import ConfigurationError

Scalar = str | bool | int | float
Value = Scalar | list["Value"] | dict[str, "Value"]
Table = Mapping[str, Value]


def toml_text(model: BaseModel) -> str:
    """Write ``model`` as TOML: tables for models, arrays of tables for tuples of models.

    Absent values (None) are left out, as TOML has none; floats keep every digit.
    """
    content: dict[str, Value] = model.model_dump(mode="json", exclude_none=True)
    return "\n".join(_table(content, ())).lstrip("\n") + "\n"


def save_toml(model: BaseModel, path: Path) -> None:
    """Write ``model`` to a file, in folders that are made where they are missing.

    Raises
    ------
    ConfigurationError
        When the file cannot be written.

    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(toml_text(model), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"{path}: cannot be written ({error.strerror}); save it elsewhere"
        ) from error


def _table(content: Table, path: tuple[str, ...]) -> Iterator[str]:
    nested = {key: value for key, value in content.items() if _is_nested(value)}
    for key, value in content.items():
        if key not in nested:
            yield f"{key} = {_value(value)}"
    for key, value in nested.items():
        inner = (*path, key)
        match value:
            case dict():
                yield f"\n[{'.'.join(inner)}]"
                yield from _table(value, inner)
            case list():
                for element in value:
                    assert isinstance(element, dict), "_is_nested lets through lists of tables only"
                    yield f"\n[[{'.'.join(inner)}]]"
                    yield from _table(element, inner)


def _is_nested(value: Value) -> bool:
    match value:
        case dict():
            return True
        case [dict(), *_]:
            return True
        case _:
            return False


def _value(value: Value) -> str:
    match value:
        case str():
            # JSON's escapes are TOML's, but for DEL, which only TOML wants escaped.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case list():
            return f"[{', '.join(_value(element) for element in value)}]"
        case dict():
            return f"{{ {', '.join(f'{key} = {_value(element)}' for key, element in value.items())} }}"
