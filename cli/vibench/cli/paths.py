"""Options that several commands share."""

import tempfile
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from vibench.acquisition import ConfigurationError, named

from .options import option

if TYPE_CHECKING:
    from vibench.acquisition.rig import Rig

BenchPath = Annotated[
    Path | None,
    option(
        "Hardware configuration, a file or a shipped name; virtual_rig if absent.", "BENCH", name="--bench"
    ),
]
FaultsPath = Annotated[
    Path | None,
    option("What goes wrong with a virtual rig, and when; a file or night.", "FAULTS", name="--faults"),
]
AsJson = Annotated[bool, option("Print one JSON document and nothing else.", name="--json")]
AllowExternal = Annotated[
    bool,
    option(
        "Follow an HDF5 file into other files: external storage and links, virtual datasets.",
        name="--allow-external",
    ),
]


def external_data(allowed: bool) -> AbstractContextManager[None]:
    """Allow it while inside, if the user said so."""
    if not allowed:
        return nullcontext()
    from vibench.sim.hdf5_files.door import allow_external_data

    return allow_external_data()


def bench_path(given: Path | None) -> Path:
    """Path of the hardware configuration: what was given, or the virtual rig."""
    return named("virtual_rig" if given is None else given, "hardware_configs")


def rig_at(bench: Path | None, faults: Path | None) -> "Rig":
    """Read the hardware configuration that was given, or the virtual rig's, with faults if any are given."""
    from vibench.acquisition.rig import load_rig, with_faults

    rig = load_rig(bench_path(bench))
    return rig if faults is None else with_faults(rig, faults)


def room_for_folder(path: Path) -> None:
    """Refuse a folder that cannot be written to, before anything is computed for it; leaves none behind.

    Raises ConfigurationError when it, or what it would lie in, is a file or may not be written to.
    """
    standing = next(each for each in (path, *path.resolve().parents) if each.exists())
    try:
        # Permissions do not say it: who administers a computer has them all, and /proc holds no folders.
        with tempfile.TemporaryDirectory(dir=standing):
            return
    except OSError as error:
        why = "may not be written to" if standing.is_dir() else "is a file"
        raise ConfigurationError(
            f"{path} cannot be made a folder: {standing} {why}. Nothing was computed; give a folder that "
            "exists, or the name of a new one"
        ) from error


def room_for_page(path: Path) -> None:
    """Refuse a page that cannot be written, before anything is computed for it.

    Raises ConfigurationError when it is a folder, or its folder cannot be made.
    """
    if path.is_dir():
        raise ConfigurationError(f"{path} is a folder. Nothing was computed; give the name of a page in it")
    room_for_folder(path.parent)


def file_at(out: Path | None, usual: Path) -> Path:
    """Return the path of a new file: the one that was named, or in a folder that was, by its usual name.

    What is named without a suffix where nothing is, is a folder that is wanted: it is made.
    """
    if out is None:
        return usual
    if not out.suffix and not out.exists():
        out.mkdir(parents=True)
    return out / usual.name if out.is_dir() else out


def free_path(path: Path) -> Path:
    """Return a path that is not taken: the wish itself, or with -2, -3, ... before its suffix."""
    candidate, number = path, 1
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return candidate
