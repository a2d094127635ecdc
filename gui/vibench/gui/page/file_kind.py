"""What lies in a file that somebody drops on the window, opens, or opens again."""

import tomllib
from enum import Enum, auto
from pathlib import Path

from vibench.acquisition import ConfigurationError, RecordingError, open_recording


class FileKind(Enum):
    """What the window can open; each page says which of them it takes."""

    FOLDER = auto()
    RECORDING = auto()
    BRANCHES = auto()
    TEST = auto()
    CAMPAIGN = auto()
    RIG = auto()


_TABLES = {
    "excitation": FileKind.TEST,
    "measurements": FileKind.CAMPAIGN,
    "sweeps": FileKind.CAMPAIGN,
    "generator": FileKind.RIG,
}
"""Keys of a TOML file that tell what it is."""


def file_kind(path: Path) -> FileKind:
    """Look at a file, or a folder.

    Raises
    ------
    ConfigurationError
        In one sentence, when it is nothing that the window opens.

    """
    if path.is_dir():
        return FileKind.FOLDER
    if path.name.endswith((".h5", ".h5.part")):
        return _of_hdf5(path)
    allowed = "open a recording (.h5), or a test, campaign or hardware configuration (.toml)"
    if path.suffix != ".toml":
        raise ConfigurationError(f"{path} is nothing that can be opened here; {allowed}")
    try:
        keys = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigurationError(f"{path} cannot be read ({error}); {allowed}") from error
    found = next((kind for key, kind in _TABLES.items() if key in keys), None)
    if found is None:
        raise ConfigurationError(f"{path} is no test, campaign or hardware configuration; {allowed}")
    return found


def _of_hdf5(path: Path) -> FileKind:
    try:
        open_recording(path).close()
    except RecordingError:
        # Compare reads it, or says why it cannot.
        return FileKind.BRANCHES if path.exists() else FileKind.RECORDING
    return FileKind.RECORDING
