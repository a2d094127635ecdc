"""Base class of all models that are read from TOML or JSON files."""

import re
from collections.abc import Callable
from functools import partial
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

_NUMBER = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?inf|nan)\s*(%|[a-z]*)\s*", re.ASCII | re.IGNORECASE
)
_SCALES = {"": 1.0, "%": 0.01, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def number_of(text: str, *units: str) -> float:
    """Return the number [SI units] in `text`, which stands alone or is followed by one of `units`.

    Raises ValueError for other text, including ``1_0`` and digits of other scripts, which `float` accepts.
    """
    found = _NUMBER.fullmatch(text)
    if found is None or found[2] not in ("", *units):
        allowed = f", alone or with {' or '.join(units)}" if units else ""
        raise ValueError(f"{text!r} is not a number{allowed}")
    return float(found[1]) * _SCALES[found[2]]


def count_text(count: int, noun: str) -> str:
    """Return ``count`` with ``noun`` in the singular or plural: ``1 branch``, ``2 branches``."""
    plural = "es" if noun.endswith("ch") else "s"
    return f"{count} {noun}{'' if count == 1 else plural}"


class NumberWith:
    """Field type: a number, or text with a number and a unit. The field's limits apply to the SI value."""

    def __init__(self, *units: str) -> None:
        self._units = units

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = handler(source)
        return core_schema.no_info_before_validator_function(
            lambda given: number_of(given, *self._units) if isinstance(given, str) else given,
            number,
            json_schema_input_schema=core_schema.union_schema([number, core_schema.str_schema()]),
        )


def _number(given: object) -> object:
    if isinstance(given, bool | str):
        raise PydanticCustomError("number_type", "give a number")
    return given


def _time(given: object) -> object:
    # Refuse 1 and "1", which pydantic would read as seconds since 1970.
    if isinstance(given, int | float) or (isinstance(given, str) and not re.match(r"\d{4}-\d", given)):
        raise PydanticCustomError("datetime_type", "give a date, time and time zone")
    return given


def _entries(count: int, given: object) -> object:
    if isinstance(given, list) and len(given) != count:
        raise PydanticCustomError("tuple_length", f"give {count} entries, not {len(given)}")
    return given


def _check_of(schema: Any) -> Callable[[object], object] | None:
    match schema:
        case {"type": "datetime"}:
            return _time
        case {"type": "float" | "int"} | {"type": "literal", "expected": [int(), *_]}:
            # Do not use pydantic's strict mode, which refuses numpy's numbers, and 1e3 for an integer.
            return _number
        case {"type": "tuple", "items_schema": items} if "variadic_item_index" not in schema:
            return partial(_entries, len(items))
        case _:
            return None


def _with_checks(schema: Any) -> Any:
    """Return the core schema; it accepts only numbers in number fields, and checks the lengths of lists."""
    match schema:
        case {"type": "bool"}:
            return {**schema, "strict": True}
        case {"type": "dict", "values_schema": values}:
            # All keys of a table in TOML and JSON are text, even if their type is int.
            return {**schema, "values_schema": _with_checks(values)}
        case dict():
            inner, check = {key: _with_checks(value) for key, value in schema.items()}, _check_of(schema)
            return core_schema.no_info_before_validator_function(check, inner) if check else inner
        case list():
            return [_with_checks(value) for value in schema]
        case _:
            return schema


class FrozenModel(BaseModel):
    """Immutable model that refuses unknown keys, and text or booleans where a number is required.

    pydantic alone would read ``true`` as 1 and ``"45e-6"`` as a number. In a file both values are mistakes:
    ``true`` would become a mass of 1 kg. The check applies to every field at any depth.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the core schema of the model, with the checks of its fields."""
        schema: CoreSchema = _with_checks(handler(source))
        return schema
