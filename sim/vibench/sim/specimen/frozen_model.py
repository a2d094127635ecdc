"""Base class of every model that a TOML or JSON file describes."""

import re
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema


def _number(given: object) -> object:
    if isinstance(given, bool | str):
        raise PydanticCustomError("number_type", "give a number")
    return given


def _time(given: object) -> object:
    if isinstance(given, int | float) or (isinstance(given, str) and not re.match(r"\d{4}-\d", given)):
        raise PydanticCustomError("datetime_type", "give a date, time and time zone")
    return given


def _with_numbers_only(schema: Any) -> Any:
    """Return a core schema that reads only numbers as numbers and only booleans as booleans."""
    match schema:
        case {"type": "float" | "int"} | {"type": "literal", "expected": [int(), *_]}:
            # pydantic's own strict mode would also refuse 1e3 for an integer, and numpy's numbers.
            return core_schema.no_info_before_validator_function(_number, {**schema})
        case {"type": "datetime"}:
            # pydantic reads 1 and "1" as seconds since 1970.
            return core_schema.no_info_before_validator_function(_time, {**schema})
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
    """Immutable model that refuses unknown keys and accepts only numbers as numbers.

    pydantic reads ``true`` as 1 and ``"45e-6"`` as a number. In a file both are mistakes, and ``true`` would
    become a mass of 1 kg. Therefore every number in every field, at any depth, must be a number.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of the model, in which numbers are numbers."""
        schema: CoreSchema = _with_numbers_only(handler(source))
        return schema
