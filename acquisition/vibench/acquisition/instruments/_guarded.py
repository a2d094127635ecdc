"""Guard for plug-ins: it turns an exception, or a value that violates the protocol, into a short error.

Vibench's own drivers are not guarded: an unexpected exception is a bug and needs its traceback.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass, replace
from enum import StrEnum
from functools import cache, lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, cast, get_type_hints

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from ..errors import AcquisitionError, BrokenPromise, ConfigurationError
from ._protocols import Digitizer


class PlugInKind(StrEnum):
    """Kind of a plug-in; its value is the group of its entry point."""

    GENERATOR = "vibench.generators"
    DIGITIZER = "vibench.digitizers"
    OUTPUT = "vibench.outputs"
    CONTROLLER = "vibench.controllers"
    SENSOR = "vibench.sensors"
    EXCITATION = "vibench.excitations"
    """Plan of a kind of measurement. Here and below, the entry point's name is the ``kind`` in a plan."""
    FEEDBACK = "vibench.feedback"
    """Controller of a kind of measurement with feedback."""
    ANALYSIS = "vibench.analyses"
    DRAWING = "vibench.drawings"
    DRIVE = "vibench.drives"
    """Source that plays instead of the generator, named after its table in the hardware configuration."""
    VIRTUAL_INSTRUMENT = "vibench.virtual_instruments"
    """Simulation of such a source, named after the same table of the hardware configuration; or simulation of
    a USB generator, named after its vendor number: ``0x0699``."""


_DRIVERS = "vibench.acquisition.drivers"
_SENSORS = "vibench.acquisition.rig"
# The package metadata do not list these plug-ins: a checkout with other drivers then needs no new
# installation (docs/decisions/0053-instruments-by-plug-in.md).
OURS = tuple(
    EntryPoint(name, target, kind)
    for kind, name, target in (
        (PlugInKind.GENERATOR, "afg1022x", f"{_DRIVERS}:AFG1022_MODEL"),
        (PlugInKind.GENERATOR, "none", f"{_DRIVERS}:NO_GENERATOR"),
        (PlugInKind.DIGITIZER, "daqmx", f"{_DRIVERS}:DaqmxDigitizer"),
        (PlugInKind.OUTPUT, "daqmx", f"{_DRIVERS}:DaqmxOutput"),
        (PlugInKind.SENSOR, "wire", f"{_SENSORS}:wire"),
        (PlugInKind.SENSOR, "accelerometer", f"{_SENSORS}:transducer"),
        (PlugInKind.SENSOR, "vibrometer", f"{_SENSORS}:transducer"),
        (PlugInKind.SENSOR, "transducer", f"{_SENSORS}:transducer"),
        (PlugInKind.VIRTUAL_INSTRUMENT, "0x0699", "vibench.virtual_rig.generator.afg1022:AFG1022"),
    )
)


FOUND_IN: Mapping[str, str] = MappingProxyType(
    dict.fromkeys(("branch_continuation", "controller", "lines"), "fast_loop")
    | dict.fromkeys(("0x0957", "file", "keysight33500b", "soundcard"), "more_drivers")
)
"""Names that vibench's extensions provide, each with the folder of its extension in ``extensions``."""


def missing_package(name: str) -> str | None:
    """Return a sentence that names the package to install for a name such as ``"branch_continuation"``.

    ``name`` is a word in a plan or hardware configuration. Returns None if no extension of vibench provides
    it, or if the extension is installed.
    """
    folder = FOUND_IN.get(name)
    installed = (row.module for rows in _installed_plug_ins(tuple(sys.path)).values() for row in rows)
    if folder is None or any(module.startswith(f"vibench_{folder}") for module in installed):
        return None
    package = f"vibench-{folder.replace('_', '-')}"
    return (
        f"{name!r} needs {package}, which is not installed: run 'pip install extensions/{folder}' in the "
        "folder of vibench's sources"
    )


def plug_in_names(kind: PlugInKind) -> tuple[str, ...]:
    """Return the names that a hardware configuration may use: vibench's own and installed plug-ins."""
    return tuple(sorted({row.name for row in _rows(kind)}))


def require_plug_in(kind: PlugInKind, name: str, given: str = "") -> None:
    """Check that an installed package provides ``name``, a plug-in of this ``kind``.

    Raises ConfigurationError when no package does; ``given`` begins the text of the error.
    """
    if name not in (names := plug_in_names(kind)):
        absent = (
            f"{name!r} is not in {kind.value}; give one of {', '.join(names)}, or install a package that "
            "provides it (docs/instruments.md)"
        )
        raise ConfigurationError(given + (missing_package(name) or absent))


def plug_in(kind: PlugInKind, name: str) -> Any:
    """Load the object of an entry point, by its group ``kind`` and its ``name`` in a configuration.

    Raises ConfigurationError when no package or more than one provides the name, or the import fails.
    """
    require_plug_in(kind, name)
    found = {row.value: row for row in _rows(kind) if row.name == name}
    if len(found) > 1:
        raise ConfigurationError(
            f"{name!r} of {kind.value} is provided twice ({', '.join(sorted(found))}); uninstall one of them"
        )
    (row,) = found.values()
    try:
        return row.load()
    except Exception as error:  # a plug-in's module may raise anything
        raise ConfigurationError(
            f"{name!r} of {kind.value} is {row.value}, which cannot be loaded "
            f"({type(error).__name__}: {error}); install what its package needs, or correct its entry point"
        ) from error


