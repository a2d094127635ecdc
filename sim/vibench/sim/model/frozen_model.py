"""The base of every model that a TOML or JSON file describes."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema


def _number(given: object) -> object:
    if isinstance(given, bool | str):
        raise PydanticCustomError("number_type", "give a number")
    return given


def _with_numbers_only(schema: Any) -> Any:
    """Return a core schema in which nothing but a number is read as a number, nor as a truth value."""
    match schema:
        case {"type": "float" | "int"} | {"type": "literal", "expected": [int(), *_]}:
            # pydantic's own strict mode would also refuse 1e3 for an integer, and numpy's numbers.
            return core_schema.no_info_before_validator_function(_number, {**schema})
        case {"type": "bool"}:
            return {**schema, "strict": True}
        case {"type": "dict", "values_schema": values}:
            # Keys of a table are text, also where they count.
            return {**schema, "values_schema": _with_numbers_only(values)}
        case dict():
            return {key: _with_numbers_only(value) for key, value in schema.items()}
        case list():
            return [_with_numbers_only(value) for value in schema]
        case _:
            return schema


class FrozenModel(BaseModel):
    """Immutable, without unknown keys, and with numbers only where numbers are asked for.

    pydantic reads ``true`` as 1 and ``"45e-6"`` as a number. In a file both are slips of the pen, and
    would become a mass of 1 kg. So every number of every field, however deep, must be a number.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of the model, in which numbers are numbers."""
        schema: CoreSchema = _with_numbers_only(handler(source))
        return schema


class UnreadableTomlError(ValueError):
    """A file that cannot be read, or is no TOML; the sentence begins with its path."""


def toml_table(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    UnreadableTomlError
        In one sentence, when the file is missing, is no text, or is not TOML.

    """
    try:
        # Editors on Windows begin a file with a byte-order mark.
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UnreadableTomlError(
            f"{path}: cannot be read ({error.strerror}); give the path of a TOML file"
        ) from error
    except UnicodeDecodeError as error:
        raise UnreadableTomlError(f"{path}: is not UTF-8 text; save it as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise UnreadableTomlError(f"{path}: is not valid TOML: {error}; correct that line") from error
    except RecursionError as error:
        raise UnreadableTomlError(
            f"{path}: holds lists or tables within each other, too many to be read; write them side by side"
        ) from error


_ENUM_MEMBER = re.compile(r"<\w+\.\w+: ('[^']*')>")
"""A word as Python shows it, ``<Start.UP: 'up'>``."""
_LIST, _TABLE = "give a list, in square brackets", "give a table"
_TIME = "give a date, time and time zone, such as 2026-03-01T12:00:00Z"
_IN_WORDS_OF_TOML: Mapping[str, str] = {
    "list_type": _LIST,
    "tuple_type": _LIST,
    "dict_type": _TABLE,
    "model_type": _TABLE,
    "model_attributes_type": _TABLE,
    "too_short": "give {min_length} or more of them, not {actual_length}",
    "too_long": "give {max_length} of them or fewer, not {actual_length}",
    "string_type": "give text, in quotes",
    "string_too_short": "give text of {min_length} or more letters",
    "string_too_long": "give {max_length} letters or fewer",
    "float_parsing": "give a number",
    "int_parsing": "give a whole number",
    "int_from_float": "give a whole number",
    "datetime_type": _TIME,
    "datetime_parsing": _TIME,
    "datetime_from_date_parsing": _TIME,
    "timezone_aware": _TIME,
    "bool_type": "give true or false",
    "union_tag_not_found": "{discriminator} is missing: it says what this is",
    "union_tag_invalid": "{discriminator} = '{tag}' is not known; allowed are {expected_tags}",
}
"""What pydantic says in words of Python, by its type of fault."""


def fault_in_words(fault: Mapping[str, Any]) -> str:
    """Say what a value of a TOML file should be, in words of TOML and not of Python.

    Parameters
    ----------
    fault
        One of the ``errors()`` of a pydantic ``ValidationError``.

    """
    plain = _IN_WORDS_OF_TOML.get(fault["type"])
    said = str(fault["msg"]) if plain is None else plain.format(**fault.get("ctx", {}))
    return _ENUM_MEMBER.sub(r"\1", said.removeprefix("Value error, "))
