"""Opening a file that may be anything: ours, broken, empty, cut short, or from a newer version."""

from pathlib import Path

import h5py

from vibench.sim import hdf5_files

from ..errors import RecordingError
from . import _layout as layout
from ._attributes import read_attributes
from ._checked_counts import CheckedCounts

LONGEST = 300
"""Letters that are shown of what is wrong: names and texts in a broken file may be of any length."""

_LOCKED_OTHERWISE = "file locking flag values don't match"
"""What HDF5 says of a file that this process has open already, with locks."""


def open_hdf5(path: Path) -> h5py.File:
    """Open a recording for reading; it may still be growing.

    Raises
    ------
    RecordingError
        One sentence for each way in which it is not a readable recording.

    """
    _require_file(path)
    try:
        file = hdf5_files.open_hdf5(path, locking=False)
    except hdf5_files.UnsafeHdf5 as error:
        raise RecordingError(f"{path} was not read: {str(error)[:LONGEST]}") from error
    except OSError as error:
        if _LOCKED_OTHERWISE in str(error):
            raise RecordingError(
                f"{path} is open in this program already, by another library and with another locking: close "
                "it there first. The file was not touched."
            ) from error
        raise RecordingError(
            f"{path} is no readable HDF5 file ({error}). It was cut short, or is something else;"
            " copy it again from where it was recorded."
        ) from error
    try:
        _require_ours(path, file)
    except BaseException:
        file.close()
        raise
    return file


def name_now(path: Path) -> Path:
    """Give the name that a recording has by now: one that was growing a moment ago may be finished."""
    if path.suffix != layout.PART_SUFFIX or path.exists():
        return path
    final = path.with_suffix("")
    return final if final.exists() else path


def _require_file(path: Path) -> None:
    if path.is_file():
        if path.stat().st_size == 0:
            raise RecordingError(f"{path} is empty (0 bytes). Copy it again from where it was recorded.")
        return
    part = layout.part_of(path)
    if part.is_file():
        raise RecordingError(
            f"{path} does not exist, but {part.name} does: it is being recorded, or was interrupted."
            f" Open {part.name} to look at it, or recover it."
        )
    raise RecordingError(
        f"{path} does not exist, or is no file. Check its name; vibench catalogue FOLDER lists recordings."
    )


def _require_ours(path: Path, file: h5py.File) -> None:
    try:
        attributes = read_attributes(file)
    except (OSError, RuntimeError, ValueError) as error:
        raise RecordingError(f"{path} is damaged: its attributes cannot be read ({error}).") from error
    if attributes.get("format") != layout.FORMAT:
        raise RecordingError(
            f"{path} is an HDF5 file, but no recording of vibench: its attribute 'format' is"
            f" {str(attributes.get('format', 'missing'))[:LONGEST]!r}, not {layout.FORMAT!r}."
        )
    version = attributes.get("format_version")
    if version != layout.FORMAT_VERSION:
        raise RecordingError(
            f"{path} has format version {str(version)[:LONGEST]}; this vibench reads version"
            f" {layout.FORMAT_VERSION}. Update vibench to read it."
        )


class OpenRecording:
    """The one thing about a recording that changes: its HDF5 handle."""

    def __init__(self, path: Path) -> None:
        self.path = name_now(path)
        try:
            self.file: h5py.File = open_hdf5(self.path)
        except RecordingError:
            # It may have been finished, and got its final name, between the two lines above.
            if name_now(self.path) == self.path:
                raise
            self.path = name_now(self.path)
            self.file = open_hdf5(self.path)
        self.counts = CheckedCounts()
        self.described = ""
        """What was read of it when it was opened, samples apart."""

    def reopen(self) -> None:
        """Look at it as it is now."""
        self.file.close()
        self.file = open_hdf5(self.path)
