"""TOML files in: parsed, validated, or refused with the file, the key, what was given, what is allowed."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from ..errors import ConfigurationError


class FrozenModel(BaseModel):
    """What crosses a file: immutable, complete, and deaf to keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False)


Model = TypeVar("Model", bound=BaseModel)


def load_toml(path: Path, model: type[Model]) -> Model:
    """Read a TOML file as ``model``.

    Raises
    ------
    ConfigurationError
        When the file is missing, is not TOML, or says something the model does not allow.

    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"{path}: cannot be read ({error.strerror}); give the path of a TOML file"
        ) from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path}: is not UTF-8 text; save it as UTF-8") from error
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{path}: is not valid TOML: {error}; correct that line") from error
    return validated(content, model, str(path))


def validated(content: dict[str, Any], model: type[Model], origin: str) -> Model:
    """Validate ``content`` as ``model``; errors name ``origin`` and the key."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise ConfigurationError(f"{origin}: {complaints(error)}") from error


def complaints(error: ValidationError) -> str:
    """Say in a clause each what a model did not allow; keys of one fault share theirs."""
    details = error.errors()
    missing = _key_clause(details, "missing", "is missing: it is required", "are missing: they are required")
    unknown = _key_clause(
        details,
        "extra_forbidden",
        "is not a known key: check its spelling and unit suffix, or remove it",
        "are no known keys: check their spelling and unit suffixes, or give another file",
    )
    other = (_complaint(each) for each in details if each["type"] not in {"missing", "extra_forbidden"})
    return "; ".join([*other, *missing, *unknown])


def _key_clause(details: Sequence[Any], kind: str, of_one: str, of_many: str) -> tuple[str, ...]:
    keys = [_key(each) for each in details if each["type"] == kind]
    match keys:
        case []:
            return ()
        case [key]:
            return (f"{key} {of_one}",)
        case _:
            return (f"{', '.join(keys)} {of_many}",)


def _key(detail: Any) -> str:
    return ".".join(str(part) for part in detail["loc"]) or "the whole file"


def _complaint(detail: Any) -> str:
    reason = str(detail["msg"]).removeprefix("Value error, ")
    return f"{_key(detail)} = {_shown(detail['input'])}: {reason[0].lower()}{reason[1:]}"


def _shown(value: object) -> str:
    text = repr(value)
    longest = 60
    return text if len(text) <= longest else f"{text[:longest]}..."
