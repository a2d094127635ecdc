"""JSON Schemas of the TOML files that users write, for editors that complete keys.

Draft 4 is used, because taplo, the TOML language server of most editors, supports no later draft. A schema
never refuses what its model allows. It allows more where defaults or a named specimen may supply values.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel

from ..errors import ConfigurationError

VERSION = 1
"""Version of all schemas; the version changes when old files become invalid."""
FORMAT = "format_version"
"""Key of a file's version; a file without this key has the current version."""
DRAFT = "http://json-schema.org/draft-04/schema#"
_SPECIMEN = {"type": "string", "description": "Name or path of the specimen that this table changes."}
_RANGE = {
    "type": "object",
    "properties": {each: {"type": "number"} for each in ("start", "stop", "step")},
    "required": ["start", "stop", "step"],
    "additionalProperties": False,
}
Json = dict[str, Any]


def _with_defaults(schema: Json) -> None:
    """Make optional the keys that ``[defaults]`` and templates can supply."""
    parts = schema["definitions"]
    kinds = [
        part["$ref"].rpartition("/")[2] for part in parts["Measurement"]["properties"]["excitation"]["oneOf"]
    ]
    for name in (*kinds, "Measurement"):
        parts[name]["required"] = ["kind"] if "kind" in parts[name]["properties"] else []
    shared: Json = {
        name: part for name, part in parts["Measurement"]["properties"].items() if name not in {"name"}
    }
    for name in kinds:
        of_kind = {**parts[name], "required": []}
        del of_kind["required"]
        parts[f"Shared{name}"] = of_kind
        for word in parts[name]["properties"]["kind"]["enum"]:
            shared[word] = {"$ref": f"#/definitions/Shared{name}"}
    schema["properties"]["defaults"] = {"type": "object", "properties": shared, "additionalProperties": False}
    template = {"anyOf": [{"$ref": f"#/definitions/Shared{name}"} for name in kinds]}
    parts["Template"] = {
        **parts["Measurement"],
        "properties": {**parts["Measurement"]["properties"], "excitation": template},
    }
    del parts["Template"]["required"], parts["Measurement"]["required"]
    parts["Sweep"]["properties"]["measurement"] = {"$ref": "#/definitions/Template"}
    parts["Sweep"]["properties"]["excitations"] = {"type": "array", "items": template}


def _with_a_base(schema: Json) -> None:
    """Allow a specimen that starts from a named specimen, or is given only by name."""
    for name, part in schema["definitions"].items():
        if "masses_kg" in part.get("properties", {}):
            _starts_from_another(part)
            schema["definitions"][name] = {"anyOf": [{"type": "string"}, part]}


def _starts_from_another(part: Json) -> None:
    """Make optional the keys that a named specimen supplies, and allow a stop on one side only."""
    part["properties"]["model"] = _SPECIMEN
    part.pop("required", None)
    for side in part["properties"]["gap_m"]["anyOf"][1]["items"]:
        side["type"], side["pattern"] = ["number", "string"], "^inf$"


def _with_ranges(schema: Json) -> None:
    """Allow ranges of frequencies, alone or in a list, and the specimen's former key ``structure``."""
    _with_a_base(schema)
    several = {"type": "array", "items": {"anyOf": [{"type": "number"}, _RANGE]}, "minItems": 1}
    schema["properties"]["frequencies_hz"] = {"anyOf": [_RANGE, several]}
    schema["properties"]["structure"] = schema["properties"]["specimen"]


@dataclass(frozen=True)
class _Kind:
    package: str
    model: str
    widen: Callable[[Json], None]

    def load(self) -> type[BaseModel]:
        found: type[BaseModel] = getattr(import_module(self.package), self.model)
        return found


SCHEMAS: Mapping[str, _Kind] = {
    "campaign": _Kind("vibench.acquisition.plan", "Campaign", _with_defaults),
    "rig": _Kind("vibench.acquisition.rig", "Rig", _with_a_base),
    "study": _Kind("vibench.sim.study", "Study", _with_ranges),
    "map": _Kind("vibench.sim.maps", "Map", _with_a_base),
    "mapping": _Kind("vibench.analysis.exchange", "ImportMapping", _with_a_base),
    "specimen": _Kind("vibench.sim", "SpecimenDescription", _starts_from_another),
}
"""Schemas by kind of file. Models are imported only when needed, because they belong to higher packages."""


def json_schema(kind: str) -> Json:
    """Return the JSON Schema (draft 4) of a ``kind`` of TOML file.

    Kinds are ``campaign``, ``rig``, ``study``, ``map``, ``mapping`` and ``specimen``; any other word raises
    ConfigurationError.
    """
    if kind not in SCHEMAS:
        raise ConfigurationError(f"there is no schema {kind!r}; give one of {', '.join(SCHEMAS)}")
    made: Json = _draft_4(SCHEMAS[kind].load().model_json_schema())
    made["properties"][FORMAT] = {"enum": [VERSION]}
    SCHEMAS[kind].widen(made)
    return {"$schema": DRAFT, "title": f"vibench {kind}, version {VERSION}", **made}


def schema_line(model: BaseModel, schemas: Path) -> str:
    """Return the line that tells an editor the schema of a file of ``model``; empty if no schema exists.

    ``schemas`` is the folder of the schemas, as ``shipped_folder("schemas")`` gives it.
    """
    names = {each.__name__ for each in type(model).__mro__}
    kind = next((kind for kind, each in SCHEMAS.items() if each.model in names), None)
    return "" if kind is None else f"#:schema {(schemas / f'{kind}-{VERSION}.schema.json').as_uri()}\n"


def _draft_4(part: Any) -> Any:
    """Convert a schema of pydantic (draft 2020-12) to draft 4; omit null, which TOML does not have."""
    match part:
        case list():
            return [_draft_4(each) for each in part]
        case dict():
            part = cast("Json", part)
            return _older(
                {_KEYS.get(key, key): _draft_4(each) for key, each in part.items() if key not in _NEW}
            )
        case str():
            return part.replace("#/$defs/", "#/definitions/")
        case _:
            return part


_KEYS: Mapping[str, str] = {"$defs": "definitions"}
_NEW = frozenset({"discriminator", "title", "examples", "propertyNames"})


def _older(part: Json) -> Json:
    if "const" in part:
        part["enum"] = [part.pop("const")]
    for limit, exclusive in (("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum")):
        if not isinstance(part.get(exclusive), bool) and isinstance(part.get(exclusive), int | float):
            part[limit], part[exclusive] = part[exclusive], True
    if "prefixItems" in part:
        part["items"], part["additionalItems"] = part.pop("prefixItems"), False
    choices = part.get("anyOf")
    if isinstance(choices, list):
        kept = [each for each in choices if each != {"type": "null"}]
        part["anyOf"] = kept
        if part.get("default", ...) is None:
            del part["default"]
    if "$ref" in part and len(part) > 1:  # draft 4 ignores other keys next to $ref
        part["allOf"] = [{"$ref": part.pop("$ref")}]
    return part
