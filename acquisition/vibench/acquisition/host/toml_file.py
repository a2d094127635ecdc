"""Reading, validation and writing of TOML files; errors name file, key and allowed values."""

import json
import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from enum import StrEnum
from itertools import compress
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from vibench.sim import (
    FrozenModel as FrozenModel,  # noqa: PLC0414 - models of all files are validated like a specimen
    UnreadableTomlError,
    fault_in_words,
    toml_table,
)
from vibench.sim.operating_system.this import replace_file

from ..errors import ConfigurationError
from .installation import shipped_folder
from .printable import leading, shorten
from .schema import FORMAT, VERSION, schema_line

Model = TypeVar("Model", bound=BaseModel)


def load_toml(path: Path, model: type[Model]) -> Model:
    """Read a TOML file as an instance of ``model``; paths in the file are relative to the file's folder.

    Validators receive the file's folder as ``folder`` in their context.

    Raises ConfigurationError when the file is missing, is not TOML, or contains anything that the model does
    not allow.
    """
    try:
        content = toml_table(path)
    except UnreadableTomlError as error:
        raise ConfigurationError(str(error)) from error
    return from_toml(content, model, path)


def from_toml(content: dict[str, Any], model: type[Model], path: Path) -> Model:
    """Read the content of a TOML file as ``model``; see `load_toml`.

    Raises ConfigurationError when the file's version is not an integer from 1 to the current version.
    """
    written = content.pop(FORMAT, VERSION)
    if not isinstance(written, int) or isinstance(written, bool) or not 1 <= written <= VERSION:
        raise ConfigurationError(
            f"{path}: {FORMAT} = {_text_of(written)} cannot be read; this version of vibench reads versions "
            f"1 to {VERSION}: install a later version"
        )
    return validate(content, model, str(path), path.absolute().parent)


def validate(content: dict[str, Any], model: type[Model], origin: str, folder: Path | None = None) -> Model:
    """Validate ``content`` of TOML or JSON as ``model``; paths in the content are relative to ``folder``.

    Raises ConfigurationError, which names ``origin`` and the key, when the model does not allow the content.
    """
    try:
        return model.model_validate(content, context={"folder": folder})
    except ValidationError as error:
        raise ConfigurationError(f"{origin}: {complaints(error, content, model)}") from error
    except ArithmeticError as error:
        raise ConfigurationError(
            f"{origin}: a number is too large or too small to compute with ({error}); correct this number"
        ) from error


MOST_CLAUSES = 5
"""Largest number of faults named in one error; further faults are only counted."""
MOST_KEYS = 12
LONGEST_SENTENCE = 1600


Place = tuple[str | int, ...]


def complaints(error: ValidationError, content: object, model: type[BaseModel], within: Place = ()) -> str:
    """Return one clause for each fault, one clause for all missing keys, and one clause for all unknown keys.

    The ``content`` of the file serves to distinguish keys from the type names that pydantic adds to paths.
    Faults outside the path ``within`` are left out.
    """
    details = [each for each in _faults(error, content) if each["loc"][: len(within)] == within]
    unknown = [each["loc"] for each in details if each["type"] == "extra_forbidden"]
    similar = {place: near for place in unknown if (near := _similar_key(place, model))}
    intended = {(*place[:-1], near) for place, near in similar.items()}
    absent = [each["loc"] for each in details if each["type"] == "missing" and each["loc"] not in intended]
    other = [_complaint(each) for each in details if each["type"] not in {"missing", "extra_forbidden"}]
    other += [f"{_key(place)} is not a known key (did you mean {near}?)" for place, near in similar.items()]
    missing = _key_clause(absent, "is missing: it is required", "are missing: they are required")
    strange = _key_clause(
        [place for place in unknown if place not in similar],
        "is not a known key: check its spelling and unit suffix, or remove it",
        "are not known keys: check their spelling and unit suffixes, or give another file",
    )
    return shorten("; ".join([*leading(other, MOST_CLAUSES), *missing, *strange]), LONGEST_SENTENCE)


def _similar_key(place: Place, model: type[BaseModel]) -> str:
    """Return the key of the model that is most similar to the unknown key at `place`, or empty text."""
    models = [model]
    for part in place[:-1]:
        fields = [each.model_fields[part] for each in models if part in each.model_fields]
        tagged = [each for each in models if part in get_args(each.__annotations__.get("kind"))]
        models = [each for field in fields for each in _models(field.annotation)] or tagged or models
    known = sorted({key for each in models for key in each.model_fields})
    return next(iter(get_close_matches(str(place[-1]), known, 1)), "")


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models that the type of a field contains."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for each in get_args(annotation):
        yield from _models(each)


def _faults(error: ValidationError, content: object) -> list[Any]:
    """Return each fault once; if a key allows several types, only the faults of the most probable type.

    Consequences of another fault are left out: a value derived from a faulty key, and a list that is too
    short only because an item is faulty.
    """
    errors = error.errors()
    meant: dict[Place, dict[Place, list[Any]]] = {}
    for each in errors:
        place = each["loc"]
        is_short = each["type"] == "too_short"
        within = [other for other in errors if other["loc"][: len(place)] == place and other is not each]
        if each["type"] == "default_factory_not_called" or (is_short and within):
            continue
        is_key = _of_the_file(each, content)
        cut = is_key.index(False) if False in is_key else len(place)
        by_keys = {**each, "loc": tuple(compress(place, is_key))}
        meant.setdefault(place[:cut], {}).setdefault(place[cut : cut + 1], []).append((each, by_keys))
    return [each for kinds in meant.values() for each in _of_the_nearest(list(kinds.values()))]


