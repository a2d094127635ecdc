"""Command-line options that are fields of a pydantic model.

Name, type, default and docstring of a field define the option, as they also define form fields, JSON keys and
HDF5 attributes. In the signature of a command, one parameter of type `RequestOptions` stands for all of these
options.
"""

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from enum import Enum
from functools import wraps
from itertools import pairwise
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
    "frequencies_hz": "frequency",
    "gaps_m": "gap",
    "damping_times_s": "damping-time",
}
"""Names of options that differ from the name of the model's field."""
_ALLOWED = {
    "greater_than": "it must be above {gt:g}",
    "greater_than_equal": "it must be {ge:g} or more",
    "less_than": "it must be below {lt:g}",
    "less_than_equal": "it must be {le:g} or less",
    "finite_number": "it must be a finite number",
}
"""Texts that state the allowed values, keyed by the type of pydantic's error."""
_EXAMPLES = {"error": "; for 1 % give 1%", "confidence": "; for 95 % give 0.95"}
"""Examples of allowed values, keyed by field."""


@dataclass(frozen=True)
class Fields:
    """Annotation of a `RequestOptions` parameter; lists the model's fields that become options, in order."""

    names: tuple[str, ...]
    panel: str | None = None


@dataclass(frozen=True)
class RequestOptions(Generic[Request]):
    """The options that the user gave for a request; fields without an option have their defaults."""

    model: type[Request]
    typed: Mapping[str, Any]

    def request(self, **others: object) -> Request:
        """Return the request with further fields set; raise InvalidRequest if a value is forbidden."""
        return build_request(self.model, {**others, **self.typed})


def build_request(model: type[Request], given: Mapping[str, object]) -> Request:
    """Return a request with these values; raise InvalidRequest, which names the first forbidden value."""
    from pydantic import ValidationError

    try:
        return model.model_validate(given)
    except ValidationError as error:
        fault = error.errors()[0]
        field = str(fault["loc"][0]) if fault["loc"] else ""
        allowed = _ALLOWED.get(fault["type"], "").format(**fault.get("ctx", {}))
        reason = (allowed or fault["msg"].removeprefix("Value error, ")) + _EXAMPLES.get(field, "")
        typed = given.get(field)
        value = typed if fault["input"] is None or isinstance(typed, str) else fault["input"]
        place = f"--{option_name(field)} was given as {value!r}: " if field else ""
        raise InvalidRequest(place + reason) from error


def option_name(field: str) -> str:
    """Return the option name of a field, without dashes: ``duration_s`` is ``duration``."""
    return _OTHER_NAMES.get(field, _UNIT.sub("", field).replace("_", "-"))


def option(
    text: str,
    metavar: str | None = None,
    *,
    name: str = "",
    panel: str | None = None,
    min: int | None = None,  # noqa: A002
    max: int | None = None,  # noqa: A002
    callback: Callable[..., object] | None = None,
) -> OptionInfo:
    """Return an option that is not a model's field; set ``name`` if it differs from the parameter's name."""
    names = (name,) if name else ()
    made: OptionInfo = typer.Option(
        *names, metavar=metavar, help=text, rich_help_panel=panel, min=min, max=max, callback=callback
    )
    return made


def _option(model: "type[BaseModel]", name: str, panel: str | None) -> OptionInfo:
    field = model.model_fields[name]
    unit = _UNIT.search(name)
    plain = {int: "N", float: "NUMBER", str: "TEXT"}.get(_plain(field.annotation))
    return option("", unit[1].upper() if unit else plain, name=f"--{option_name(name)}", panel=panel)


def _help(model: "type[BaseModel]", name: str) -> str:
    """Return the help text of an option: the docstring of the model's field, and its default."""
    from vibench.analysis.prediction.field_docstrings import field_docstring

    default = model.model_fields[name].default
    shown = default.value if isinstance(default, Enum) else default
    text = " ".join(field_docstring(model, name).split())
    is_bare = model.model_fields[name].is_required() or shown in (None, "")
    return text if is_bare else f"{text}  [default: {shown}]"


def _plain(annotation: Any) -> Any:
    """Return a field's type without limits and ``| None``.

    Return str for a union and for numbers with a unit, because the model parses their text.
    """
    from vibench.sim import NumberWith

    while get_origin(annotation) is Annotated:
        annotation, *marks = get_args(annotation)
        if any(isinstance(mark, NumberWith) for mark in marks):
            return str
    if get_origin(annotation) in (Union, UnionType):
        parts = [part for part in get_args(annotation) if part is not NoneType]
        return _plain(parts[0]) if len(parts) == 1 else str
    return annotation


def with_options(function: Callable[..., None]) -> Callable[..., None]:
    """Return a command's function with a signature for typer in which every field is an option.

    A switch has no value; the opposite ``--no-name`` exists only if the command declares it.
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


def words_of(args: Sequence[str]) -> list[str]:
    """Return the arguments, with each ``--name=value`` split into name and value."""
    return [part for each in args for part in (each.split("=", 1) if each[:2] == "--" else [each])]


class SectionedCommand(TyperCommand):
    """Command whose help is plain text, with a section for each heading.

    typer would draw boxes with rich, which takes 75 ms to load.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; refuse numbers that only Python accepts, such as 1_0."""
        kinds = getattr(self.callback, "__annotations__", {})
        numbers: list[Any] = [each for each in self.params if _plain(kinds.get(each.name)) in (float, int)]
        for name, word in pairwise(words_of(args)):
            given = next((each for each in numbers if name in each.opts), None)
            if given is not None and not (word.isascii() and "_" not in word):
                raise typer.BadParameter("it should be a valid number", ctx, given)
        return super().parse_args(ctx, args)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write a section of the help for arguments, for options, and for each other heading."""
        sections: dict[str, list[tuple[str, str]]] = {}
        models = getattr(self.callback, "fields", {})
        for each in self.get_params(ctx):
            if isinstance(each, TyperOption) and each.name in models:
                each.help = _help(models[each.name], each.name)
            record = each.get_help_record(ctx)
            usual = "Arguments" if isinstance(each, TyperArgument) else "Options"
            if record is not None:
                sections.setdefault(getattr(each, "rich_help_panel", None) or usual, []).append(record)
        _write_sections(formatter, sections)


def _write_sections(formatter: Any, sections: Mapping[str, list[tuple[str, str]]]) -> None:
    for title, rows in sections.items():
        with formatter.section(title):
            formatter.write_dl(rows)


_WHOLE = 1000
"""Width limit of a command's line in a list [characters], larger than any line."""


class SectionedGroup(TyperGroup):
    """Group whose help lists its commands under headings, each command with the first line of its help."""

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write a section of the command list for each heading."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for name, each in self.commands.items():
            heading = getattr(each, "rich_help_panel", None) or "Commands"
            sections.setdefault(heading, []).append((name, each.get_short_help_str(_WHOLE)))
        _write_sections(formatter, sections)