def _rows(kind: PlugInKind) -> tuple[EntryPoint, ...]:
    return (*(row for row in OURS if row.group == kind), *_installed_plug_ins(tuple(sys.path))[kind])


@lru_cache(maxsize=1)
def _installed_plug_ins(_path: tuple[str, ...]) -> Mapping[PlugInKind, tuple[EntryPoint, ...]]:
    """Read the entry points of installed packages (6 ms); the result is cached for each ``sys.path``."""
    offered = entry_points()
    return {kind: tuple(offered.select(group=kind.value)) for kind in PlugInKind}


def driver_of(kind: PlugInKind, name: str, promise: type) -> Any:
    """Return a driver, guarded unless it is part of vibench; raises ConfigurationError like `plug_in`.

    ``kind`` is the group of entry points, ``name`` is the name in the hardware configuration, and ``promise``
    is the protocol of the entry point's object.
    """
    found = plug_in(kind, name)
    is_ours = any(row.group == kind and row.name == name for row in OURS)
    return found if is_ours else PlugInGuard(found, promise, f"{name!r} of {kind.value}")


_SILENCING = {"stop", "close", "silence"}
_ADVICE = (
    "Correct the plug-in and run its contract tests (docs/instruments.md), or set another driver in the "
    "hardware configuration"
)


class PlugInGuard:
    """Wrapper of an instrument or driver that passes on only values that its protocol allows."""

    def __init__(self, held: Any, promise: type, name: str) -> None:
        """Wrap the object ``held``, which errors call ``name``: ``"'plain_scpi' of vibench.generators"``."""
        self._held = held
        self._promise = promise
        self._name = name

    def __getattr__(self, member: str) -> Any:
        if member.startswith("_"):
            raise AttributeError(member)
        return self._let_through(member)

    def __call__(self, *given: Any) -> Any:
        return self._let_through("__call__")(*given)

    def bare(self) -> Any:
        """Return the instrument inside this wrapper."""
        return self._held

    def _let_through(self, member: str) -> Any:
        found = self._call_safely(member, lambda: getattr(self._held, member))
        hint = _return_types(self._promise).get(member, Any)
        if not callable(getattr(self._promise, member, None)):
            return self._validate(member, hint, found)
        return lambda *given, **named: self._validate(
            member, hint, self._call_safely(member, lambda: found(*map(_bare, given), **named))
        )

    def _call_safely(self, member: str, attempt: Callable[[], Any]) -> Any:
        try:
            return attempt()
        except AcquisitionError:
            raise
        except (Exception, SystemExit) as error:  # a plug-in's code may raise anything
            raise self._promise_error(member, f"{type(error).__name__}: {error}") from error

    def _validate(self, member: str, hint: Any, found: Any) -> Any:
        if hint is type(None):
            return None
        if getattr(hint, "_is_protocol", False):
            return PlugInGuard(found, hint, self._name)
        try:
            return _convert(hint, found)
        except (TypeError, ValueError) as error:
            raise self._promise_error(member, f"it returned {error}") from error

    def _promise_error(self, member: str, what: str) -> BrokenPromise:
        where = "when called" if member == "__call__" else f"in {member}"
        is_source = member in _SILENCING and self._promise is not Digitizer
        alarm = " THE OUTPUT MAY STILL BE ON: switch the amplifier off by hand." if is_source else ""
        return BrokenPromise(f"the plug-in {self._name} failed {where}: {what}.{alarm} {_ADVICE}")


def _convert(hint: Any, value: Any) -> Any:
    """Return a value converted to type ``hint`` (data classes by field); raises TypeError or ValueError."""
    name = getattr(hint, "__name__", str(hint))
    if not is_dataclass(hint):
        return _convert_field(name, hint, value)
    if not isinstance(value, cast("type", hint)):
        raise TypeError(f"{value!r:.80} as {name}")
    taken = {
        at: _convert_field(f"{name}.{at}", each, getattr(value, at))
        for at, each in _hints(cast("type", hint)).items()
    }
    return replace(cast("Any", value), **taken)


def _convert_field(name: str, hint: Any, value: object) -> Any:
    try:
        return _adapter(hint).validate_python(value)
    except ValidationError as error:
        raise ValueError(f"{value!r:.80} as {name} ({error.errors()[0]['msg']})") from error


@cache
def _return_types(promise: type) -> dict[str, Any]:
    members = {name: getattr(promise, name) for name in dir(promise) if name == "__call__" or name[0] != "_"}
    functions = {name: each.fget if isinstance(each, property) else each for name, each in members.items()}
    return {name: _hints(each).get("return", Any) for name, each in functions.items()}


@cache
def _hints(annotated: Any) -> dict[str, Any]:
    return get_type_hints(annotated, include_extras=True)


_PLAIN = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)


@cache
def _adapter(hint: Any) -> TypeAdapter[Any]:
    has_own = isinstance(hint, type) and issubclass(hint, BaseModel)
    return TypeAdapter(hint, config=None if has_own else _PLAIN)


def _bare(given: Any) -> Any:
    """Return the instrument without its guard, to be passed to a plug-in."""
    return given.bare() if isinstance(given, PlugInGuard) else given