def _of_the_nearest(kinds: Sequence[list[tuple[Any, Any]]]) -> Iterator[Any]:
    """Return the faults of the type that fits the file's value best."""
    if len(kinds) == 1:
        return (each for each, _ in kinds[0])
    return (by_keys for _, by_keys in max(kinds, key=_closeness))


def _of_the_file(fault: Any, content: object) -> list[bool]:
    """For each part of the path to a fault, return whether the part is a key of the file (else a type).

    pydantic adds the type after a key with several types: ``frequency_hz``, ``Range``, ``step``. A key of the
    file may have the name of a type.
    """
    place, found = fault["loc"], []
    for number, part in enumerate(place):
        match content:
            case Mapping() if part in content:
                content = content[part]
                found.append(True)
            case list() | tuple() if isinstance(part, int) and part < len(content):
                content = content[part]
                found.append(True)
            case _:
                found.append(fault["type"] == "missing" and number == len(place) - 1)
    return found


def _closeness(faults: Sequence[tuple[Any, Any]]) -> tuple[int, bool]:
    """Return how well a value fits a type: a fault in content or size counts less than a wrong type."""
    return max((len(each["loc"]), not each["type"].endswith("_type")) for each, _ in faults)


def _key_clause(places: Sequence[Place], of_one: str, of_many: str) -> tuple[str, ...]:
    keys = leading([_key(each) for each in places], MOST_KEYS)
    return (f"{', '.join(keys)} {of_one if len(keys) == 1 else of_many}",) if keys else ()


def _key(place: Place) -> str:
    return shorten(".".join(str(part) for part in place), 120) or "the whole file"


def _complaint(detail: Any) -> str:
    reason = shorten(fault_in_words(detail))
    if not detail["loc"]:
        return reason
    # Do not show a whole table, which is too long; the reason names the wrong entry.
    given = "" if _is_nested(detail["input"]) else f" = {_text_of(detail['input'])}"
    return f"{_key(detail['loc'])}{given}: {reason[0].lower()}{reason[1:]}"


def _text_of(value: object) -> str:
    longest = 60
    # Shorten lists while formatting: a whole list of a million numbers would take too long.
    match value:
        case list() | tuple() | dict():
            text = reprlib.repr(value)
        case bool():
            text = str(value).lower()
        case date():
            text = value.isoformat()
        case _:
            text = repr(value)
    return text if len(text) <= longest else f"{text[:longest]}..."


Scalar = str | bool | int | float
Value = Scalar | list["Value"] | dict[str, "Value"]
Table = Mapping[str, Value]


def toml_text(model: BaseModel) -> str:
    """Return ``model`` as TOML: tables for models, arrays of tables for tuples of models.

    None values are left out, because TOML has no null; floats keep all digits.
    """
    content: dict[str, Value] = model.model_dump(mode="json", exclude_none=True)
    return "\n".join(_table(content, ())).lstrip("\n") + "\n"


def save_toml(model: BaseModel, path: Path) -> None:
    """Write ``model`` to a file, and create missing folders.

    Raises ConfigurationError when the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        schema = schema_line(model, shipped_folder("schemas"))
        with replace_file(path) as coming:
            coming.write_text(schema + toml_text(model), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"{path}: cannot be written ({error.strerror}); save the file elsewhere"
        ) from error


def _table(content: Table, path: tuple[str, ...]) -> Iterator[str]:
    nested = {key: value for key, value in content.items() if _is_nested(value)}
    for key, value in content.items():
        if key not in nested:
            yield f"{key} = {_value(value)}"
    for key, value in nested.items():
        inner = (*path, key)
        name = ".".join(inner)
        for element in value if isinstance(value, list) else [value]:
            assert isinstance(element, dict), "_is_nested allows only tables and lists of tables"
            yield f"\n[[{name}]]" if isinstance(value, list) else f"\n[{name}]"
            yield from _table(element, inner)


def _is_nested(value: Value) -> bool:
    return isinstance(value[0] if isinstance(value, list | tuple) and value else value, dict)


def _value(value: Value) -> str:
    match value:
        case str():
            # JSON's escapes are valid in TOML. TOML also requires an escape for DEL.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case list():
            return f"[{', '.join(_value(element) for element in value)}]"
        case dict():
            return f"{{ {', '.join(f'{key} = {_value(element)}' for key, element in value.items())} }}"


Choice = TypeVar("Choice", bound=StrEnum)


def member(kind: type[Choice], given: Choice | str) -> Choice:
    """Return the given member, or the member with the given value; ConfigurationError if there is none.

    >>> from enum import StrEnum
    >>> Ground = StrEnum("Ground", ["SAND", "CLAY"])
    >>> member(Ground, "clay")
    <Ground.CLAY: 'clay'>
    """
    try:
        return kind(given)
    except ValueError as unknown:
        raise ConfigurationError(
            f"{given!r} is not a value of {kind.__name__}; give one of {', '.join(map(repr, map(str, kind)))}"
        ) from unknown


@dataclass(frozen=True)
class ChosenFrom:
    """Marker in the ``Annotated`` type of a text field whose value is usually chosen from a list."""

    texts: Callable[[], Iterable[str]]
