"""Somebody else's instrument, held to its protocol: what it raises or gives instead is told in a sentence.

Our own drivers are not guarded: what they raise beyond their promises is a mistake of ours, and its traceback
is what mends it.
"""

from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from functools import cache
from typing import Any, cast, get_type_hints

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from ..errors import AcquisitionError, BrokenPromise
from ._plug_in import OURS, PlugInKind, plug_in


def driver_of(kind: PlugInKind, name: str, promise: type) -> Any:
    """Load a driver; one that is not ours is held to what it promises.

    Parameters
    ----------
    kind
        Group of entry points.
    name
        Word of the hardware configuration.
    promise
        Protocol of what the entry point names.

    Raises
    ------
    ConfigurationError
        As `plug_in` does.

    """
    found = plug_in(kind, name)
    is_ours = any(row.group == kind and row.name == name for row in OURS)
    return found if is_ours else Guarded(found, promise, f"{name!r} of {kind.value}")


class Guarded:
    """Stands before an instrument, or a driver, and lets through what its protocol promises."""

    def __init__(self, held: Any, promise: type, name: str) -> None:
        """``name`` is for sentences: ``"'plain_scpi' of vibench.generators"``."""
        self._held = held
        self._promise = promise
        self._name = name

    def __getattr__(self, member: str) -> Any:
        if member.startswith("_"):
            raise AttributeError(member)
        return self._let_through(member)

    def __call__(self, *given: Any) -> Any:
        """Ask a plug-in that is a function."""
        return self._let_through("__call__")(*given)

    def bare(self) -> Any:
        """Give what is guarded."""
        return self._held

    def _let_through(self, member: str) -> Any:
        found = self._tried(member, lambda: getattr(self._held, member))
        hint = _promised(self._promise).get(member, Any)
        if not callable(getattr(self._promise, member, None)):
            return self._as_promised(member, hint, found)
        return lambda *given, **named: self._as_promised(
            member, hint, self._tried(member, lambda: found(*map(_bare, given), **named))
        )

    def _tried(self, member: str, attempt: Callable[[], Any]) -> Any:
        try:
            return attempt()
        except AcquisitionError:
            raise
        except Exception as error:  # a stranger's code may raise whatever it likes
            raise self._broken(member, f"{type(error).__name__}: {error}") from error

    def _as_promised(self, member: str, hint: Any, found: Any) -> Any:
        if hint is type(None):
            return None
        if getattr(hint, "_is_protocol", False):
            return Guarded(found, hint, self._name)
        for fault in _faults(hint, found):
            raise self._broken(member, f"it gave {fault}")
        return found

    def _broken(self, member: str, what: str) -> BrokenPromise:
        asked = "when it was asked" if member == "__call__" else f"in {member}"
        return BrokenPromise(
            f"the plug-in {self._name} broke its promise {asked}: {what}. Have its package mended, and run "
            "its contract tests (docs/instruments.md); or name another driver in the hardware configuration"
        )


def _faults(hint: Any, value: object) -> Iterator[str]:
    """Hold a value to its type, a data class of ours field by field."""
    name = getattr(hint, "__name__", str(hint))
    if not is_dataclass(hint):
        yield from _part_faults(name, hint, value)
    elif isinstance(value, cast("type", hint)):
        for field, each in _hints(cast("type", hint)).items():
            yield from _part_faults(f"{name}.{field}", each, getattr(value, field))
    else:
        yield f"{value!r:.80} as {name}"


def _part_faults(name: str, hint: Any, value: object) -> Iterator[str]:
    try:
        _adapter(hint).validate_python(value)
    except ValidationError as error:
        yield f"{value!r:.80} as {name} ({error.errors()[0]['msg']})"


@cache
def _promised(promise: type) -> dict[str, Any]:
    """Give what each member of a protocol returns."""
    members = {name: getattr(promise, name) for name in dir(promise) if name == "__call__" or name[0] != "_"}
    functions = {name: each.fget if isinstance(each, property) else each for name, each in members.items()}
    return {name: _hints(each).get("return", Any) for name, each in functions.items()}


@cache
def _hints(annotated: Any) -> dict[str, Any]:
    return get_type_hints(annotated, include_extras=True)


@cache
def _adapter(hint: Any) -> TypeAdapter[Any]:
    has_own = isinstance(hint, type) and issubclass(hint, BaseModel)
    return TypeAdapter(hint, config=None if has_own else ConfigDict(arbitrary_types_allowed=True))


def _bare(given: Any) -> Any:
    """Give an instrument to its own package as it is."""
    return given.bare() if isinstance(given, Guarded) else given
