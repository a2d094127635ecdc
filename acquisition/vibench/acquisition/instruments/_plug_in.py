"""Instruments by name: the entry points of installed packages, and our own rows beside them."""

import sys
from enum import StrEnum
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from ..errors import ConfigurationError


class PlugInKind(StrEnum):
    """What a plug-in is; the value is the group of its entry point."""

    GENERATOR = "vibench.generators"
    DIGITIZER = "vibench.digitizers"
    OUTPUT = "vibench.outputs"
    CONTROLLER = "vibench.controllers"
    SENSOR = "vibench.sensors"


_DRIVERS = "vibench.acquisition.drivers"
_SENSORS = "vibench.acquisition.rig"
# Rows here, and not of our own installed metadata: a checkout whose instruments change needs no new
# installation (docs/decisions/0053-instruments-by-plug-in.md).
OURS = tuple(
    EntryPoint(name, target, kind)
    for kind, name, target in (
        (PlugInKind.GENERATOR, "afg1022x", f"{_DRIVERS}:AFG1022_MODEL"),
        (PlugInKind.GENERATOR, "keysight33500b", f"{_DRIVERS}:KEYSIGHT_33500B_MODEL"),
        (PlugInKind.GENERATOR, "none", f"{_DRIVERS}:NO_GENERATOR"),
        (PlugInKind.GENERATOR, "file", f"{_DRIVERS}:FILE_GENERATOR"),
        (PlugInKind.DIGITIZER, "file", f"{_DRIVERS}:FilePlayer"),
        (PlugInKind.DIGITIZER, "daqmx", f"{_DRIVERS}:DaqmxDigitizer"),
        (PlugInKind.OUTPUT, "daqmx", f"{_DRIVERS}:DaqmxOutput"),
        (PlugInKind.DIGITIZER, "soundcard", f"{_DRIVERS}:SoundCardDigitizer"),
        (PlugInKind.OUTPUT, "soundcard", f"{_DRIVERS}:SoundCardOutput"),
        (PlugInKind.CONTROLLER, "lines", f"{_DRIVERS}:LineController"),
        (PlugInKind.SENSOR, "wire", f"{_SENSORS}:wire"),
        (PlugInKind.SENSOR, "accelerometer", f"{_SENSORS}:accelerometer"),
        (PlugInKind.SENSOR, "vibrometer", f"{_SENSORS}:vibrometer"),
    )
)


def plug_in_names(kind: PlugInKind) -> tuple[str, ...]:
    """Names that a hardware configuration may give, ours and those of installed packages.

    Parameters
    ----------
    kind
        Group of entry points.

    """
    return tuple(sorted({row.name for row in _rows(kind)}))


def plug_in(kind: PlugInKind, name: str) -> Any:
    """Load what an entry point names.

    Parameters
    ----------
    kind
        Group of entry points.
    name
        Word of the hardware configuration.

    Raises
    ------
    ConfigurationError
        When no package offers the name, two do, or the package that does cannot be imported.

    """
    found = {row.value: row for row in _rows(kind) if row.name == name}
    if not found:
        raise ConfigurationError(
            f"{name!r} is no instrument of {kind.value}: {', '.join(plug_in_names(kind))} are installed. "
            "Correct the driver in the hardware configuration, or install the package that offers it"
        )
    if len(found) > 1:
        raise ConfigurationError(
            f"{name!r} of {kind.value} is offered more than once ({', '.join(sorted(found))}); uninstall one"
        )
    (row,) = found.values()
    try:
        return row.load()
    except Exception as error:  # a stranger's module may raise whatever it likes
        raise ConfigurationError(
            f"{name!r} of {kind.value} is {row.value}, which cannot be loaded "
            f"({type(error).__name__}: {error}); install what its package needs, or correct its entry point"
        ) from error


def _rows(kind: PlugInKind) -> tuple[EntryPoint, ...]:
    return (*(row for row in OURS if row.group == kind), *_installed(kind, tuple(sys.path)))


@lru_cache(maxsize=len(PlugInKind))
def _installed(kind: PlugInKind, _path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Read what installed packages offer, once for a path: each channel asks, and a look takes 6 ms."""
    return tuple(entry_points(group=kind.value))
