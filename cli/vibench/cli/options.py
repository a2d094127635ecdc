"""Options of commands that are fields of a pydantic model, declared there alone.

The field's name, type, default and docstring become an option of the command line, as they become the field
of a form, a key of JSON and an attribute of HDF5 files. `RequestOptions` stands for them in the signature of
a command; what only the command line has is declared in the signature itself.
"""

import inspect
import re
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass
from enum import Enum
from functools import wraps
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar, Union, get_args, get_origin

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption
from typer.models import OptionInfo

from vibench.analysis import InvalidRequest

if TYPE_CHECKING:
    from pydantic import BaseModel

Request = TypeVar("Request", bound="BaseModel")
_UNIT = re.compile("_(s|m|hz)$")
_OTHER_NAMES = {
    "described": "specimen",
    "lengths": "cells",
    "models": "model",
    "amplitudes_m": "amplitude",
    "gaps_m": "gap",
    "damping_times_s": "damping-time",
}
"""Options that are not called as their field."""
_ALLOWED = {
    "greater_than": "it must be above {gt:g}",
    "greater_than_equal": "it must be {ge:g} or more",
    "less_than": "it must be below {lt:g}",
    "less_than_equal": "it must be {le:g} or less",
    "finite_number": "it must be a finite number",
}
"""What an option must be, by pydantic's type of fault."""


@dataclass(frozen=True)
class Fields:
    """Mark `RequestOptions`, in their ``Annotated`` type, with the fields that become options, in order."""

    names: tuple[str, ...]
    panel: str | None = None
    """Heading of these options in the help of the command."""


@dataclass(frozen=True)
class RequestOptions(Generic[Request]):
    """Options that were typed for fields of a request, which has its own default for every other field."""

    model: type[Request]
    typed: Mapping[str, Any]
    """Types by field."""

    def request(self, **others: object) -> Request:
        """Make the request, with other fields as the command has read them.

        Raises InvalidRequest with the option that is not allowed, what was given and what is allowed.
        """
        return validated(self.model, {**others, **self.typed})


def validated(model: type[Request], given: Mapping[str, object]) -> Request:
    """Make a request of options, by the names of its fields.

    Raises InvalidRequest with the first option that is not allowed, as it was typed.
    """
    from pydantic import ValidationError

    try:
        return model.model_validate(given)
    except ValidationError as error:
        fault = error.errors()[0]
        allowed = _ALLOWED.get(fault["type"], "").format(**fault.get("ctx", {}))
        said = allowed or fault["msg"].removeprefix("Value error, ")
        field = str(fault["loc"][0]) if fault["loc"] else ""
        value = given.get(field) if fault["input"] is None else fault["input"]
        place = f"--{option_name(field)} was given as {value!r}: " if field else ""
        raise InvalidRequest(place + said) from error


def option_name(field: str) -> str:
    """Name the option of a field, without dashes: ``duration_s`` is ``duration``."""
    return _OTHER_NAMES.get(field, _UNIT.sub("", field).replace("_", "-"))


def option(
    text: str,
    metavar: str | None = None,
    *,
    name: str = "",
    panel: str | None = None,
    min: int | None = None,  # noqa: A002
) -> OptionInfo:
    """Declare an option of the command line alone: its help, and its name where the parameter has another."""
    names = (name,) if name else ()
    made: OptionInfo = typer.Option(*names, metavar=metavar, help=text, rich_help_panel=panel, min=min)
    return made


def _option(model: "type[BaseModel]", name: str, panel: str | None) -> OptionInfo:
    field = model.model_fields[name]
    unit = _UNIT.search(name)
    plain = {int: "N", float: "NUMBER", str: "TEXT"}.get(_plain(field.annotation))
    return option("", unit[1].upper() if unit else plain, name=f"--{option_name(name)}", panel=panel)


def _help(model: "type[BaseModel]", name: str) -> str:
    """Read the help of a field's option: its docstring, and its default, which the model alone has."""
    from vibench.analysis.prediction.field_docstrings import field_docstring

    default = model.model_fields[name].default
    shown = default.value if isinstance(default, Enum) else default
    said = " ".join(field_docstring(model, name).split())
    return (
        said
        if model.model_fields[name].is_required() or shown in (None, "")
        else f"{said}  [default: {shown}]"
    )


def _plain(annotation: Any) -> Any:
    """Take limits and ``| None`` off a type; a choice between types is text, which the model reads."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) in (Union, UnionType):
        parts = [part for part in get_args(annotation) if part is not NoneType]
        return _plain(parts[0]) if len(parts) == 1 else str
    return annotation


def with_options(function: Callable[..., None]) -> Callable[..., None]:
    """Return a command's function the signature that typer reads, with an option for every field it asks for.

    A switch is typed as its name alone; ``--no-name`` exists only where a declaration says so.
    """
    signature = inspect.signature(function, eval_str=True)
    parameters: list[inspect.Parameter] = []
    requests: dict[str, tuple[type[BaseModel], tuple[str, ...]]] = {}
    for each in signature.parameters.values():
        kind, *marks = get_args(each.annotation)
        if get_origin(kind) is RequestOptions:
            (model,), (chosen,) = get_args(kind), marks
            requests[each.name] = model, chosen.names
            parameters += [_parameter(model, name, chosen.panel) for name in chosen.names]
        elif kind is bool and marks[0].default is ...:
            switch = copy(marks[0])
            switch.default = f"--{each.name.replace('_', '-')}"
            parameters.append(each.replace(annotation=Annotated[bool, switch]))
        else:
            parameters.append(each)
    parameters = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in parameters]

    @wraps(function)
    def run(**typed: Any) -> None:
        for name, (model, fields) in requests.items():
            values = {field: typed.pop(field) for field in fields}
            given = {field: value for field, value in values.items() if value is not None}
            typed[name] = RequestOptions(model, given)
        function(**typed)

    run.fields = {name: model for model, names in requests.values() for name in names}  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return run


def _parameter(model: "type[BaseModel]", name: str, panel: str | None) -> inspect.Parameter:
    field = model.model_fields[name]
    kind = _plain(field.annotation)
    default = inspect.Parameter.empty if field.is_required() else None
    if not field.is_required():
        kind = kind | None
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[kind, _option(model, name, panel)],
    )


class SectionedCommand(TyperCommand):
    """Writes its help as plain text, options with a heading of their own below the others.

    rich, with which typer would draw boxes, takes 75 ms to load.
    """

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write a section for arguments, for options and for every other heading."""
        sections: dict[str, list[tuple[str, str]]] = {}
        models = getattr(self.callback, "fields", {})
        for each in self.get_params(ctx):
            if isinstance(each, TyperOption) and each.name in models:
                each.help = _help(models[each.name], each.name)
            record = each.get_help_record(ctx)
            usual = "Arguments" if isinstance(each, TyperArgument) else "Options"
            if record is not None:
                sections.setdefault(getattr(each, "rich_help_panel", None) or usual, []).append(record)
        for title, rows in sections.items():
            with formatter.section(title):
                formatter.write_dl(rows)


_WHOLE = 1000
"""Letters of a command's line in a list."""


class SectionedGroup(TyperGroup):
    """Lists commands below their headings, each with the whole first line of its help."""

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write a section for every heading."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for name, each in self.commands.items():
            heading = getattr(each, "rich_help_panel", None) or "Commands"
            sections.setdefault(heading, []).append((name, each.get_short_help_str(_WHOLE)))
        for title, rows in sections.items():
            with formatter.section(title):
                formatter.write_dl(rows)
