"""Options that several commands share."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vibench.acquisition import ConfigurationError, file_path

from .options import option
from .output import console

if TYPE_CHECKING:
    from vibench.acquisition.rig import Rig

BenchPath = Annotated[
    Path | None,
    option(
        "Hardware configuration, a file or a shipped name; by default virtual_rig.", "BENCH", name="--bench"
    ),
]
FaultsPath = Annotated[
    Path | None,
    option("Scheduled faults of a virtual rig: a file, or the name night.", "FAULTS", name="--faults"),
]


def _leave_output(is_json: bool) -> bool:
    """With ``--json``, send text to standard error, so that standard output contains only the document."""
    console.stderr = is_json
    return is_json


AsJson = Annotated[
    bool, option("Print one JSON document and nothing else.", name="--json", callback=_leave_output)
]


def _allow_external(context: typer.Context, is_allowed: bool) -> None:
    """If the user allows it, let HDF5 files link to other files until the command ends."""
    if is_allowed:
        from vibench.sim.hdf5_files import allow_external_data

        context.with_resource(allow_external_data())


AllowExternal = Annotated[
    bool,
    option(
        "Read data that HDF5 files keep in other files (external or virtual).",
        name="--allow-external",
        callback=_allow_external,
    ),
]


def bench_path(given: Path | None) -> Path:
    """Return the path of the hardware configuration; by default that of the virtual rig."""
    return file_path("virtual_rig" if given is None else given, "hardware_configs")


def rig_at(bench: Path | None, faults: Path | None) -> "Rig":
    """Return the rig of the given configuration, by default the virtual rig, with optional faults."""
    from vibench.acquisition.rig import load_rig, with_faults

    rig = load_rig(bench_path(bench))
    return rig if faults is None else with_faults(rig, faults)


def room_for_folder(path: Path) -> None:
    """Check, before computing, that a folder exists or can be created, and can be written to.

    Raises ConfigurationError when a file has the folder's name, or when writing is not permitted.
    """
    standing = next(each for each in (path, *path.resolve().parents) if each.exists())
    try:
        # Test by creating a folder: permissions do not stop administrators, and /proc accepts no folders.
        with tempfile.TemporaryDirectory(dir=standing) as trial, tempfile.TemporaryFile(dir=trial) as room:
            room.write(bytes(1 << 14))  # folders can be created even on a full disk
            return
    except OSError as error:
        why = f"cannot be written to ({error.strerror})" if standing.is_dir() else "is a file"
        raise ConfigurationError(
            f"{path} cannot be created as a folder: {standing} {why}. Nothing was computed; give a folder "
            "that exists, or the name of a new one"
        ) from error


SUFFIXES = frozenset(
    {".csv", ".h5", ".json", ".mat", ".nxs", ".toml", ".txt", ".uff", ".wav", ".xlsx", ".zip"}
)
"""Suffixes of known formats."""


def file_at(out: Path | None, usual: Path) -> Path:
    """Return the path of a new file: ``out`` or, if this is a folder, the usual name in the folder.

    An ``out`` without a suffix becomes a folder. Raises ConfigurationError when the file exists, or when the
    suffix belongs to another format.
    """
    if out is not None and not out.suffix and not out.exists():
        out.mkdir(parents=True)
    new = usual if out is None else out / usual.name if out.is_dir() else out
    require_suffix(new, usual.suffix)
    if new.exists():
        raise ConfigurationError(f"{new} exists, and nothing is ever overwritten; choose another name")
    return new


def require_suffix(path: Path, suffix: str) -> None:
    """Refuse the suffix of another format; raise ConfigurationError."""
    if path.suffix.lower() in SUFFIXES - {suffix}:
        raise ConfigurationError(f"{path} has the suffix of another format; use the suffix {suffix}")


def free_path(path: Path) -> Path:
    """Return the path if no file exists there; otherwise add -2, -3, ... before the suffix."""
    candidate, number = path, 1
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return candidate
